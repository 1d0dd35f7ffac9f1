/* A made-up record for the tests of what goes to disk: a sheet of nx x ny nodes that sinks from flat onto a
 * ball. Every array is there, nothing in it is planned. */
#ifndef MORPH_FOLDER_FIXTURE_H
#define MORPH_FOLDER_FIXTURE_H

#include "model/structure.h"
#include "planner/record.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the libraries keep or lose: fontconfig its patterns, HDF5 a little of every damaged file. */
__attribute__((visibility("default"))) const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\nleak:libhdf5\n";
}

static void *fixture_array(size_t n, size_t size) {
    void *array = calloc(n > 0 ? n : 1, size);
    assert(array);
    return array;
}

/* Ball of radius 0.3 of the sheet's width, resting on z = 0. */
static void fixture_ball(morph_record *r, double radius, int rings) {
    int around = 2 * rings;
    r->target_vertices = (rings - 1) * around + 2;
    r->target_triangles = 2 * around * (rings - 1);
    r->target_v = fixture_array((size_t)r->target_vertices, 3 * sizeof(double));
    r->target_t = fixture_array((size_t)r->target_triangles, 3 * sizeof(int));
    double *v = r->target_v;
    for (int i = 1; i < rings; i++)
        for (int k = 0; k < around; k++, v += 3) {
            double a = M_PI * i / rings, b = 2 * M_PI * k / around;
            v[0] = radius * sin(a) * cos(b);
            v[1] = radius * sin(a) * sin(b);
            v[2] = radius + radius * cos(a);
        }
    v[2] = 2 * radius;
    int top = r->target_vertices - 2, bottom = top + 1, n = 0;
    for (int i = 0; i < rings; i++)
        for (int k = 0; k < around; k++) {
            int l = (k + 1) % around, up = (i - 1) * around, down = i * around;
            int quad[4] = {up + k, down + k, down + l, up + l};
            if (i > 0 && i < rings - 1) {
                int both[6] = {quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]};
                memcpy(r->target_t + n, both, sizeof both);
                n += 6;
            } else {
                int cap[3] = {i == 0 ? top : quad[0], i == 0 ? quad[1] : bottom, i == 0 ? quad[2] : quad[3]};
                memcpy(r->target_t + n, cap, sizeof cap);
                n += 3;
            }
        }
}

static int fixture_link(morph_record *r, int a, int b, int kind) {
    r->link[r->links][0] = a;
    r->link[r->links][1] = b;
    r->link_kind[r->links] = kind;
    return r->links++;
}

static void fixture_structure(morph_record *r, int nx, int ny) {
    int nodes = nx * ny, layer_links = 2 * nodes - nx - ny;
    r->joints = 2 * nodes;
    r->posts = nodes;
    r->joint_layer = fixture_array((size_t)r->joints, sizeof(int));
    r->joint_node = fixture_array((size_t)r->joints, 2 * sizeof(int));
    r->link = fixture_array(2 * (size_t)layer_links, 2 * sizeof(int));
    r->link_kind = fixture_array(2 * (size_t)layer_links, sizeof(int));
    r->post = fixture_array((size_t)nodes, 2 * sizeof(int));
    r->post_length = fixture_array((size_t)nodes, sizeof(double));
    for (int j = 0; j < r->joints; j++) {
        r->joint_layer[j] = j / nodes;
        r->joint_node[j][0] = j % nodes % nx;
        r->joint_node[j][1] = j % nodes / nx;
    }
    for (int layer = 0; layer < 2; layer++)
        for (int k = 0; k < nodes; k++) {
            int j = layer * nodes + k;
            if (k % nx < nx - 1) fixture_link(r, j, j + 1, layer);
            if (k / nx < ny - 1) fixture_link(r, j, j + nx, layer);
        }
    for (int k = 0; k < nodes; k++) {
        r->post[k][0] = k;
        r->post[k][1] = nodes + k;
        r->post_length[k] = 0.5 * r->spacing;
    }
    r->skin_triangles = 2 * (nx - 1) * (ny - 1);
    r->skin = fixture_array((size_t)r->skin_triangles, 3 * sizeof(int));
    for (int j = 0, n = 0; j < ny - 1; j++)
        for (int i = 0; i < nx - 1; i++) {
            int a = j * nx + i;
            const int both[2][3] = {{a, a + 1, a + nx + 1}, {a, a + nx + 1, a + nx}};
            memcpy(r->skin[n], both, sizeof both);
            n += 2;
        }
}

static void fixture_limits(morph_record *r) {
    size_t m = (size_t)r->links;
    r->length_limit = fixture_array(m, 2 * sizeof(double));
    r->rate_limit = fixture_array(m, sizeof(double));
    r->acceleration_limit = fixture_array(m, sizeof(double));
    r->jerk_limit = fixture_array(m, sizeof(double));
    r->link_radius = fixture_array(m, sizeof(double));
    for (size_t k = 0; k < m; k++) {
        r->length_limit[k][0] = 0.75 * r->spacing;
        r->length_limit[k][1] = 1.35 * r->spacing;
        r->rate_limit[k] = 0.05;
        r->acceleration_limit[k] = 0.2;
        r->jerk_limit[k] = 2;
        r->link_radius[k] = 0.04 * r->spacing;
    }
    r->link_posts = 2;
    r->link_post = fixture_array(2, 2 * sizeof(int));
    r->link_post_limit = fixture_array(2, 2 * sizeof(double));
    r->link_links = 1;
    r->link_link = fixture_array(1, 2 * sizeof(int));
    r->link_link_limit = fixture_array(1, 2 * sizeof(double));
    r->link_link[0][1] = 1;
    for (int k = 0; k < 2; k++) {
        r->link_post[k][1] = k;
        r->link_post_limit[k][0] = 0.96;
        r->link_post_limit[k][1] = 2.18;
    }
    r->link_link_limit[0][0] = 0.87;
    r->link_link_limit[0][1] = 2.27;
}

/* Sheet at share f of its way: it hangs from flat to the ball's upper half and an apron around it. */
static void fixture_pose(const morph_record *r, int nx, int ny, double radius, double f, double sag,
                         double *x) {
    int nodes = nx * ny;
    double h = r->spacing, skin = radius + 0.06 * h + sag;
    for (int k = 0; k < nodes; k++) {
        double u = (k % nx - 0.5 * (nx - 1)) * h, v = (k / nx - 0.5 * (ny - 1)) * h, d = hypot(u, v);
        double turn = fmin(d / skin, 1.25), reach = d > 0 ? skin * sin(turn) / d : 1;
        double apron = fmax(d - 1.25 * skin, 0), z = radius + skin * cos(turn) - 0.55 * apron;
        if (apron > 0) reach = (skin * sin(1.25) + 0.8 * apron) / d;
        double end[3] = {u * reach, v * reach, fmax(z, 0.05 * h)}, flat[3] = {u, v, 2 * radius + h};
        double lean = d > 0 ? f * fmin(turn, 1.1) : 0;
        double p[3] = {d > 0 ? sin(lean) * u / d : 0, d > 0 ? sin(lean) * v / d : 0, cos(lean)};
        for (int c = 0; c < 3; c++) {
            x[3 * k + c] = flat[c] + f * (end[c] - flat[c]);
            x[3 * (k + nodes) + c] = x[3 * k + c] + 0.5 * h * p[c];
        }
    }
}

static void fixture_lengths(const morph_record *r, const double *x, double *length) {
    for (int k = 0; k < r->links; k++)
        length[k] = morph_dist(x + 3 * (size_t)r->link[k][0], x + 3 * (size_t)r->link[k][1]);
}

static void fixture_motion(morph_record *r, int nx, int ny, double radius) {
    size_t j = (size_t)r->joints, m = (size_t)r->links, s = (size_t)r->samples, n = (size_t)r->nominal_frames;
    r->time = fixture_array(s, sizeof(double));
    r->schedule_joints = fixture_array(s * j, 3 * sizeof(double));
    r->length = fixture_array(s * m, sizeof(double));
    r->rate = fixture_array(s * m, sizeof(double));
    r->acceleration = fixture_array(s * m, sizeof(double));
    r->offset_schedule = fixture_array(s, 3 * sizeof(double));
    for (size_t i = 0; i < s; i++) {
        double q = s > 1 ? (double)i / (double)(s - 1) : 0, f = q * q * q * (10 - 15 * q + 6 * q * q);
        r->time[i] = 0.01 * (double)i;
        fixture_pose(r, nx, ny, radius, f, 0, r->schedule_joints + 3 * i * j);
        fixture_lengths(r, r->schedule_joints + 3 * i * j, r->length + i * m);
    }
    for (size_t i = 1; i + 1 < s; i++)
        for (size_t k = 0; k < m; k++) {
            const double *l = r->length + i * m + k;
            r->rate[i * m + k] = (l[m] - l[-(ptrdiff_t)m]) / 0.02;
            r->acceleration[i * m + k] = (l[m] - 2 * l[0] + l[-(ptrdiff_t)m]) / 1e-4;
        }
    r->nominal_time = fixture_array(n, sizeof(double));
    r->nominal_joints = fixture_array(n * j, 3 * sizeof(double));
    r->nominal_lengths = fixture_array(n * m, sizeof(double));
    r->offset_nominal = fixture_array(n, 3 * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        r->nominal_time[i] = 0.05 * (double)i;
        double f = n > 1 ? (double)i / (double)(n - 1) : 0;
        fixture_pose(r, nx, ny, radius, f, 0.3 * r->spacing, r->nominal_joints + 3 * i * j);
        fixture_lengths(r, r->nominal_joints + 3 * i * j, r->nominal_lengths + i * m);
    }
}

/* morph_record_free when done. */
static morph_record fixture_record(int nx, int ny, int samples) {
    morph_record r = {.base = 0, .spacing = 0.1, .samples = samples, .nominal_frames = 5, .poses = 2};
    double radius = 0.3 * r.spacing * (nx - 1);
    snprintf(r.program, sizeof r.program, "morphplan 0.1.0");
    snprintf(r.scene_sha256, sizeof r.scene_sha256, "%064d", 7);
    snprintf(r.outcome, sizeof r.outcome, "optimal");
    fixture_structure(&r, nx, ny);
    fixture_limits(&r);
    fixture_ball(&r, radius, 24);
    fixture_motion(&r, nx, ny, radius);
    r.fixed = fixture_array(0, sizeof(int));
    r.panel = fixture_array(0, 2 * sizeof(int));
    r.path_s = fixture_array(2, sizeof(double));
    r.path_s[1] = 1;
    r.pose_width = 6 * r.posts;
    r.path_poses = fixture_array(2 * (size_t)r.posts, 6 * sizeof(double));
    for (size_t i = 0; i < 12 * (size_t)r.posts; i++)
        r.path_poses[i] = sin((double)i);
    r.mobility_samples = 1;
    r.mobility_sample = fixture_array(1, sizeof(int));
    r.mobility_rank = fixture_array(1, sizeof(int));
    r.mobility_free = fixture_array(1, sizeof(int));
    r.mobility_redundant = fixture_array(1, sizeof(int));
    r.mobility_sigma_min = fixture_array(1, sizeof(double));
    r.mobility_free[0] = 26;
    return r;
}

#endif
