/* Settle without the dynamics: derivatives, hanging chains, limits, extremes, refusals. */
#include "settle_scene.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

/* A pose near contact with every term alive: multipliers of all limits, friction that sticks and slides. */
static morph_settle *busy(scene *s, double *x) {
    static const morph_attractor centre[2] = {{{0.01, 0.02, 0.03}, 0.02}, {{-0.1, 0.0, 0.2}, -0.004}};
    morph_settle_def def = morph_settle_defaults();
    def.friction = 0.4;
    def.base = 0.02;
    def.attractor = centre;
    def.attractors = 2;
    def.fixed = (const int[]){3};
    def.fixed_joints = 1;
    morph_settle *t = scene_settle(s, &def);
    for (int i = 0; i < s->n; i++)
        x[i] = (s->start[i] - (i % 3 == 2 ? 0.115 : 0.0)) / 0.1 + 0.06 * sin(7.0 * i + 0.3);
    morph_settle_seek(t, x, 1e-3);
    for (int n = 0; n < t->places; n++) {
        t->place[n].push = n % 3 == 0 ? 0.2 + 0.1 * (n % 5) : 0.0;
        for (int k = 0; k < 3; k++)
            t->place[n].slip[k] = 1e-5 * (n % 7) * (k + 1);
    }
    for (int l = 0; l < s->structure->links; l++)
        t->link_push[l][l % 2] = 0.3;
    for (int p = 0; p < s->structure->posts; p++)
        t->post_push[p] = 0.5 * sin(p);
    for (int a = 0; a < t->angles; a += 2)
        t->angle[a].push[a / 2 % 2] = 0.1;
    t->drag = 2.0;
    for (int i = 0; i < s->n; i++)
        t->before[i] = x[i] + 0.02 * cos(5.0 * i);
    morph_settle_begin(t, t->before);
    return t;
}

/* Largest error of the gradient against central differences of the energy, relative to the largest entry;
 * entry `planted` is turned round first. */
static double gradient_error(morph_settle *t, double *x, int n, int planted) {
    double *g = malloc((size_t)n * sizeof *g), worst = 0.0, most = 0.0;
    assert_non_null(g);
    morph_settle_evaluate(t, x, MORPH_SETTLE_GRADIENT);
    memcpy(g, t->g, (size_t)n * sizeof *g);
    if (planted >= 0) g[planted] = -g[planted];
    const double h = 1e-6;
    for (int i = 0; i < n; i++) {
        if (t->fixed[i / 3]) continue;
        const double keep = x[i];
        x[i] = keep + h;
        const double up = morph_settle_evaluate(t, x, MORPH_SETTLE_VALUE);
        x[i] = keep - h;
        const double down = morph_settle_evaluate(t, x, MORPH_SETTLE_VALUE);
        x[i] = keep;
        worst = fmax(worst, fabs((up - down) / (2.0 * h) - g[i]));
        most = fmax(most, fabs(g[i]));
    }
    free(g);
    return worst / most;
}

/* The same for columns of the Hessian against differences of the gradient. */
static double hessian_error(morph_settle *t, double *x, int n, int planted) {
    const size_t bytes = (size_t)n * sizeof(double), nonzeros = (size_t)t->start[n];
    double *up = malloc(bytes), *unit = calloc((size_t)n, sizeof(double)), *column = malloc(bytes);
    double *value = malloc(nonzeros * sizeof(double)), worst = 0.0, most = 0.0;
    assert_true(up && unit && column && value);
    morph_settle_evaluate(t, x, MORPH_SETTLE_EXACT);
    memcpy(value, t->value, nonzeros * sizeof(double));
    if (planted >= 0) value[planted] = -value[planted];
    const double h = 1e-6;
    for (int i = 0; i < n; i++) {
        if (t->fixed[i / 3]) continue;
        unit[i] = 1.0;
        morph_sparse_times(t->sparse, value, unit, column);
        unit[i] = 0.0;
        const double keep = x[i];
        x[i] = keep + h;
        morph_settle_evaluate(t, x, MORPH_SETTLE_GRADIENT);
        memcpy(up, t->g, bytes);
        x[i] = keep - h;
        morph_settle_evaluate(t, x, MORPH_SETTLE_GRADIENT);
        x[i] = keep;
        for (int k = 0; k < n; k++) {
            worst = fmax(worst, fabs((up[k] - t->g[k]) / (2.0 * h) - column[k]));
            most = fmax(most, fabs(column[k]));
        }
    }
    free(up);
    free(unit);
    free(column);
    free(value);
    return worst / most;
}

static void derivatives(void **state) {
    (void)state;
    const morph_structure_def def = scene_structure(3, 20.0);
    scene s;
    scene_make(&s, &def, true);
    morph_settle *t = busy(&s, s.x);
    for (int form = 0; form < 2; form++) {
        t->form = form ? MORPH_SETTLE_PLAIN : MORPH_SETTLE_AUGMENTED;
        for (int n = 0; form && n < t->places; n++)
            if (t->place[n].seeks) t->place[n].push = 0.0; /* their curvature follows the moving place */
        if (form) t->stiff_length = t->stiff_angle = t->stiff = 0.0; /* the Lagrangian alone */
        const double g = gradient_error(t, s.x, s.n, -1), h = hessian_error(t, s.x, s.n, -1);
        print_message("derivatives: gradient %.1e, Hessian %.1e\n", g, h);
        /* Differences of an energy of some 1e2 at 1e-6 keep 8 digits; a limit that switches within the
         * difference would cost the Hessian more. */
        assert_true(g < 1e-6);
        assert_true(h < 1e-6);
        /* A wrong sign is seen. */
        assert_true(gradient_error(t, s.x, s.n, 3 * 7 + 2) > 1e-3);
        assert_true(hessian_error(t, s.x, s.n, t->start[3 * 7 + 2]) > 1e-4);
    }
    morph_settle_destroy(t);
    scene_free(&s);
}

/* Joints one under the other, each with a link to the one above; joint 0 is held. */
enum { CHAIN = 6 };
typedef struct chain {
    morph_structure s;
    int link[CHAIN - 1][2], kind[CHAIN - 1];
    double limit[CHAIN - 1][2], start_length[CHAIN - 1], radius[CHAIN - 1], x[3 * CHAIN];
} chain;

static void make_chain(chain *c, int joints, double stiffness, double most) {
    memset(c, 0, sizeof *c);
    c->s.def = morph_structure_defaults(0.1);
    c->s.def.stiffness = stiffness;
    c->s.spacing = 0.1;
    c->s.joints = joints;
    c->s.links = joints - 1;
    for (int l = 0; l + 1 < joints; l++) {
        c->link[l][0] = l;
        c->link[l][1] = l + 1;
        c->limit[l][0] = 0.05;
        c->limit[l][1] = most;
        c->start_length[l] = 0.1;
        c->radius[l] = 0.004;
    }
    c->s.link = c->link;
    c->s.link_kind = c->kind;
    c->s.length_limit = c->limit;
    c->s.start_length = c->start_length;
    c->s.link_radius = c->radius;
    for (int j = 0; j < joints; j++)
        c->x[3 * j] = 0.1 * j; /* held out level: it has to swing down */
}

/* Gradient of the least distance over the segment x: its weights times the distance's gradient where it is
 * least, found by golden section. Returns the far end's weight. */
static double least_gradient(const morph_sdf *sdf, const double x[6], double g[6]) {
    const double golden = 0.5 * (sqrt(5.0) - 1.0);
    double lo = 0.0, hi = 1.0, n[3], q[3];
    while (hi - lo > 1e-10) {
        double value[2];
        for (int side = 0; side < 2; side++) {
            const double w = side ? lo + golden * (hi - lo) : hi - golden * (hi - lo);
            for (int k = 0; k < 3; k++)
                q[k] = 0.1 * ((1.0 - w) * x[k] + w * x[3 + k]);
            /* The slope along the segment decides: its sign is sharper than the values. */
            morph_sdf_eval(sdf, q, n, NULL);
            value[side] = n[0] * (x[3] - x[0]) + n[1] * (x[4] - x[1]) + n[2] * (x[5] - x[2]);
        }
        if (value[0] > 0.0)
            hi = hi - golden * (hi - lo);
        else if (value[1] < 0.0)
            lo = lo + golden * (hi - lo);
        else {
            const double keep = lo;
            lo = hi - golden * (hi - lo);
            hi = keep + golden * (hi - keep);
        }
    }
    const double w = 0.5 * (lo + hi);
    for (int k = 0; k < 3; k++)
        q[k] = 0.1 * ((1.0 - w) * x[k] + w * x[3 + k]);
    morph_sdf_eval(sdf, q, n, NULL);
    for (int k = 0; k < 3; k++) {
        g[k] = (1.0 - w) * n[k];
        g[3 + k] = w * n[k];
    }
    return w;
}

/* The curvature of a seeker whose place follows the deepest point of a link on a sphere. */
static void rolling_contact(void **state) {
    (void)state;
    const morph_structure_def def = scene_structure(4, 20.0);
    scene s;
    scene_make(&s, &def, true);
    chain c;
    make_chain(&c, 2, 1e-9, 10.0); /* the spring does not count */
    c.kind[0] = MORPH_LINK_TOP;
    morph_settle_def sd = morph_settle_defaults();
    morph_settle *t;
    assert_int_equal(morph_settle_create(&c.s, s.sdf, &sd, &t), MORPH_OK);
    double x[6] = {-0.5, 0.11, 1.86, 0.62, -0.08, 1.8}, g[6], up[6], down[6], unit[6] = {0}, column[6];
    const double w = least_gradient(s.sdf, x, g);
    assert_true(w > 0.1 && w < 0.9);
    morph_settle_place *p = &t->place[t->element[0].first];
    p->used = true;
    p->weight[0] = 1.0 - w;
    p->weight[1] = w;
    p->push = 3.0;
    memcpy(t->before, x, sizeof x);
    morph_settle_begin(t, x);
    t->form = MORPH_SETTLE_PLAIN;
    t->stiff = t->stiff_length = t->stiff_angle = t->drag = 0.0;
    double worst = 0.0, most = 0.0, fixed = 0.0;
    morph_settle_evaluate(t, x, MORPH_SETTLE_EXACT);
    for (int i = 0; i < 6; i++) {
        unit[i] = 1.0;
        morph_sparse_times(t->sparse, t->value, unit, column);
        unit[i] = 0.0;
        const double keep = x[i], h = 1e-4;
        x[i] = keep + h;
        least_gradient(s.sdf, x, up);
        x[i] = keep - h;
        least_gradient(s.sdf, x, down);
        x[i] = keep;
        for (int k = 0; k < 6; k++) {
            worst = fmax(worst, fabs(column[k] + 3.0 * (up[k] - down[k]) / (2.0 * h)));
            most = fmax(most, fabs(column[k]));
        }
        fixed = fmax(fixed, fabs(column[i]));
    }
    print_message("rolling contact: curvature %.3g, error %.1e\n", most, worst);
    assert_true(most > 0.1 && fixed > 0.0);
    assert_true(worst < 1e-3 * most);
    morph_settle_destroy(t);
    scene_free(&s);
}

/* Link l carries the weight of what hangs below it: L = L0 + W / k, or its limit. */
static void hanging_chain(void **state) {
    (void)state;
    for (int joints = 2; joints <= CHAIN; joints += 4)
        for (int limited = 0; limited < 2; limited++) {
            chain c;
            const double k = 20.0, weight = 0.02 * 9.81, most = limited ? 0.115 : 1.0;
            make_chain(&c, joints, k, most);
            morph_settle_def def = morph_settle_defaults();
            def.fixed = (const int[]){0};
            def.fixed_joints = 1;
            morph_settle *t;
            morph_settle_report r;
            assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_OK);
            assert_int_equal(morph_settle_run(t, c.x, false, NULL, &r), MORPH_OK);
            assert_true(r.converged && r.stable);
            assert_true(r.residual < 1e-5 && r.worst_length < 1e-7);
            double z = 0.0;
            for (int j = 1; j < joints; j++) {
                z -= fmin(most, 0.1 + (joints - j) * weight / k);
                /* Forces to 1e-6 weights over springs of 10 weights per spacing; sideways a pendulum. */
                assert_near(c.x[3 * j + 2], z, 1e-7);
                assert_near(c.x[3 * j], 0.0, 1e-6);
                assert_near(c.x[3 * j + 1], 0.0, 1e-6);
            }
            morph_settle_destroy(t);
        }
}

/* Between a centre and a link the joint rests where the pull equals the spring's; the derivative of its place
 * by the centre's strength and position as in closed form. */
static void pulled_link(void **state) {
    (void)state;
    chain c;
    make_chain(&c, 2, 20.0, 1.0);
    const morph_attractor centre = {{0.3, 0.0, 0.0}, 0.02};
    morph_settle_def def = morph_settle_defaults();
    def.gravity = 0.0;
    def.fixed = (const int[]){0};
    def.fixed_joints = 1;
    def.attractor = &centre;
    def.attractors = 1;
    def.tolerance = 1e-10;
    morph_settle *t;
    morph_settle_report r;
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_OK);
    assert_int_equal(morph_settle_run(t, c.x, false, NULL, &r), MORPH_OK);
    assert_true(r.converged && r.stable);
    const double x = c.x[3], way = 0.3 - x, p = sqrt(way * way + 0.01), pull = way / (p * p * p);
    assert_near(20.0 * (x - 0.1), 0.02 * pull, 1e-9);
    /* k (x - L0) = s f(a - x):  dx/ds = f / (k + s f'), dx/da = s f' / (k + s f'). */
    const double slope = 1.0 / (p * p * p) - 3.0 * way * way / pow(p, 5.0);
    double df[6] = {0, 0, 0, 1, 0, 0}, at[1][3], strength;
    assert_int_equal(morph_settle_adjoint(t, df, at, &strength), MORPH_OK);
    assert_near(strength, pull / (20.0 + 0.02 * slope), 1e-6 * fabs(strength));
    assert_near(at[0][0], 0.02 * slope / (20.0 + 0.02 * slope), 1e-6 * fabs(at[0][0]));
    assert_near(at[0][1], 0.0, 1e-9);
    morph_settle_destroy(t);
}

/* The first swing's other end: upright above its support a chain is balanced but not stable, and must fall.
 */
static void leaves_a_saddle(void **state) {
    (void)state;
    chain c;
    make_chain(&c, 2, 200.0, 0.2);
    c.x[3] = 0.0;
    c.x[5] = 0.1;
    morph_settle_def def = morph_settle_defaults();
    def.fixed = (const int[]){0};
    def.fixed_joints = 1;
    morph_settle *t;
    morph_settle_report r;
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_OK);
    assert_int_equal(morph_settle_run(t, c.x, false, NULL, &r), MORPH_OK);
    assert_true(r.converged && r.stable);
    assert_true(r.saddles > 0);
    assert_true(c.x[5] < -0.1);
    morph_settle_destroy(t);
}

static void check_limits(const scene *s, const morph_settle_report *r) {
    assert_true(r->worst_length <= 1e-6 * s->structure->spacing);
    assert_true(r->worst_post <= 1e-6);
    assert_true(r->worst_angle <= 1e-6);
    /* What settle calls clear is 1e-4. */
    assert_true(r->worst_clearance <= 2e-4 * s->structure->spacing);
    for (int i = 0; i < s->n; i++)
        assert_true(isfinite(s->x[i]));
}

static void stiffness_extremes(void **state) {
    (void)state;
    for (int power = 0; power <= 8; power += 2) {
        const morph_structure_def def = scene_structure(4, pow(10.0, power));
        scene s;
        scene_make(&s, &def, true);
        morph_settle_def sd = morph_settle_defaults();
        sd.friction = 0.4;
        sd.base = 0.0;
        morph_settle *t = scene_settle(&s, &sd);
        morph_settle_report r;
        assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
        print_message("stiffness 1e%d: %s, %d steps, %d iterations, residual %.1e weights, %.2f s\n", power,
                      r.converged ? "converged" : "not converged", r.steps, r.iterations, r.residual,
                      r.seconds);
        check_limits(&s, &r);
        assert_true(r.converged);
        morph_settle_destroy(t);
        scene_free(&s);
    }
}

static void strong_attraction(void **state) {
    (void)state;
    const morph_structure_def def = scene_structure(4, 20.0);
    scene s;
    scene_make(&s, &def, true);
    /* A pull of 1e6 weights at half a spacing from the centre. */
    const morph_attractor centre = {{0.0, 0.0, 0.09}, 1e6 * 0.02 * 9.81 * 0.01};
    morph_settle_def sd = morph_settle_defaults();
    sd.friction = 0.4;
    sd.base = 0.0;
    sd.attractor = &centre;
    sd.attractors = 1;
    morph_settle *t = scene_settle(&s, &sd);
    morph_settle_report r;
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    print_message("attraction: %s, %d steps, %d iterations, residual %.1e weights, %.2f s\n",
                  r.converged ? "converged" : "not converged", r.steps, r.iterations, r.residual, r.seconds);
    check_limits(&s, &r);
    assert_true(r.converged);
    morph_settle_destroy(t);
    scene_free(&s);
}

static void rigid_links(void **state) {
    (void)state;
    morph_structure_def def = scene_structure(4, 20.0);
    for (int k = 0; k < 2; k++)
        def.length[k][0] = def.length[k][1] = def.spacing;
    scene s;
    scene_make(&s, &def, true);
    morph_settle_def sd = morph_settle_defaults();
    sd.friction = 0.4;
    sd.base = 0.0;
    morph_settle *t = scene_settle(&s, &sd);
    morph_settle_report r;
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    print_message("rigid links: %s, %d steps, %d iterations, residual %.1e weights, %.2f s\n",
                  r.converged ? "converged" : "not converged", r.steps, r.iterations, r.residual, r.seconds);
    check_limits(&s, &r);
    assert_true(r.converged);
    morph_settle_destroy(t);
    scene_free(&s);
}

static void refuses(void **state) {
    (void)state;
    chain c;
    make_chain(&c, 2, 20.0, 1.0);
    morph_settle *t;
    morph_settle_def def = morph_settle_defaults();
    def.gravity = NAN;
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_ERR_INPUT);
    assert_null(t);
    def = morph_settle_defaults();
    def.friction = -0.1;
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_ERR_INPUT);
    def = morph_settle_defaults();
    def.fixed = (const int[]){2};
    def.fixed_joints = 1;
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_ERR_INPUT);
    def.fixed = (const int[]){0};
    assert_int_equal(morph_settle_create(&c.s, NULL, &def, &t), MORPH_OK);
    double slope[6] = {0};
    assert_int_equal(morph_settle_adjoint(t, slope, NULL, NULL), MORPH_ERR_INPUT);
    c.x[4] = INFINITY;
    assert_int_equal(morph_settle_run(t, c.x, false, NULL, NULL), MORPH_ERR_NONFINITE);
    morph_settle_destroy(t);
    morph_settle_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(derivatives),
                                       cmocka_unit_test(rolling_contact),
                                       cmocka_unit_test(hanging_chain),
                                       cmocka_unit_test(pulled_link),
                                       cmocka_unit_test(leaves_a_saddle),
                                       cmocka_unit_test(stiffness_extremes),
                                       cmocka_unit_test(strong_attraction),
                                       cmocka_unit_test(rigid_links),
                                       cmocka_unit_test(refuses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
