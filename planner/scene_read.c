/* A scene from a file: the parts together, the short sections, and how faults leave. */
#include "planner/scene_parts.h"
#include "planner/sha256.h"
#include "planner/start.h"

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *const morph_mode_names[2] = {"drop", "rise"};

/* title goes into a summary with room for 127 bytes. */
enum { TITLE_BYTES = 120 };

static const morph_range height_range = {0.0, MORPH_SCENE_LARGEST, false, "m"};
static const morph_range gravity_range = {0.0, MORPH_SCENE_LARGEST, false, "m/s2"};
static const morph_range drag_range = {0.0, MORPH_SCENE_LARGEST, false, ""};
static const morph_range friction_range = {0.0, 100.0, false, ""};
/* An hour of dynamics at a step of some microseconds is already days of computing. */
static const morph_range time_range = {0.0, 3600.0, true, "s"};
static const morph_range base_range = {-MORPH_SCENE_LARGEST, MORPH_SCENE_LARGEST, false, "m"};
static const morph_range sample_range = {1e-6, 10.0, false, "s"};
static const morph_range duration_range = {0.0, 1e5, true, "s"};

/* Bytes of a file and a 0 behind them; one byte more than allowed is read of a file that is too large. */
static morph_status read_file(const char *path, char **bytes, size_t *size) {
    *bytes = NULL;
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return MORPH_ERR_IO;
    const size_t most = (size_t)MORPH_YAML_BYTES + 1;
    char *buffer = malloc(most + 1);
    size_t used = 0;
    ssize_t n = 1;
    while (buffer && used < most && n != 0) {
        n = read(file, buffer + used, most - used);
        if (n < 0 && errno != EINTR) break;
        if (n > 0) used += (size_t)n;
    }
    const int error = errno;
    close(file);
    if (!buffer) return MORPH_ERR_NOMEM;
    if (n < 0) {
        free(buffer);
        errno = error;
        return MORPH_ERR_IO;
    }
    buffer[used] = '\0';
    *bytes = buffer;
    *size = used;
    return MORPH_OK;
}

/* The file's name without folder and ending. */
static char *default_title(const char *path) {
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    size_t n = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    if (n > TITLE_BYTES) n = TITLE_BYTES;
    char *title = malloc(n + 1);
    if (!title) return NULL;
    /* A name may hold any byte: what could not be read back as a title is replaced. */
    for (size_t k = 0; k < n; k++)
        title[k] = name[k] >= 0x20 && name[k] < 0x7f ? name[k] : '_';
    title[n] = '\0';
    if (n == 0) {
        free(title);
        return strdup("morph");
    }
    return title;
}

static void read_head(morph_scene_reader *r, const morph_value *root) {
    const morph_value version = morph_value_get(root, "morphplan"), title = morph_value_get(root, "title");
    long number;
    if (!version.node) morph_value_fault(&version, "is missing, allowed: 1, the version of the scene format");
    morph_value_integer(&version, 1, 1, &number);
    if (morph_value_text(&title, TITLE_BYTES, &r->scene->title) == MORPH_ABSENT)
        r->scene->title = default_title(r->yaml.path);
    if (!r->scene->title && !title.node) r->yaml.faults.nomem = true;
}

static void read_base(morph_scene_reader *r, const morph_value *root) {
    const morph_value base = morph_value_get(root, "base");
    r->scene->base = 0.0;
    if (morph_value_is(&base, "none"))
        r->scene->base = NAN;
    else
        morph_value_number(&base, &base_range, &r->scene->base);
}

static void read_schedule(morph_scene_reader *r, const morph_value *root) {
    const morph_value schedule = morph_scene_section(root, "schedule");
    const morph_value sample = morph_value_get(&schedule, "sample");
    const morph_value duration = morph_value_get(&schedule, "duration");
    morph_scene *scene = r->scene;
    scene->sample = 0.001;
    scene->duration = 0.0;
    const bool sampled = morph_value_number(&sample, &sample_range, &scene->sample) != MORPH_FAULTY;
    if (morph_value_is(&duration, "auto")) return;
    if (morph_value_number(&duration, &duration_range, &scene->duration) != MORPH_FOUND || !sampled) return;

    /* Decimal seconds are no exact doubles: their quotient is whole to a few units in the last place. */
    const double samples = scene->duration / scene->sample;
    char seconds[MORPH_NUMBER_TEXT], step[MORPH_NUMBER_TEXT];
    morph_number_print(scene->duration, seconds);
    morph_number_print(scene->sample, step);
    if (samples >= MORPH_SCENE_SAMPLES + 0.5) {
        char longest[MORPH_NUMBER_TEXT], coarser[MORPH_NUMBER_TEXT];
        morph_number_print(scene->sample * MORPH_SCENE_SAMPLES, longest);
        morph_number_print(scene->duration / MORPH_SCENE_SAMPLES, coarser);
        morph_value_fault(&duration,
                          "%s s at a schedule.sample of %s s is too many samples, allowed: at most %d, so a "
                          "duration of at most %s s or a schedule.sample of at least %s s",
                          seconds, step, MORPH_SCENE_SAMPLES, longest, coarser);
    } else if (fabs(samples - round(samples)) > 1e-12 * samples + 1e-12 || samples < 0.5)
        morph_value_fault(&duration, "%s is no whole number of samples, allowed: a multiple of %s s, or auto",
                          seconds, step);
}

static void read_all(morph_scene_reader *r, const morph_value *root) {
    if (!morph_value_is_map(root)) {
        char is[80];
        morph_value_describe(root, is, sizeof is);
        morph_fault_add(&r->yaml, root->line, "scene", "%s, allowed: a mapping with the keys of a scene", is);
        return;
    }
    morph_scene_check_keys(root);
    read_head(r, root);
    morph_scene_read_structure(r, root);
    read_base(r, root);
    morph_scene_read_target(r, root);
    morph_scene_read_motion(r, root);
    morph_scene_read_extras(r, root);
    read_schedule(r, root);
}

/* The sections, then the target; status OK, INPUT with faults left, or what failed. */
static morph_status parse(morph_scene_reader *r, const char *path, const char *bytes, size_t size) {
    morph_status status = morph_yaml_open(&r->yaml, path, bytes, size);
    if (status != MORPH_OK) return status;
    morph_scene *scene = r->scene = calloc(1, sizeof *scene);
    if (!scene) return MORPH_ERR_NOMEM;
    morph_sha256_text(bytes, size, scene->sha256);
    scene->file = strdup(path);
    if (!scene->file) return MORPH_ERR_NOMEM;

    const morph_value root = morph_yaml_root(&r->yaml);
    read_all(r, &root);
    if (r->target_known && !r->yaml.faults.nomem) status = morph_scene_build_target(r, &root);
    if (status == MORPH_OK && r->yaml.faults.count == 0) status = morph_scene_build_start(r, &root);
    return status;
}

static void emit(const morph_faults *faults, morph_fault_sink sink, void *user) {
    for (int k = 0; sink && k < faults->count; k++)
        sink(user, faults->fault[k].text);
}

/* The caller's thread reads and prints numbers with '.' while a scene is worked on, whatever its locale; the
 * sinks run under the caller's own. */
morph_status morph_scene_parse(const char *path, const char *bytes, size_t size, morph_fault_sink fault,
                               morph_fault_sink warn, void *user, morph_scene **out) {
    *out = NULL;
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!plain) return MORPH_ERR_NOMEM;
    const locale_t before = uselocale(plain);
    morph_scene_reader r = {0};
    morph_status status = parse(&r, path, bytes, size);
    morph_faults_sort(&r.yaml.faults);
    morph_faults_sort(&r.yaml.warnings);
    uselocale(before);
    freelocale(plain);

    if (r.yaml.faults.nomem || r.yaml.warnings.nomem) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK && r.yaml.faults.count > 0) status = MORPH_ERR_INPUT;
    if (status == MORPH_OK || status == MORPH_ERR_INPUT) {
        emit(&r.yaml.warnings, warn, user);
        emit(&r.yaml.faults, fault, user);
    }
    if (status == MORPH_OK)
        *out = r.scene;
    else
        morph_scene_destroy(r.scene);
    morph_yaml_close(&r.yaml);
    return status;
}

morph_status morph_scene_read(const char *path, morph_fault_sink fault, morph_fault_sink warn, void *user,
                              morph_scene **out) {
    *out = NULL;
    char *bytes;
    size_t size = 0;
    const morph_status status = read_file(path, &bytes, &size);
    if (status == MORPH_ERR_IO) {
        morph_yaml none = {.path = path};
        morph_fault_add(&none, 1, "scene", "cannot be read: %s, allowed: a readable file", strerror(errno));
        const bool nomem = none.faults.nomem;
        emit(&none.faults, fault, user);
        morph_faults_free(&none.faults);
        return nomem ? MORPH_ERR_NOMEM : MORPH_ERR_INPUT;
    }
    if (status != MORPH_OK) return status;
    const morph_status parsed = morph_scene_parse(path, bytes, size, fault, warn, user, out);
    free(bytes);
    return parsed;
}

void morph_scene_destroy(morph_scene *scene) {
    if (!scene) return;
    free(scene->file);
    free(scene->title);
    free(scene->target_def.file);
    free(scene->target_def.file_as_written);
    morph_mesh_free(&scene->target);
    free(scene->touch);
    free(scene->centre);
    free(scene->fixed_node);
    free(scene->stuck_link);
    morph_start_free(&scene->start);
    free(scene);
}

void morph_scene_read_motion(morph_scene_reader *r, const morph_value *root) {
    const morph_value map = morph_scene_section(root, "motion");
    morph_scene *scene = r->scene;
    morph_motion_def *motion = &scene->motion;
    *motion = (morph_motion_def){MORPH_MODE_DROP, scene->structure.spacing, 9.81, 0.2, 0.6, 3.0};

    const morph_value mode = morph_value_get(&map, "mode");
    int chosen = 0;
    morph_value_choice(&mode, morph_mode_names, 2, &chosen);
    motion->mode = (morph_mode)chosen;

    const struct {
        const char *key;
        const morph_range *range;
        double *out;
    } numbers[] = {{"gravity", &gravity_range, &motion->gravity},
                   {"drag", &drag_range, &motion->drag},
                   {"friction", &friction_range, &motion->friction},
                   {"time", &time_range, &motion->time}};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        const morph_value value = morph_value_get(&map, numbers[k].key);
        morph_value_number(&value, numbers[k].range, numbers[k].out);
    }
    const morph_value height = morph_value_get(&map, "height");
    const morph_found found = morph_value_number(&height, &height_range, &motion->height);
    if (found == MORPH_FOUND && motion->mode == MORPH_MODE_RISE && !(motion->height > 0.0))
        morph_value_fault(&height, "0 lets the target rise by nothing, allowed: a number above 0 m");
    if (found == MORPH_FOUND && r->spacing_known && motion->mode == MORPH_MODE_DROP &&
        motion->height < scene->structure.radius) {
        char is[MORPH_NUMBER_TEXT], least[MORPH_NUMBER_TEXT];
        morph_number_print(motion->height, is);
        morph_number_print(scene->structure.radius, least);
        morph_value_fault(
            &height, "at %s the links start inside the target, allowed: at least their radius %s", is, least);
    }
    morph_scene_read_touch(r, &map);
}
