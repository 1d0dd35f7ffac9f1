/* Files written whole or not at all. Every call that can fail is checked, close included: on a full disk or a
 * network file system the error may come as late as that. */
#include "planner/folder_text.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

morph_status morph_name_fault(void) {
    return errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG ? MORPH_ERR_INPUT : MORPH_ERR_IO;
}

static int write_all(int fd, const char *data, size_t size) {
    while (size > 0) {
        /* Some systems refuse more than 2 GiB at once. */
        ssize_t n = write(fd, data, size < ((size_t)1 << 30) ? size : (size_t)1 << 30);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return -1;
        if (n == 0) {
            errno = ENOSPC;
            return -1;
        }
        data += n;
        size -= (size_t)n;
    }
    return 0;
}

static int sync_file(int fd) {
    int result;
    do
        result = fsync(fd);
    while (result != 0 && errno == EINTR);
    return result;
}

morph_status morph_file_put(const char *file, const void *data, size_t size, char *message,
                            size_t message_size) {
    int fd = open(file, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0)
        return morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be created: %s", file,
                          strerror(errno));
    int failed = write_all(fd, data, size) != 0 || sync_file(fd) != 0 ? errno : 0;
    if (close(fd) != 0 && !failed && errno != EINTR) failed = errno;
    if (failed) {
        unlink(file);
        errno = failed;
        return morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be written: %s", file,
                          strerror(failed));
    }
    return MORPH_OK;
}

morph_status morph_file_replace(const char *file, const void *data, size_t size, char *message,
                                size_t message_size) {
    struct stat info;
    if (stat(file, &info) == 0 && !S_ISREG(info.st_mode))
        return morph_fail(MORPH_ERR_INPUT, message, message_size, "%s: is not a regular file", file);
    const char *slash = strrchr(file, '/');
    const char *name = slash ? slash + 1 : file;
    int folder = (int)(name - file);
    if (!*name) return morph_fail(MORPH_ERR_INPUT, message, message_size, "%s: is not a file name", file);
    size_t room = strlen(file) + 48;
    char *beside = malloc(room);
    if (!beside) return morph_fail(MORPH_ERR_NOMEM, message, message_size, "%s: out of memory", file);
    snprintf(beside, room, "%.*s.%.200s.tmp-%ld", folder, file, name, (long)getpid());
    unlink(beside); /* of a killed run that had the same number */
    morph_status status = morph_file_put(beside, data, size, message, message_size);
    if (status != MORPH_OK) {
        /* The reader knows the file that was asked for, not the one beside it. */
        if (status == MORPH_ERR_IO) status = morph_name_fault();
        morph_fail(status, message, message_size, "%s: cannot be written: %s", file, strerror(errno));
    } else if (rename(beside, file) != 0) {
        int failed = errno;
        unlink(beside);
        errno = failed;
        status = morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be written: %s", file,
                            strerror(failed));
    }
    free(beside);
    return status;
}

static morph_status load(int fd, const char *file, char **data, size_t *size, char *message,
                         size_t message_size) {
    struct stat info;
    if (fstat(fd, &info) != 0)
        return morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be read: %s", file,
                          strerror(errno));
    if (!S_ISREG(info.st_mode))
        return morph_fail(MORPH_ERR_INPUT, message, message_size, "%s: is not a regular file", file);
    size_t total = (size_t)info.st_size, have = 0;
    char *text = malloc(total + 1);
    if (!text) return morph_fail(MORPH_ERR_NOMEM, message, message_size, "%s: out of memory", file);
    while (have < total) {
        ssize_t n = read(fd, text + have, total - have);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            free(text);
            return morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be read: %s", file,
                              strerror(errno));
        }
        if (n == 0) break; /* it shrank while being read */
        have += (size_t)n;
    }
    text[have] = 0;
    *data = text;
    *size = have;
    return MORPH_OK;
}

morph_status morph_file_load(const char *file, char **data, size_t *size, char *message,
                             size_t message_size) {
    *data = NULL;
    *size = 0;
    /* Not blocking: a named pipe must not hang the program before it is refused. */
    int fd = open(file, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return morph_fail(MORPH_ERR_IO, message, message_size, "%s: cannot be read: %s", file,
                          strerror(errno));
    morph_status status = load(fd, file, data, size, message, message_size);
    int kept = errno;
    close(fd);
    errno = kept;
    return status;
}

char *morph_path_join(const char *folder, const char *name) {
    size_t a = strlen(folder), b = strlen(name);
    char *path = malloc(a + b + 2);
    if (!path) return NULL;
    memcpy(path, folder, a);
    if (a > 0 && folder[a - 1] != '/') path[a++] = '/';
    memcpy(path + a, name, b + 1);
    return path;
}

int morph_folder_sync(const char *folder) {
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return -1;
    int failed = sync_file(fd) != 0 && errno != EINVAL && errno != ENOTSUP ? errno : 0;
    close(fd);
    errno = failed;
    return failed ? -1 : 0;
}
