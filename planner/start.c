#include "planner/start.h"

#include "model/align.h"
#include "model/kinematics.h"
#include "planner/blocks.h"
#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/start_parts.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const char *morph_start_name(morph_start_kind kind) {
    static const char *const names[] = {"flat", "plan", "lengths", "pose"};
    return names[kind];
}

static void drop(morph_start *start) {
    free(start->pose);
    free(start->length);
    start->pose = start->length = NULL;
    start->joints = start->links = 0;
}

void morph_start_free(morph_start *start) {
    drop(start);
    free(start->file);
    free(start->as_written);
    *start = (morph_start){0};
}

/* Limits are read back bit for bit; another program's may differ in the last digit. */
static bool same(double a, double b) {
    return fabs(a - b) <= 1e-12 * fmax(fabs(a), fabs(b));
}

static bool same_all(const double *a, const double *b, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!same(a[i], b[i])) return false;
    return true;
}

static bool same_links(const morph_record *r, const morph_structure *s) {
    for (int l = 0; l < s->links; l++)
        if (r->link_kind[l] != s->link_kind[l] || r->link[l][0] != s->link[l][0] ||
            r->link[l][1] != s->link[l][1])
            return false;
    return true;
}

static bool held(const double limit[2]) {
    return limit[0] == limit[1];
}

static bool same_lengths(const morph_record *r, const morph_structure *s) {
    for (int l = 0; l < s->links; l++)
        if (!held(r->length_limit[l]) && !held(s->length_limit[l]) &&
            !same_all(r->length_limit[l], s->length_limit[l], 2))
            return false;
    return true;
}

/* The key of the first thing in which a plan's structure is another one; NULL where it is the same. */
static const char *difference(const morph_record *r, const morph_structure *s) {
    const size_t links = (size_t)s->links;
    if (r->joints != s->joints || r->links != s->links || r->posts != s->posts || !same_links(r, s) ||
        r->link_posts != s->link_posts || r->link_links != s->link_links || r->panels != s->panels)
        return "structure.nodes, layout, joints or bracing";
    if (!same(r->spacing, s->spacing)) return "structure.spacing";
    if (s->posts > 0 && !same_all(r->post_length, s->post_length, (size_t)s->posts))
        return "structure.thickness";
    if (!same_lengths(r, s)) return "structure.link.length";
    if (!same_all(r->link_radius, s->link_radius, links)) return "structure.link.radius";
    if (!same_all(r->rate_limit, s->rate_limit, links)) return "structure.link.rate";
    if (!same_all(r->acceleration_limit, s->acceleration_limit, links)) return "structure.link.acceleration";
    if (!same_all(r->jerk_limit, s->jerk_limit, links)) return "structure.link.jerk";
    if (s->link_posts > 0 &&
        !same_all(&r->link_post_limit[0][0], &s->link_post_limit[0][0], 2 * (size_t)s->link_posts))
        return "structure.angle.link_post";
    if (!same_all(&r->link_link_limit[0][0], &s->link_link_limit[0][0], 2 * (size_t)s->link_links))
        return "structure.angle.link_link";
    return NULL;
}

static bool whole(const morph_record *r) {
    return r->link && r->link_kind && r->length_limit && r->rate_limit && r->acceleration_limit &&
           r->jerk_limit && r->link_radius && (r->posts == 0 || r->post_length) &&
           (r->link_posts == 0 || r->link_post_limit) && (r->link_links == 0 || r->link_link_limit);
}

static morph_status read_plan(const morph_structure *s, morph_start *start, char *message, size_t size) {
    morph_record r = {0};
    morph_status status = morph_folder_read(start->file, &r, message, size);
    if (status != MORPH_OK) return status == MORPH_ERR_IO ? MORPH_ERR_INPUT : status;
    const size_t width = 3 * (size_t)s->joints;
    const char *other = whole(&r) ? difference(&r, s) : "structure";
    if (other)
        status =
            morph_fail(MORPH_ERR_INPUT, message, size,
                       "%s: its %s is another, allowed: a plan of the same structure", start->file, other);
    else if (!r.schedule_joints || r.samples < 1)
        status = morph_fail(MORPH_ERR_INPUT, message, size,
                            "%s: holds no schedule, allowed: a plan with an end pose", start->file);
    else
        memcpy(start->pose, &r.schedule_joints[(size_t)(r.samples - 1) * width], width * sizeof(double));
    morph_record_free(&r);
    return status;
}

/* Posts of their length about their middles: what a least-squares shape leaves open goes to the links. */
static void stiffen(const morph_structure *s, double *x) {
    for (int p = 0; p < s->posts; p++) {
        double *b = &x[3 * s->post[p][0]], *t = &x[3 * s->post[p][1]];
        const double by = 0.5 * (s->post_length[p] / morph_dist(b, t) - 1.0);
        for (int c = 0; c < 3; c++) {
            const double d = by * (t[c] - b[c]);
            b[c] -= d;
            t[c] += d;
        }
    }
}

static double residual(const morph_structure *s, const double *x, const double *length, int *link) {
    double worst = 0.0;
    *link = 0;
    for (int l = 0; l < s->links; l++) {
        const double off = fabs(morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]) - length[l]);
        if (off > worst) {
            worst = off;
            *link = l;
        }
    }
    return worst;
}

/* How far other shapes of the same lengths lie: from the shape bent by half a spacing (up, down, into a
 * saddle each way, twisted each way), by least motion back to the lengths. What is left of the bend is what
 * lengths do not see. The largest of a few, so the true doubt is no smaller. */
static morph_status doubt(const morph_structure *s, morph_start *start) {
    const size_t n = 3 * (size_t)s->joints;
    double *x = morph_alloc(n, sizeof(double)), widest = 0.0;
    morph_status status = x ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int i = 0; i < 3 * s->joints; i++)
        if (i % 3 != 2) widest = fmax(widest, fabs(s->start[i]));
    for (int bend = 0; bend < 6 && status != MORPH_ERR_NOMEM; bend++) {
        morph_shape_report report;
        double off = 0.0;
        for (int j = 0; j < s->joints; j++) {
            const double u = s->start[3 * j] / widest, v = s->start[3 * j + 1] / widest;
            const double shape = bend / 2 == 0   ? 0.5 * (u * u + v * v)
                                 : bend / 2 == 1 ? u * u - v * v
                                                 : u * v;
            for (int c = 0; c < 3; c++)
                x[3 * j + c] = start->pose[3 * j + c];
            x[3 * j + 2] += (bend % 2 ? -0.5 : 0.5) * s->spacing * shape;
        }
        status = morph_shape_from_lengths(s, start->length, x, x, &report);
        if (status == MORPH_OK && report.fits) {
            status = morph_align(s->joints, x, start->pose, NULL, &off);
            start->doubt = isnan(start->doubt) ? off : fmax(start->doubt, off);
        }
    }
    free(x);
    return status == MORPH_ERR_NOMEM ? status : MORPH_OK; /* a bend that fails tells nothing */
}

/* Measured lengths are known to no better than this share of a spacing where links are redundant; beyond it
 * they are those of another structure. */
static const double most_residual = 1e-3;

static morph_status shape(const morph_structure *s, morph_start *start, char *message, size_t size) {
    morph_shape_report report;
    int worst = 0;
    bool holds;
    /* Near a pose that holds its angles, the least motion to the very lengths; without one from flat. */
    morph_status status = morph_start_shape(&s->def, start->length, start->pose, &holds);
    if (status == MORPH_OK)
        status =
            morph_shape_from_lengths(s, start->length, holds ? start->pose : s->start, start->pose, &report);
    if (status != MORPH_OK) return status;
    stiffen(s, start->pose);
    start->residual = residual(s, start->pose, start->length, &worst);
    if (!(start->residual <= most_residual * s->spacing) || !(report.panel <= 1e-6)) {
        char name[96];
        morph_link_name(s, worst, name, sizeof name);
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: no shape has these lengths: in the nearest %s is off by %.3g m, allowed: %.3g",
                          start->file, name, start->residual, most_residual * s->spacing);
    }
    return doubt(s, start);
}

/* Length and angle, and posts of a pose that came from a file; what the check allows. The first breach of
 * each is told; stuck links are where they are. */
static morph_status within(const morph_structure *s, const morph_start *start, char *message, size_t size) {
    const double a = s->spacing, *x = start->pose;
    char name[128];
    for (int p = 0; p < s->posts; p++) {
        const double h = morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]);
        if (fabs(h / s->post_length[p] - 1.0) <= 1e-6) continue;
        morph_post_name(s, p, name, sizeof name);
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: %s is %.9g m long, allowed: %.9g", start->file,
                          name, h, s->post_length[p]);
    }
    for (int l = 0; l < s->links; l++) {
        const double length = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
        const double *limit = s->length_limit[l];
        if (length >= limit[0] - 1e-9 * a && length <= limit[1] + 1e-9 * a) continue;
        morph_link_name(s, l, name, sizeof name);
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: %s starts at %.9g m, allowed: %.9g to %.9g",
                          start->file, name, length, limit[0], limit[1]);
    }
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        const double angle = morph_angle_at(s, t, x), *limit = morph_angle_limit(s, t), deg = 180.0 / M_PI;
        if (angle >= limit[0] - 1e-9 && angle <= limit[1] + 1e-9) continue;
        morph_angle_name(s, t, name, sizeof name);
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: the angle of %s starts at %.6g degrees, allowed: %.6g to %.6g", start->file,
                          name, angle * deg, limit[0] * deg, limit[1] * deg);
    }
    return MORPH_OK;
}

static morph_status read_any(const morph_structure *s, morph_start *start, char *message, size_t size) {
    struct stat info;
    if (stat(start->file, &info) != 0)
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "%s: cannot be read: %s, allowed: flat, a plan "
                          "folder, a CSV of lengths",
                          start->file, strerror(errno));
    start->kind = MORPH_START_PLAN;
    if (S_ISDIR(info.st_mode)) return read_plan(s, start, message, size);
    bool pose;
    morph_status status = morph_start_is_pose(start->file, &pose, message, size);
    if (status != MORPH_OK) return status;
    start->kind = pose ? MORPH_START_POSE : MORPH_START_LENGTHS;
    if (pose) return morph_start_read_pose(start->file, s->joints, start->pose, message, size);
    status = morph_start_read_lengths(start->file, s->links, &start->length, message, size);
    return status == MORPH_OK ? shape(s, start, message, size) : status;
}

morph_status morph_start_read(const morph_structure_def *def, morph_start *start, char *message,
                              size_t size) {
    morph_structure *s = NULL;
    morph_mobility mobility = {0};
    if (size > 0) message[0] = '\0';
    start->residual = 0.0;
    start->doubt = NAN;
    morph_status status = morph_structure_create(def, &s);
    if (status == MORPH_OK && !(start->pose = morph_alloc(3 * (size_t)s->joints, sizeof(double))))
        status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        start->joints = s->joints;
        start->links = s->links;
        status = read_any(s, start, message, size);
    }
    if (status == MORPH_OK) {
        morph_start_hold(start, s);
        status = within(s, start, message, size);
    }
    if (status == MORPH_OK) status = morph_mobility_at(s, start->pose, &mobility);
    start->free_motions = mobility.free;
    morph_structure_destroy(s);
    if (status != MORPH_OK) drop(start);
    return status;
}

void morph_start_hold(const morph_start *start, morph_structure *s) {
    for (int k = 0; k < s->def.stuck_links && start->pose; k++) {
        const int l = s->def.stuck_link[k];
        s->length_limit[l][0] = s->length_limit[l][1] =
            morph_dist(&start->pose[3 * s->link[l][0]], &start->pose[3 * s->link[l][1]]);
    }
}

morph_status morph_start_place(const morph_start *start, const double *flat, double *out) {
    const int n = start->joints;
    double lowest = INFINITY, wanted = INFINITY;
    memcpy(out, start->pose, 3 * (size_t)n * sizeof *out);
    const morph_status status = morph_align(n, out, flat, NULL, NULL);
    for (int j = 0; j < n; j++) {
        lowest = fmin(lowest, out[3 * j + 2]);
        wanted = fmin(wanted, flat[3 * j + 2]);
    }
    for (int j = 0; j < n; j++)
        out[3 * j + 2] += wanted - lowest;
    return status;
}
