#include "model/kinematics.h"
#include "model/kinematics_rows.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

int morph_row_count(const morph_structure *s) {
    return s->links + s->posts + s->panels;
}

/* g = d.d / 2 with d = x_b - x_a: gradient d at b, -d at a; |d| the length. */
static double member_row(const double *x, const int ends[2], morph_row *row) {
    double d[3];
    morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
    const double length = morph_norm(d);
    row->joints = 2;
    for (int e = 0; e < 2; e++) {
        row->joint[e] = ends[e];
        for (int k = 0; k < 3; k++)
            row->gradient[e][k] = (e ? d[k] : -d[k]) / length;
    }
    return length;
}

/* g = det[p, q, d] = p . (q x d) with the posts p = x_1 - x_0, q = x_3 - x_2 and d = x_2 - x_0 from foot to
 * foot: dg/dp = q x d, dg/dq = d x p, dg/dd = p x q. */
static double panel_row(const morph_structure *s, const double *x, int panel, morph_row *row) {
    const int *a = s->post[s->panel[panel][0]], *b = s->post[s->panel[panel][1]];
    double p[3], q[3], d[3], by_p[3], by_q[3], by_d[3];
    row->joints = 4;
    for (int e = 0; e < 2; e++) {
        row->joint[e] = a[e];
        row->joint[2 + e] = b[e];
    }
    morph_sub(&x[3 * a[1]], &x[3 * a[0]], p);
    morph_sub(&x[3 * b[1]], &x[3 * b[0]], q);
    morph_sub(&x[3 * b[0]], &x[3 * a[0]], d);
    morph_cross(q, d, by_p);
    morph_cross(d, p, by_q);
    morph_cross(p, q, by_d);
    for (int k = 0; k < 3; k++) {
        row->gradient[0][k] = -by_p[k] - by_d[k];
        row->gradient[1][k] = by_p[k];
        row->gradient[2][k] = by_d[k] - by_q[k];
        row->gradient[3][k] = by_q[k];
    }
    return morph_dot(p, by_p);
}

double morph_row_at(const morph_structure *s, const double *x, int index, morph_row *row) {
    if (index < s->links) return member_row(x, s->link[index], row);
    if (index < s->links + s->posts) return member_row(x, s->post[index - s->links], row);
    return panel_row(s, x, index - s->links - s->posts, row);
}

int morph_free_columns(const morph_structure *s, int *column) {
    int n = 0;
    for (int j = 0; j < s->joints; j++) {
        const bool held = s->joint_fixed && s->joint_fixed[j];
        column[j] = held ? -1 : n;
        if (!held) n += 3;
    }
    return n;
}

/* Rigid motions that leave the fixed joints where they are: turns about a point, about a line, none. */
static int rigid_motions(const morph_structure *s, const double *x) {
    if (s->fixed_joints == 0) return 6;
    const double *first = &x[3 * s->fixed_joint[0]];
    double far[3] = {0.0, 0.0, 0.0};
    for (int k = 1; k < s->fixed_joints; k++) {
        double d[3];
        morph_sub(&x[3 * s->fixed_joint[k]], first, d);
        if (morph_norm(d) > morph_norm(far)) memcpy(far, d, sizeof far);
    }
    const double size = morph_norm(far);
    if (!(size > 0.0)) return 3;
    for (int k = 1; k < s->fixed_joints; k++) {
        double d[3], c[3];
        morph_sub(&x[3 * s->fixed_joint[k]], first, d);
        morph_cross(far, d, c);
        /* The sine of joints off the line, seen from the first: that of rows, beneath which they hold nothing
         * at first order. */
        if (morph_norm(c) > 1e-9 * size * size) return 0;
    }
    return 1;
}

static void fill(const morph_structure *s, const double *x, const int *column, int columns, double *matrix) {
    for (int r = 0; r < morph_row_count(s); r++) {
        morph_row row;
        morph_row_at(s, x, r, &row);
        double norm = 0.0;
        for (int e = 0; e < row.joints; e++)
            norm += morph_dot(row.gradient[e], row.gradient[e]);
        norm = sqrt(norm);
        for (int e = 0; e < row.joints; e++) {
            if (column[row.joint[e]] < 0) continue;
            double *at = &matrix[(size_t)r * (size_t)columns + (size_t)column[row.joint[e]]];
            for (int k = 0; k < 3; k++)
                at[k] += row.gradient[e][k] / norm;
        }
    }
}

static bool all_finite(const double *x, int n) {
    for (int k = 0; k < n; k++)
        if (!isfinite(x[k])) return false;
    return true;
}

/* From the singular values, descending. */
static void conclude(int rows, int columns, int rigid, const double *sigma, morph_mobility *out) {
    /* Unit rows give singular values up to about the root of the valence (6 to 14); rounding of the SVD is
     * about rows * 2e-16. 1e-9 stands far from both: a value beneath is a motion at first order. */
    const double zero = 1e-9;
    const int least = rows < columns ? rows : columns;
    int rank = 0;
    while (rank < least && sigma[rank] > zero)
        rank++;
    out->rows = rows;
    out->rank = rank;
    out->redundant = rows - rank;
    out->rigid = rigid;
    /* Rigid motions lie in the kernel of every row, so they need no projection: as many of the columns. */
    out->free = columns - rigid - rank;
    out->sigma_min = out->free > 0 || columns == rigid ? 0.0 : sigma[columns - rigid - 1];
}

morph_status morph_mobility_at(const morph_structure *s, const double *x, morph_mobility *out) {
    if (!all_finite(x, 3 * s->joints)) return MORPH_ERR_NONFINITE;
    int *column = morph_alloc((size_t)s->joints, sizeof(int));
    if (!column) return MORPH_ERR_NOMEM;
    const int columns = morph_free_columns(s, column), rows = morph_row_count(s);
    const int least = rows < columns ? rows : columns;
    double *matrix = morph_alloc((size_t)rows, (size_t)columns * sizeof(double));
    double *sigma = morph_alloc((size_t)least, sizeof(double));
    morph_status status = matrix && sigma ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK && least > 0) {
        fill(s, x, column, columns, matrix);
        status = morph_singular_values(matrix, rows, columns, sigma);
    }
    if (status == MORPH_OK) conclude(rows, columns, columns > 0 ? rigid_motions(s, x) : 0, sigma, out);
    free(column);
    free(matrix);
    free(sigma);
    return status;
}
