#define _GNU_SOURCE /* renameat2 */
#include "planner/folder_place.h"
#include "planner/folder_text.h"
#include "planner/record_h5.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Hidden names: .NAME.tmp-PID-XXXX holds a plan being built, .NAME.old-PID-XXXX an old one moved aside. */
#define NAME_CUT 200 /* of NAME, so that the hidden name stays within the 255 bytes of a file name */

int morph_place_remove(const char *folder) {
    DIR *open = opendir(folder);
    if (!open) return -1;
    int failed = 0;
    for (struct dirent *entry; !failed && (entry = readdir(open));) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
        if (unlinkat(dirfd(open), entry->d_name, 0) != 0) failed = errno;
    }
    closedir(open);
    if (!failed && rmdir(folder) != 0) failed = errno;
    errno = failed;
    return failed ? -1 : 0;
}

/* "PARENT/.NAME.KIND-PID-XXXX"; NULL without memory. */
static char *hidden_name(const morph_place *place, const char *kind, unsigned salt) {
    char name[NAME_CUT + 48];
    snprintf(name, sizeof name, ".%.*s.%s-%ld-%04x", NAME_CUT, place->name, kind, (long)getpid(),
             salt & 0xFFFFU);
    return morph_path_join(place->parent, name);
}

/* Is `name` a hidden one of this place with this kind, of a process that is gone? */
static bool is_stale(const morph_place *place, const char *name, const char *kind) {
    char lead[NAME_CUT + 16];
    int n = snprintf(lead, sizeof lead, ".%.*s.%s-", NAME_CUT, place->name, kind);
    if (strncmp(name, lead, (size_t)n) != 0) return false;
    char *stop;
    long pid = strtol(name + n, &stop, 10);
    return pid > 0 && *stop == '-' && strlen(stop + 1) == 4 && kill((pid_t)pid, 0) != 0 && errno == ESRCH;
}

/* The builder holds a lock on its folder: a process of another machine or container, whose number says
 * nothing here, is left alone too. */
static void remove_stage(const char *path) {
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return;
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) morph_place_remove(path);
    close(fd);
}

/* Killed between the two renames of a swap: the old plan goes back where it was. */
static void restore(morph_place *place, const char *path) {
    struct stat info;
    if (lstat(place->folder, &info) == 0)
        remove_stage(path);
    else if (errno == ENOENT && rename(path, place->folder) == 0)
        place->exists = true;
}

static void clean(morph_place *place) {
    DIR *open = opendir(place->parent);
    if (!open) return;
    for (struct dirent *entry; (entry = readdir(open));) {
        bool stage = is_stale(place, entry->d_name, "tmp");
        if (!stage && !is_stale(place, entry->d_name, "old")) continue;
        char *path = morph_path_join(place->parent, entry->d_name);
        if (path && stage) remove_stage(path);
        if (path && !stage) restore(place, path);
        free(path);
    }
    closedir(open);
}

/* Splits an absolute or relative path at its last slash. */
static morph_status split(morph_place *place) {
    size_t n = strlen(place->folder);
    while (n > 1 && place->folder[n - 1] == '/')
        place->folder[--n] = 0;
    char *slash = strrchr(place->folder, '/');
    place->name = strdup(slash ? slash + 1 : place->folder);
    if (!slash)
        place->parent = strdup(".");
    else
        place->parent = strndup(place->folder, slash == place->folder ? 1 : (size_t)(slash - place->folder));
    return place->name && place->parent ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status locate(const char *folder, morph_place *place, char *message, size_t size) {
    struct stat info;
    place->lock = -1;
    if (lstat(folder, &info) == 0) {
        place->exists = true;
        place->folder = realpath(folder, NULL);
        if (!place->folder)
            return morph_fail(errno == ENOMEM ? MORPH_ERR_NOMEM : MORPH_ERR_IO, message, size,
                              "%s: cannot be used as %s folder: %s", folder, place->kind.what,
                              strerror(errno));
    } else if (errno != ENOENT) {
        return morph_fail(morph_name_fault(), message, size, "%s: cannot be used as plan folder: %s", folder,
                          strerror(errno));
    } else {
        place->folder = strdup(folder);
    }
    if (!place->folder || split(place) != MORPH_OK)
        return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", folder);
    if (!*place->name || strcmp(place->name, ".") == 0 || strcmp(place->name, "..") == 0)
        return morph_fail(MORPH_ERR_INPUT, message, size, "\"%s\": is no name for a %s folder", folder,
                          place->kind.what);
    if (stat(place->parent, &info) != 0)
        return morph_fail(morph_name_fault(), message, size, "%s: the folder for it, %s: %s", folder,
                          place->parent, strerror(errno));
    if (!S_ISDIR(info.st_mode))
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: %s is not a folder", folder, place->parent);
    return MORPH_OK;
}

/* A plan folder holds plain files only. One that holds folders or links was made by someone else, or has
 * grown into something that nobody would want to lose. */
static bool holds_files_only(const char *folder) {
    DIR *open = opendir(folder);
    if (!open) return false;
    bool plain = true;
    for (struct dirent *entry; plain && (entry = readdir(open));) {
        struct stat info;
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
        plain = fstatat(dirfd(open), entry->d_name, &info, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(info.st_mode);
    }
    closedir(open);
    return plain;
}

static morph_status may_replace(const morph_place *place, const char *folder, bool overwrite, char *message,
                                size_t size) {
    if (!overwrite)
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: is there already: name another folder, or exchange it with --overwrite",
                          folder);
    const morph_place_kind *kind = &place->kind;
    char *sign = morph_path_join(place->folder, kind->sign);
    if (!sign) return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", folder);
    bool known = kind->known(sign);
    free(sign);
    if (!known)
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: is not overwritten: it is no %s folder (no %s of a %s in it)", folder,
                          kind->what, kind->sign, kind->what);
    if (!holds_files_only(place->folder))
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: is not overwritten: it holds more than the files of a %s", folder, kind->what);
    return MORPH_OK;
}

morph_status morph_place_find(const char *folder, bool overwrite, morph_place *place, char *message,
                              size_t size) {
    const morph_place_kind plan = {"plan", "plan.h5", morph_record_is_plan};
    return morph_place_find_kind(folder, overwrite, plan, place, message, size);
}

morph_status morph_place_find_kind(const char *folder, bool overwrite, morph_place_kind kind,
                                   morph_place *place, char *message, size_t size) {
    *place = (morph_place){.kind = kind, .lock = -1};
    morph_status status = locate(folder, place, message, size);
    if (status == MORPH_OK) clean(place);
    if (status == MORPH_OK && place->exists) status = may_replace(place, folder, overwrite, message, size);
    if (status != MORPH_OK) morph_place_close(place);
    return status;
}

morph_status morph_place_stage(morph_place *place, char *message, size_t size) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    for (unsigned attempt = 0; attempt < 100; attempt++) {
        char *path = hidden_name(place, "tmp", (unsigned)(now.tv_nsec / 1000) + attempt);
        if (!path) return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", place->folder);
        if (mkdir(path, 0777) == 0) {
            place->stage = path;
            place->lock = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
            /* Without locks (some network disks) the process number alone protects it. */
            if (place->lock >= 0) (void)!flock(place->lock, LOCK_EX | LOCK_NB);
            return MORPH_OK;
        }
        int failed = errno;
        free(path);
        errno = failed;
        if (failed != EEXIST) break;
    }
    return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be created: %s", place->folder,
                      strerror(errno));
}

morph_status morph_place_swap(morph_place *place, char *message, size_t size) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    char *aside = hidden_name(place, "old", (unsigned)(now.tv_nsec / 1000));
    if (!aside) return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", place->folder);
    morph_status status = MORPH_OK;
    if (rename(place->folder, aside) != 0) {
        status = morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be replaced: %s", place->folder,
                            strerror(errno));
    } else if (rename(place->stage, place->folder) != 0) {
        int failed = errno;
        if (rename(aside, place->folder) == 0)
            morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be replaced: %s", place->folder,
                       strerror(failed));
        else
            morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be replaced: %s; the old plan is in %s",
                       place->folder, strerror(failed), aside);
        errno = failed;
        status = MORPH_ERR_IO;
    } else {
        free(place->stage);
        place->stage = NULL;
        morph_place_remove(aside); /* a failure leaves a hidden folder that the next run removes */
    }
    free(aside);
    return status;
}

static bool unsupported(int error) {
    return error == ENOSYS || error == EINVAL || error == ENOTSUP;
}

/* 0, or -1 with errno; ENOSYS where the system has no such call. */
static int rename_with(const char *from, const char *to, bool exchange) {
#if defined(RENAME_EXCHANGE) && defined(RENAME_NOREPLACE)
    return renameat2(AT_FDCWD, from, AT_FDCWD, to, exchange ? RENAME_EXCHANGE : RENAME_NOREPLACE);
#else
    (void)from, (void)to, (void)exchange;
    errno = ENOSYS;
    return -1;
#endif
}

static morph_status move_in(morph_place *place, char *message, size_t size) {
    if (rename_with(place->stage, place->folder, false) != 0) {
        struct stat info;
        /* Without the call, what is there is looked for first; rename itself refuses all but an empty
         * folder. */
        if (!unsupported(errno) ||
            (lstat(place->folder, &info) == 0 ? (errno = EEXIST, true) : errno != ENOENT) ||
            rename(place->stage, place->folder) != 0)
            return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be put in place: %s", place->folder,
                              strerror(errno));
    }
    free(place->stage);
    place->stage = NULL;
    return MORPH_OK;
}

morph_status morph_place_commit(morph_place *place, bool overwrite, char *message, size_t size) {
    if (morph_folder_sync(place->stage) != 0)
        return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be written: %s", place->folder,
                          strerror(errno));
    /* Looked at again: what has come meanwhile may be no plan, what was there may be gone. */
    struct stat info;
    place->exists = lstat(place->folder, &info) == 0;
    morph_status status = MORPH_OK;
    if (place->exists) status = may_replace(place, place->folder, overwrite, message, size);
    if (status == MORPH_OK && !place->exists) {
        status = move_in(place, message, size);
    } else if (status == MORPH_OK && rename_with(place->stage, place->folder, true) != 0) {
        status = unsupported(errno) ? morph_place_swap(place, message, size)
                                    : morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be replaced: %s",
                                                 place->folder, strerror(errno));
    }
    /* The plan is in place and its files are on the disk; a parent that cannot sync is no failure. After an
     * exchange the hidden folder holds the old plan, and closing the place removes it. */
    if (status == MORPH_OK) morph_folder_sync(place->parent);
    return status;
}

void morph_place_close(morph_place *place) {
    int kept = errno;
    if (place->stage) morph_place_remove(place->stage);
    if (place->lock >= 0) close(place->lock);
    free(place->folder);
    free(place->parent);
    free(place->name);
    free(place->stage);
    *place = (morph_place){.lock = -1};
    errno = kept;
}
