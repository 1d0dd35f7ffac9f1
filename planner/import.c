#include "planner/import.h"
#include "planner/import_private.h"
#include "planner/import_tetra.h"
#include "planner/target_body.h"

#include <float.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- warnings ---- */

#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
static void
warn(char *text, size_t size, const char *format, ...) {
    const size_t used = text && size > 0 ? strlen(text) : 0;
    if (!text || size < used + 3) return;
    size_t at = used;
    if (used > 0) {
        memcpy(text + used, "; ", 3);
        at += 2;
    }
    va_list args;
    va_start(args, format);
    vsnprintf(text + at, size - at, format, args);
    va_end(args);
}

/* ---- shapes ---- */

/* Chords within 2e-3 spacing of the true surface, a twentieth of a link's usual radius: the facets are the
 * target from here on, for the plan and for its check, and finer ones cost every distance. Never finer than
 * 1e-5 of the size, some 700 facets around. */
static double chord(const morph_target_def *def, double spacing, double scale) {
    double size = 0;
    switch (def->shape) {
    case MORPH_SHAPE_ELLIPSOID:
        size = fmax(def->radii[0], fmax(def->radii[1], def->radii[2]));
        break;
    case MORPH_SHAPE_TORUS:
        size = def->radius + def->tube;
        break;
    default:
        size = def->radius;
    }
    return fmax(2e-3 * spacing / scale, 1e-5 * size);
}

static morph_status shape_mesh(const morph_target_def *def, double error, morph_mesh *mesh) {
    const double ball[3] = {def->radius, def->radius, def->radius};
    switch (def->shape) {
    case MORPH_SHAPE_BOX:
        return morph_mesh_box(def->size, mesh);
    case MORPH_SHAPE_SPHERE:
        return morph_mesh_ellipsoid(ball, error, mesh);
    case MORPH_SHAPE_ELLIPSOID:
        return morph_mesh_ellipsoid(def->radii, error, mesh);
    case MORPH_SHAPE_CYLINDER:
        return morph_mesh_cylinder(def->radius, def->height, error, mesh);
    case MORPH_SHAPE_CONE:
        return morph_mesh_cone(def->radius, def->height, error, mesh);
    case MORPH_SHAPE_TORUS:
        return morph_mesh_torus(def->radius, def->tube, error, mesh);
    case MORPH_SHAPE_CAPSULE:
        return morph_mesh_capsule(def->radius, def->height, error, mesh);
    default:
        return MORPH_ERR_INTERNAL;
    }
}

static morph_status refuse_shape(const morph_target_def *def, const morph_sentence *to) {
    switch (def->shape) {
    case MORPH_SHAPE_TORUS:
        return morph_refuse(to, "a torus needs 0 < tube < radius (radius %g, tube %g)", def->radius,
                            def->tube);
    case MORPH_SHAPE_CAPSULE:
        return morph_refuse(to, "a capsule needs radius > 0 and height >= 2 radius (radius %g, height %g)",
                            def->radius, def->height);
    default:
        return morph_refuse(to, "the sizes of the shape must be positive, finite numbers");
    }
}

/* ---- files ---- */

static void bounds(const morph_mesh *mesh, double lo[3], double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (int i = 0; i < 3 * mesh->vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], mesh->v[i]);
        hi[i % 3] = fmax(hi[i % 3], mesh->v[i]);
    }
}

/* The sides go down to a twentieth of the range below the lowest height (flat ones: a cell), so that the
 * solid is closed everywhere and its placement still speaks of the relief. */
static morph_status heightmap(const morph_target_def *def, const morph_sentence *sentence, morph_mesh *mesh) {
    double *z, lo = INFINITY, hi = -INFINITY;
    int rows, columns;
    if (!(def->cell > 0) || !isfinite(def->cell))
        return morph_refuse(sentence, "the cell of a height map must be a positive, finite number");
    morph_status status = morph_import_heights(def->file, sentence, &z, &rows, &columns);
    if (status != MORPH_OK) return status;
    for (size_t i = 0; i < (size_t)rows * (size_t)columns; i++) {
        lo = fmin(lo, z[i]);
        hi = fmax(hi, z[i]);
    }
    const double floor = lo - (hi > lo ? 0.05 * (hi - lo) : def->cell);
    if (!isfinite(floor) || floor >= lo)
        status = morph_refuse(sentence, "'%s' has heights beyond what can be computed with", sentence->name);
    else
        status = morph_mesh_heightmap(z, rows, columns, def->cell, floor, mesh);
    free(z);
    return status;
}

/* Is the mended mesh a target?  Refuses what is not; otherwise says what was mended or is open. */
static morph_status judge(const morph_mesh_report *r, const morph_sentence *to, int crossing, char *warning,
                          size_t size) {
    const double diagonal = morph_dist(r->lo, r->hi);
    if (r->triangles == 0 || !(r->area > 0)) return morph_refuse(to, "'%s' has faces but no area", to->name);
    if (r->nonmanifold_edges > 0)
        return morph_refuse(to,
                            "'%s' has %d edge%s with more than two faces; a target's edges have one or two",
                            to->name, r->nonmanifold_edges, r->nonmanifold_edges == 1 ? "" : "s");
    if (r->orientation_conflicts > 0)
        return morph_refuse(to,
                            "'%s' cannot be oriented: %d edge%s stay%s inconsistent however its faces are "
                            "turned (as on a Moebius strip)",
                            to->name, r->orientation_conflicts, r->orientation_conflicts == 1 ? "" : "s",
                            r->orientation_conflicts == 1 ? "s" : "");
    /* Thinner than single precision coordinates can tell: 1e-7 of the size, all over. */
    if (r->closed && fabs(r->volume) <= 1e-7 * r->area * diagonal)
        return morph_refuse(to, "'%s' is closed but encloses no volume", to->name);
    if (!r->closed)
        warn(warning, size,
             "'%s' is open (%d boundary edges): inside and outside are taken from its winding number",
             to->name, r->boundary_edges);
    if (r->flipped == r->triangles)
        warn(warning, size, "'%s' was inside out and has been turned", to->name);
    else if (r->flipped > 0)
        warn(warning, size, "'%s': %d of %d triangles were turned", to->name, r->flipped, r->triangles);
    if (r->degenerate > 0)
        warn(warning, size, "'%s': %d triangles without area were removed", to->name, r->degenerate);
    if (crossing > 0) warn(warning, size, "'%s': %d polygons cross themselves", to->name, crossing);
    if (r->self_intersections > 0)
        warn(warning, size, "'%s': %d pairs of triangles cross each other", to->name, r->self_intersections);
    return MORPH_OK;
}

/* The surface of a file of tetrahedra; their inside is read again where the body is made. */
static morph_status tetra_surface(const morph_target_def *def, const morph_sentence *sentence,
                                  morph_mesh *mesh, morph_mesh_report *report, char *warning, size_t size) {
    morph_tetra tetra;
    morph_tetra_report found;
    morph_status status =
        morph_import_tetra(def->file, sentence->name, &tetra, &found, sentence->text, sentence->size);
    if (status != MORPH_OK) return status;
    if (found.flipped > 0)
        warn(warning, size, "'%s': %d of %d tetrahedra were turned", sentence->name, found.flipped,
             tetra.tets);
    status = morph_tetra_surface(&tetra, tetra.v, mesh);
    morph_tetra_free(&tetra);
    if (status == MORPH_OK) status = morph_mesh_examine(mesh, report);
    return status == MORPH_OK ? judge(report, sentence, 0, warning, size) : status;
}

static morph_status file_mesh(const morph_target_def *def, const morph_sentence *sentence, morph_mesh *mesh,
                              morph_mesh_report *report, char *warning, size_t size) {
    int crossing = 0;
    if (def->has_deformable && morph_is_tetra_file(def->file))
        return tetra_surface(def, sentence, mesh, report, warning, size);
    morph_status status = morph_import_mesh(def->file, sentence, mesh, &crossing);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < 3 * mesh->vertices; i++)
        if (!isfinite(mesh->v[i]))
            return morph_refuse(sentence, "'%s' has a vertex that is no finite number", sentence->name);
    /* Equal corners of a file differ by single precision's rounding of their coordinates (6e-8 of their
     * distance from the origin) or by the six digits that text files carry (1e-6 of the size). */
    double far = 0, lo[3], hi[3];
    bounds(mesh, lo, hi);
    for (int k = 0; k < 3; k++)
        far = fmax(far, fmax(fabs(lo[k]), fabs(hi[k])));
    const double diagonal = morph_dist(lo, hi);
    if (4 * (double)FLT_EPSILON * far > 1e-4 * diagonal && diagonal > 0)
        warn(warning, size,
             "'%s' lies so far from its origin that its coordinates are rounded by %.1g of its size",
             sentence->name, (double)FLT_EPSILON * far / diagonal);
    status = morph_mesh_mend(mesh, fmax(1e-6 * diagonal, 4 * (double)FLT_EPSILON * far), report);
    return status == MORPH_OK ? judge(report, sentence, crossing, warning, size) : status;
}

/* ---- transform ---- */

/* Sine and cosine, exact at quarter turns: a box turned by 90 degrees stays a box. */
static void turn(double angle, double *c, double *s) {
    const double quarters = angle / (0.5 * M_PI), nearest = round(quarters);
    if (fabs(quarters - nearest) > 1e-12) {
        *c = cos(angle);
        *s = sin(angle);
        return;
    }
    const int q = ((int)fmod(nearest, 4) + 4) % 4;
    *c = q == 0 ? 1 : q == 2 ? -1 : 0;
    *s = q == 1 ? 1 : q == 3 ? -1 : 0;
}

/* About the fixed x, then y, then z axis through the centre of the box; leaves that centre in the origin. */
static void rotate(morph_mesh *mesh, const double angles[3]) {
    double lo[3], hi[3];
    bounds(mesh, lo, hi);
    for (int i = 0; i < mesh->vertices; i++) {
        double *p = mesh->v + 3 * i;
        for (int k = 0; k < 3; k++)
            p[k] -= 0.5 * (lo[k] + hi[k]);
        for (int k = 0; k < 3; k++) {
            double c, s;
            turn(angles[k], &c, &s);
            double *a = p + (k + 1) % 3, *b = p + (k + 2) % 3;
            const double ca = c * *a - s * *b;
            *b = s * *a + c * *b;
            *a = ca;
        }
    }
}

/* The largest uniform scale that fits the box; directions without extent do not limit it. */
static double scale_of(const morph_target_def *def, const morph_mesh *mesh) {
    if (!def->has_fit) return def->scale;
    double lo[3], hi[3], scale = INFINITY;
    bounds(mesh, lo, hi);
    for (int k = 0; k < 3; k++)
        if (hi[k] > lo[k]) scale = fmin(scale, def->fit[k] / (hi[k] - lo[k]));
    return scale;
}

/* Scales the turned mesh and puts its box's centre where it belongs; the report follows. */
static morph_status place(const morph_target_def *def, double scale, morph_mesh *mesh,
                          morph_mesh_report *report, const morph_sentence *to) {
    double lo[3], hi[3];
    bounds(mesh, lo, hi);
    for (int i = 0; i < 3 * mesh->vertices; i++) {
        double *x = mesh->v + i;
        *x = (*x - 0.5 * (lo[i % 3] + hi[i % 3])) * scale + def->at[i % 3];
        if (!isfinite(*x)) return morph_refuse(to, "the scaled target is too large to compute with");
    }
    report->volume *= scale * scale * scale;
    report->area *= scale * scale;
    bounds(mesh, report->lo, report->hi);
    return MORPH_OK;
}

static morph_status check_def(const morph_target_def *def, double spacing, const morph_sentence *to) {
    if (!(spacing > 0) || !isfinite(spacing))
        return morph_refuse(to, "the spacing must be a positive number");
    for (int k = 0; k < 3; k++) {
        if (!isfinite(def->rotate[k]) || !isfinite(def->at[k]))
            return morph_refuse(to, "rotate and at must be finite numbers");
        if (def->has_fit && (!(def->fit[k] > 0) || !isfinite(def->fit[k])))
            return morph_refuse(to, "fit must be three positive, finite lengths");
    }
    if (!def->has_fit && (!(def->scale > 0) || !isfinite(def->scale)))
        return morph_refuse(to, "scale must be a positive, finite number");
    if ((def->shape == MORPH_SHAPE_MESH || def->shape == MORPH_SHAPE_HEIGHTMAP) && !def->file)
        return morph_refuse(to, "a mesh or a height map needs a file");
    return MORPH_OK;
}

/* In the shape's own units. A fitted shape is tessellated twice: how fine depends on the scale, which
 * depends on the turned shape's box. */
static morph_status own_units(const morph_target_def *def, double spacing, const morph_sentence *sentence,
                              morph_mesh *mesh, morph_mesh_report *report, char *warning, size_t size) {
    if (def->shape == MORPH_SHAPE_MESH) return file_mesh(def, sentence, mesh, report, warning, size);
    morph_status status;
    if (def->shape == MORPH_SHAPE_HEIGHTMAP)
        status = heightmap(def, sentence, mesh);
    else {
        double scale = def->scale;
        if (def->has_fit) {
            status = shape_mesh(def, 1e3 * chord(def, 0, 1), mesh);
            if (status != MORPH_OK) return status == MORPH_ERR_INPUT ? refuse_shape(def, sentence) : status;
            rotate(mesh, def->rotate);
            scale = scale_of(def, mesh);
            morph_mesh_free(mesh);
        }
        status = shape_mesh(def, chord(def, spacing, scale), mesh);
        if (status == MORPH_ERR_INPUT) return refuse_shape(def, sentence);
    }
    return status == MORPH_OK ? morph_mesh_examine(mesh, report) : status;
}

morph_status morph_target_build(const morph_target_def *def, double spacing, morph_mesh *mesh,
                                morph_mesh_report *report, char *message, size_t message_size, char *warning,
                                size_t warning_size) {
    *mesh = (morph_mesh){0};
    *report = (morph_mesh_report){0};
    if (message && message_size > 0) message[0] = '\0';
    if (warning && warning_size > 0) warning[0] = '\0';
    const morph_sentence sentence = {message, message_size,
                                     def->file_as_written ? def->file_as_written : def->file};
    morph_status status = check_def(def, spacing, &sentence);
    if (status == MORPH_OK) status = own_units(def, spacing, &sentence, mesh, report, warning, warning_size);
    if (status == MORPH_OK) {
        rotate(mesh, def->rotate);
        status = place(def, scale_of(def, mesh), mesh, report, &sentence);
    }
    if (status != MORPH_OK) {
        morph_mesh_free(mesh);
        *report = (morph_mesh_report){0};
        if (warning && warning_size > 0) warning[0] = '\0';
    }
    return status;
}

morph_status morph_target_tetra(const morph_target_def *def, morph_tetra *out, char *message,
                                size_t message_size) {
    const morph_sentence sentence = {message, message_size,
                                     def->file_as_written ? def->file_as_written : def->file};
    morph_tetra_report found;
    morph_mesh_report unused = {0};
    morph_status status = morph_import_tetra(def->file, sentence.name, out, &found, message, message_size);
    if (status != MORPH_OK) return status;
    /* Only vertices are moved; all lie within the surface's box. */
    morph_mesh vertices = {.vertices = out->vertices, .v = out->v};
    rotate(&vertices, def->rotate);
    status = place(def, scale_of(def, &vertices), &vertices, &unused, &sentence);
    if (status != MORPH_OK) morph_tetra_free(out);
    return status;
}
