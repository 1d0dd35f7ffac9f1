#include "model/element.h"

#include <math.h>
#include <string.h>

int morph_element_joints(const morph_element *e) {
    switch (e->kind) {
    case MORPH_ELEMENT_SPRING:
    case MORPH_ELEMENT_DISTANCE:
        return 2;
    case MORPH_ELEMENT_COSINE:
    case MORPH_ELEMENT_SQUARE:
    case MORPH_ELEMENT_SLACK:
    case MORPH_ELEMENT_PANEL:
    case MORPH_ELEMENT_APART:
        return 4;
    case MORPH_ELEMENT_CONTACT:
        return 3;
    case MORPH_ELEMENT_HEIGHT:
    case MORPH_ELEMENT_PULL:
        return 1;
    }
    return 0;
}

/* Of a function of differences u = sum_a su_a x_a: block b[3][3] of its second derivatives by u and v goes to
 * every pair of joints with the product of their signs. */
static void spread(double out[MORPH_ELEMENT_WIDTH][MORPH_ELEMENT_WIDTH], const double b[3][3],
                   const double *su, const double *sv, int joints) {
    for (int i = 0; i < joints; i++)
        for (int j = 0; j < joints; j++)
            for (int k = 0; k < 3; k++)
                for (int m = 0; m < 3; m++)
                    out[3 * i + k][3 * j + m] += su[i] * sv[j] * b[k][m];
}

static void difference(const double *x, int a, int b, double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = x[3 * b + k] - x[3 * a + k];
}

static const double first_sign[4] = {-1.0, 1.0, 0.0, 0.0}, second_sign[4] = {0.0, 0.0, -1.0, 1.0};

/* With n = d/L and stiffness k: gradient k (L - r) n, Hessian A I + B n n' with A = k (1 - r/L), B = k r/L.
 * Along y: dL = n.y, dn = (y - n dL)/L, dA = k r/L^2 dL = -dB. */
static void spring(const morph_element *e, const double *x, int order, const double *along, morph_jet *jet) {
    double d[3], n[3];
    difference(x, e->joint[0], e->joint[1], d);
    const double length = morph_norm(d), stretch = length - e->rest;
    jet->value = 0.5 * e->stiffness * stretch * stretch;
    if (order < 1 || !(length > 0.0)) return;
    for (int k = 0; k < 3; k++) {
        n[k] = d[k] / length;
        jet->g[3 + k] = e->stiffness * stretch * n[k];
        jet->g[k] = -jet->g[3 + k];
    }
    if (order < 2) return;
    const double across = e->stiffness * stretch / length, rest = e->stiffness - across;
    double h[3][3];
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++)
            h[k][m] = (k == m ? across : 0.0) + rest * n[k] * n[m];
    spread(jet->h, (const double(*)[3])h, first_sign, first_sign, 2);
    if (order < 3) return;
    double y[3], dn[3], dlength = 0.0;
    for (int k = 0; k < 3; k++) {
        y[k] = along[3 + k] - along[k];
        dlength += n[k] * y[k];
    }
    for (int k = 0; k < 3; k++)
        dn[k] = (y[k] - n[k] * dlength) / length;
    const double slope = rest / length * dlength;
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++)
            h[k][m] = (k == m ? slope : 0.0) - slope * n[k] * n[m] + rest * (dn[k] * n[m] + n[k] * dn[m]);
    spread(jet->t, (const double(*)[3])h, first_sign, first_sign, 2);
}

static void distance(const morph_element *e, const double *x, int order, morph_jet *jet) {
    static const double two[3][3] = {{2.0, 0.0, 0.0}, {0.0, 2.0, 0.0}, {0.0, 0.0, 2.0}};
    double d[3];
    difference(x, e->joint[0], e->joint[1], d);
    jet->value = morph_dot(d, d);
    for (int k = 0; k < 3 && order >= 1; k++) {
        jet->g[3 + k] = 2.0 * d[k];
        jet->g[k] = -2.0 * d[k];
    }
    if (order >= 2) spread(jet->h, two, first_sign, first_sign, 2);
}

static void apart(const morph_element *e, const double *x, int order, morph_jet *jet) {
    double d[3] = {0.0, 0.0, 0.0};
    for (int a = 0; a < 4; a++)
        for (int k = 0; k < 3; k++)
            d[k] += e->weight[a] * x[3 * e->joint[a] + k];
    jet->value = morph_dot(d, d);
    for (int a = 0; a < 4 && order >= 1; a++)
        for (int k = 0; k < 3; k++) {
            jet->g[3 * a + k] = 2.0 * e->weight[a] * d[k];
            for (int b = 0; b < 4 && order >= 2; b++)
                jet->h[3 * a + k][3 * b + k] = 2.0 * e->weight[a] * e->weight[b];
        }
}

/* Two directions: unit u, v, their lengths and cosine. */
typedef struct arms {
    double u[3], v[3], nu, nv, c;
} arms;

static bool arms_at(const morph_element *e, const double *x, arms *a) {
    difference(x, e->joint[0], e->joint[1], a->u);
    difference(x, e->joint[2], e->joint[3], a->v);
    a->nu = morph_norm(a->u);
    a->nv = morph_norm(a->v);
    a->c = 0.0;
    if (!(a->nu > 0.0) || !(a->nv > 0.0)) return false;
    for (int k = 0; k < 3; k++) {
        a->u[k] /= a->nu;
        a->v[k] /= a->nv;
    }
    a->c = morph_dot(a->u, a->v);
    return true;
}

/* Second derivatives of the cosine by (u, u), (v, v) and (u, v):
 *   -(V U' + U V' + c (I - 3 U U'))/|u|^2,   the same with u and v exchanged,
 *   (I - U U' - V V' + c U V')/(|u||v|). */
static void cosine_hessian(const arms *a, double uu[3][3], double vv[3][3], double uv[3][3]) {
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) {
            const double i = k == m ? 1.0 : 0.0, both = a->v[k] * a->u[m] + a->u[k] * a->v[m];
            uu[k][m] = -(both + a->c * (i - 3.0 * a->u[k] * a->u[m])) / (a->nu * a->nu);
            vv[k][m] = -(both + a->c * (i - 3.0 * a->v[k] * a->v[m])) / (a->nv * a->nv);
            uv[k][m] =
                (i - a->u[k] * a->u[m] - a->v[k] * a->v[m] + a->c * a->u[k] * a->v[m]) / (a->nu * a->nv);
        }
}

/* Change of those along (du, dv), by the product rule from d|u| = U.du, dU = (du - U d|u|)/|u| and
 * dc = dU.V + U.dV. */
static void cosine_third(const arms *a, const double du[3], const double dv[3], double uu[3][3],
                         double vv[3][3], double uv[3][3]) {
    double hu[3][3], hv[3][3], huv[3][3], eu[3], ev[3];
    cosine_hessian(a, hu, hv, huv);
    const double dnu = morph_dot(a->u, du) / a->nu, dnv = morph_dot(a->v, dv) / a->nv; /* relative */
    for (int k = 0; k < 3; k++) {
        eu[k] = du[k] / a->nu - a->u[k] * dnu;
        ev[k] = dv[k] / a->nv - a->v[k] * dnv;
    }
    const double dc = morph_dot(eu, a->v) + morph_dot(a->u, ev);
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) {
            const double i = k == m ? 1.0 : 0.0;
            const double both = ev[k] * a->u[m] + a->v[k] * eu[m] + eu[k] * a->v[m] + a->u[k] * ev[m];
            const double squ = eu[k] * a->u[m] + a->u[k] * eu[m], sqv = ev[k] * a->v[m] + a->v[k] * ev[m];
            uu[k][m] = -(both + dc * (i - 3.0 * a->u[k] * a->u[m]) - 3.0 * a->c * squ) / (a->nu * a->nu) -
                       2.0 * hu[k][m] * dnu;
            vv[k][m] = -(both + dc * (i - 3.0 * a->v[k] * a->v[m]) - 3.0 * a->c * sqv) / (a->nv * a->nv) -
                       2.0 * hv[k][m] * dnv;
            uv[k][m] = (-squ - sqv + dc * a->u[k] * a->v[m] + a->c * (eu[k] * a->v[m] + a->u[k] * ev[m])) /
                           (a->nu * a->nv) -
                       huv[k][m] * (dnu + dnv);
        }
}

static void spread_arms(double out[MORPH_ELEMENT_WIDTH][MORPH_ELEMENT_WIDTH], const double uu[3][3],
                        const double vv[3][3], const double uv[3][3]) {
    double vu[3][3];
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++)
            vu[k][m] = uv[m][k];
    spread(out, uu, first_sign, first_sign, 4);
    spread(out, vv, second_sign, second_sign, 4);
    spread(out, uv, first_sign, second_sign, 4);
    spread(out, (const double(*)[3])vu, second_sign, first_sign, 4);
}

/* The cosine itself. */
static void cosine(const morph_element *e, const double *x, int order, const double *along, morph_jet *jet) {
    arms a;
    if (!arms_at(e, x, &a)) return;
    jet->value = a.c;
    for (int k = 0; k < 3 && order >= 1; k++) {
        const double gu = (a.v[k] - a.c * a.u[k]) / a.nu, gv = (a.u[k] - a.c * a.v[k]) / a.nv;
        jet->g[k] = -gu;
        jet->g[3 + k] = gu;
        jet->g[6 + k] = -gv;
        jet->g[9 + k] = gv;
    }
    double uu[3][3], vv[3][3], uv[3][3];
    if (order >= 2) {
        cosine_hessian(&a, uu, vv, uv);
        spread_arms(jet->h, (const double(*)[3])uu, (const double(*)[3])vv, (const double(*)[3])uv);
    }
    if (order >= 3) {
        double du[3], dv[3];
        for (int k = 0; k < 3; k++) {
            du[k] = along[3 + k] - along[k];
            dv[k] = along[9 + k] - along[6 + k];
        }
        cosine_third(&a, du, dv, uu, vv, uv);
        spread_arms(jet->t, (const double(*)[3])uu, (const double(*)[3])vv, (const double(*)[3])uv);
    }
}

/* From the jet of c to that of p(c), given p and its three derivatives at c: with g, h, t of c, y along and
 * dg = h y, dc = g.y,
 *   p' g,   p' h + p'' g g',   p' t + p'' (dc h + dg g' + g dg') + p''' dc g g'. */
static void chain(const double p[4], int order, const double *along, morph_jet *jet) {
    const int n = MORPH_ELEMENT_WIDTH;
    double dg[MORPH_ELEMENT_WIDTH] = {0.0}, dc = 0.0;
    for (int i = 0; i < n && order >= 3; i++) {
        dc += jet->g[i] * along[i];
        for (int j = 0; j < n; j++)
            dg[i] += jet->h[i][j] * along[j];
    }
    for (int i = 0; i < n && order >= 2; i++)
        for (int j = 0; j < n; j++) {
            const double gg = jet->g[i] * jet->g[j];
            if (order >= 3)
                jet->t[i][j] = p[1] * jet->t[i][j] +
                               p[2] * (dc * jet->h[i][j] + dg[i] * jet->g[j] + jet->g[i] * dg[j]) +
                               p[3] * dc * gg;
            jet->h[i][j] = p[1] * jet->h[i][j] + p[2] * gg;
        }
    for (int i = 0; i < n && order >= 1; i++)
        jet->g[i] *= p[1];
    jet->value = p[0];
}

static void square(const morph_element *e, const double *x, int order, const double *along, morph_jet *jet) {
    cosine(e, x, order, along, jet);
    const double c = jet->value;
    chain((double[4]){0.5 * e->stiffness * c * c, e->stiffness * c, e->stiffness, 0.0}, order, along, jet);
}

/* Energy k/2 q^2 with q = angle - limit beyond it. With s = sin(angle): da/dc = -1/s, d2a/dc2 = -c/s^3,
 * d3a/dc3 = -(1 + 2c^2)/s^5. */
static void slack(const morph_element *e, const double *x, int order, const double *along, morph_jet *jet) {
    cosine(e, x, order, along, jet);
    const double c = fmax(-1.0, fmin(1.0, jet->value)), angle = acos(c);
    const double q = angle < e->lower ? angle - e->lower : angle > e->upper ? angle - e->upper : 0.0;
    double p[4] = {0.0, 0.0, 0.0, 0.0};
    /* Folded flat an angle has no slope. */
    const double s = fmax(sqrt(1.0 - c * c), 1e-3), k = e->stiffness;
    if (q != 0.0) {
        const double a1 = -1.0 / s, a2 = -c / (s * s * s), a3 = -(1.0 + 2.0 * c * c) / (s * s * s * s * s);
        p[0] = 0.5 * k * q * q;
        p[1] = k * q * a1;
        p[2] = k * (a1 * a1 + q * a2);
        p[3] = k * (3.0 * a1 * a2 + q * a3);
    }
    chain(p, order, along, jet);
}

/* det[p, q, d] is linear in each: with p = x1 - x0, q = x3 - x2, d = x2 - x0 its derivative by p is q x d,
 * by q d x p, by d p x q; by p and q the matrix of (. x d), and so on round. */
static void panel(const morph_element *e, const double *x, int order, const double *along, morph_jet *jet) {
    static const double sign[3][4] = {{-1, 1, 0, 0}, {0, 0, -1, 1}, {-1, 0, 1, 0}};
    double v[3][3], g[3][3];
    difference(x, e->joint[0], e->joint[1], v[0]);
    difference(x, e->joint[2], e->joint[3], v[1]);
    difference(x, e->joint[0], e->joint[2], v[2]);
    for (int a = 0; a < 3; a++)
        morph_cross(v[(a + 1) % 3], v[(a + 2) % 3], g[a]);
    jet->value = morph_dot(v[0], g[0]);
    for (int j = 0; j < 4 && order >= 1; j++)
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                jet->g[3 * j + k] += sign[a][j] * g[a][k];
    for (int third = 0; third < 2 && order >= 2 + third; third++) {
        double w[3][3];
        memcpy(w, v, sizeof w);
        for (int a = 0; a < 3 && third; a++)
            for (int k = 0; k < 3; k++) {
                w[a][k] = 0.0;
                for (int j = 0; j < 4; j++)
                    w[a][k] += sign[a][j] * along[3 * j + k];
            }
        for (int a = 0; a < 3; a++) {
            /* By v_a and v_(a+1): u.(w x z) = det[u, w, z] with z the third. */
            const double *z = w[(a + 2) % 3];
            const double m[3][3] = {{0.0, z[2], -z[1]}, {-z[2], 0.0, z[0]}, {z[1], -z[0], 0.0}};
            double back[3][3];
            for (int k = 0; k < 3; k++)
                for (int n = 0; n < 3; n++)
                    back[k][n] = m[n][k];
            const int b = (a + 1) % 3;
            spread(third ? jet->t : jet->h, m, sign[a], sign[b], 4);
            spread(third ? jet->t : jet->h, (const double(*)[3])back, sign[b], sign[a], 4);
        }
    }
}

static void contact(const morph_element *e, const morph_sdf *sdf, double spacing, const double *x, int order,
                    morph_jet *jet) {
    static const int packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    double at[3] = {0.0, 0.0, 0.0}, g[3], h[6];
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++)
            at[k] += spacing * e->weight[a] * x[3 * e->joint[a] + k];
    jet->value = morph_sdf_eval(sdf, at, order >= 1 ? g : NULL, order >= 2 ? h : NULL) / spacing + e->bias;
    for (int a = 0; a < 3 && order >= 1; a++)
        for (int k = 0; k < 3; k++) {
            jet->g[3 * a + k] = e->weight[a] * g[k];
            for (int b = 0; b < 3 && order >= 2; b++)
                for (int m = 0; m < 3; m++)
                    jet->h[3 * a + k][3 * b + m] = e->weight[a] * e->weight[b] * spacing * h[packed[k][m]];
        }
}

void morph_element_eval(const morph_element *e, const morph_sdf *sdf, double spacing, const double *x,
                        int order, const double *along, morph_jet *jet) {
    jet->value = 0.0;
    if (order >= 1) memset(jet->g, 0, sizeof jet->g);
    if (order >= 2) memset(jet->h, 0, sizeof jet->h);
    if (order >= 3) memset(jet->t, 0, sizeof jet->t);
    switch (e->kind) {
    case MORPH_ELEMENT_SPRING:
        spring(e, x, order, along, jet);
        break;
    case MORPH_ELEMENT_DISTANCE:
        distance(e, x, order, jet);
        break;
    case MORPH_ELEMENT_COSINE:
        cosine(e, x, order, along, jet);
        break;
    case MORPH_ELEMENT_SQUARE:
        square(e, x, order, along, jet);
        break;
    case MORPH_ELEMENT_SLACK:
        slack(e, x, order, along, jet);
        break;
    case MORPH_ELEMENT_PANEL:
        panel(e, x, order, along, jet);
        break;
    case MORPH_ELEMENT_CONTACT:
        contact(e, sdf, spacing, x, order, jet);
        break;
    case MORPH_ELEMENT_APART:
        apart(e, x, order, jet);
        break;
    case MORPH_ELEMENT_HEIGHT:
        jet->value = x[3 * e->joint[0] + 2];
        if (order >= 1) jet->g[2] = 1.0;
        break;
    case MORPH_ELEMENT_PULL:
        break;
    }
}

/* U = -1/p with p^2 = d.d + e^2: gradient d/p^3, Hessian I/p^3 - 3 d d'/p^5, along y
 * -3 (d.y I + y d' + d y')/p^5 + 15 d.y d d'/p^7. */
void morph_pull_eval(const double d[3], double softening, const double along[3], morph_pull_jet *jet) {
    const double square = morph_dot(d, d) + softening * softening, p = sqrt(square);
    const double p3 = 1.0 / (square * p), p5 = 3.0 * p3 / square, p7 = 5.0 * p5 / square;
    const double dy = along ? morph_dot(d, along) : 0.0;
    jet->value = -1.0 / p;
    for (int k = 0; k < 3; k++) {
        jet->g[k] = p3 * d[k];
        for (int m = 0; m < 3; m++) {
            const double i = k == m ? 1.0 : 0.0;
            jet->h[k][m] = i * p3 - p5 * d[k] * d[m];
            if (along)
                jet->t[k][m] = -p5 * (dy * i + along[k] * d[m] + d[k] * along[m]) + p7 * dy * d[k] * d[m];
        }
    }
}
