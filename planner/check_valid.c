/* Can the record be used at all? Everything that later code indexes or divides by is looked at here, so that
 * a hostile record ends as a sentence and never as a crash. */
#include "planner/check_parts.h"

/* Numbers beyond this overflow somewhere in squares and divisions by the cube of the sample time; nothing
 * physical is near. */
#define LARGEST 1e30
/* Joints further out than this many spacings make distances lose their digits and motion unresolvable. */
#define FURTHEST 1e6

static bool usable(double x) {
    return fabs(x) <= LARGEST; /* false for NaN */
}

static bool all_usable(const double *x, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!usable(x[i])) return false;
    return true;
}

/* All of n entries within [0, limit); absent arrays are allowed only for n = 0. */
static bool indices(const int *x, size_t n, int limit) {
    if (n > 0 && !x) return false;
    for (size_t i = 0; i < n; i++)
        if (x[i] < 0 || x[i] >= limit) return false;
    return true;
}

static bool shares(const int a[2], int joint) {
    return a[0] == joint || a[1] == joint;
}

static int shared_joints(const int a[2], const int b[2]) {
    return (shares(b, a[0]) ? 1 : 0) + (shares(b, a[1]) ? 1 : 0);
}

static bool fault(morph_findings *f, const char *text) {
    morph_findings_defect(f, "%s", text);
    return false;
}

static bool sizes(const morph_record *r, morph_findings *f) {
    if (r->joints < 2 || r->links < 1 || r->skin_triangles < 1 || r->target_vertices < 3 ||
        r->target_triangles < 1)
        return fault(f, "the record has no joints, links, skin or target");
    if (r->posts < 0 || r->link_posts < 0 || r->link_links < 0 || r->panels < 0 || r->fixed_count < 0)
        return fault(f, "a count of the structure is negative");
    if (!(r->spacing >= 1 / LARGEST) || !usable(r->spacing))
        return fault(f, "structure@spacing is not a positive number");
    return true;
}

static bool topology(const morph_record *r, morph_findings *f) {
    const size_t joints = (size_t)r->joints, links = (size_t)r->links, posts = (size_t)r->posts;
    if (!r->joint_node || !indices(r->joint_layer, joints, 2))
        return fault(f, "structure/joint_layer or joint_node is missing or out of range");
    if (!indices(r->link ? r->link[0] : NULL, 2 * links, r->joints) || !indices(r->link_kind, links, 3))
        return fault(f, "structure/links or link_kind has an index out of range");
    for (int i = 0; i < r->links; i++)
        if (r->link[i][0] == r->link[i][1]) return fault(f, "a link joins a joint with itself");
    if (!indices(r->post ? r->post[0] : NULL, 2 * posts, r->joints))
        return fault(f, "structure/posts has an index out of range");
    for (int i = 0; i < r->posts; i++)
        if (r->post[i][0] == r->post[i][1]) return fault(f, "a post joins a joint with itself");
    if (!indices(r->skin ? r->skin[0] : NULL, 3 * (size_t)r->skin_triangles, r->joints))
        return fault(f, "structure/skin has an index out of range");
    if (!indices(r->panel ? r->panel[0] : NULL, 2 * (size_t)r->panels, r->posts))
        return fault(f, "structure/panels has an index out of range");
    /* Without posts (layout offset) the joints held are listed. */
    if (!indices(r->fixed, (size_t)r->fixed_count, r->posts > 0 ? r->posts : r->joints))
        return fault(f, "structure/fixed has an index out of range");
    return true;
}

static bool tuples(const morph_record *r, morph_findings *f) {
    if ((r->link_posts > 0 && (!r->link_post || !r->link_post_limit)) ||
        (r->link_links > 0 && (!r->link_link || !r->link_link_limit)))
        return fault(f, "structure/link_post_angles or link_link_angles is missing");
    for (int i = 0; i < r->link_posts; i++) {
        const int *t = r->link_post[i];
        if (t[0] < 0 || t[0] >= r->links || t[1] < 0 || t[1] >= r->posts)
            return fault(f, "structure/link_post_angles has an index out of range");
        if (shared_joints(r->link[t[0]], r->post[t[1]]) != 1)
            return fault(f, "structure/link_post_angles names a link that does not end at its post");
    }
    for (int i = 0; i < r->link_links; i++) {
        const int *t = r->link_link[i];
        if (t[0] < 0 || t[0] >= r->links || t[1] < 0 || t[1] >= r->links)
            return fault(f, "structure/link_link_angles has an index out of range");
        if (shared_joints(r->link[t[0]], r->link[t[1]]) != 1)
            return fault(f, "structure/link_link_angles names links that share no joint, or both");
    }
    return true;
}

static bool pair_limits(double (*limit)[2], int n) {
    if (n > 0 && !limit) return false;
    for (int i = 0; i < n; i++)
        if (!usable(limit[i][0]) || !usable(limit[i][1]) || limit[i][0] > limit[i][1]) return false;
    return true;
}

static bool positive(const double *x, int n, bool zero_too) {
    if (n > 0 && !x) return false;
    for (int i = 0; i < n; i++)
        if (!usable(x[i]) || x[i] < 0 || (x[i] == 0 && !zero_too)) return false;
    return true;
}

static bool limits(const morph_record *r, morph_findings *f) {
    if (!pair_limits(r->length_limit, r->links))
        return fault(f, "structure/link_length_limits is missing, inverted or not finite");
    if (!positive(r->rate_limit, r->links, false) || !positive(r->acceleration_limit, r->links, false) ||
        !positive(r->jerk_limit, r->links, false))
        return fault(f, "a rate, acceleration or jerk limit is not a positive number");
    if (!positive(r->link_radius, r->links, true))
        return fault(f, "structure/link_radius is missing or not a number");
    if (!positive(r->post_length, r->posts, false))
        return fault(f, "structure/post_length is missing or not positive");
    if (!pair_limits(r->link_post_limit, r->link_posts) || !pair_limits(r->link_link_limit, r->link_links))
        return fault(f, "an angle limit is inverted or not finite");
    if (!isnan(r->base) && !usable(r->base)) return fault(f, "the height of the base plane is not finite");
    return true;
}

static bool target(const morph_record *r, morph_findings *f) {
    if (!r->target_v || !all_usable(r->target_v, 3 * (size_t)r->target_vertices))
        return fault(f, "target/vertices is missing or not finite");
    if (!indices(r->target_t, 3 * (size_t)r->target_triangles, r->target_vertices))
        return fault(f, "target/triangles has an index out of range");
    if (!r->deformed_v) return r->deformed_t ? fault(f, "deformed/vertices is missing") : true;
    if (r->deformed_vertices < 3 || r->deformed_triangles < 1 ||
        !all_usable(r->deformed_v, 3 * (size_t)r->deformed_vertices))
        return fault(f, "deformed/vertices is empty or not finite");
    if (!indices(r->deformed_t, 3 * (size_t)r->deformed_triangles, r->deformed_vertices))
        return fault(f, "deformed/triangles has an index out of range");
    return true;
}

bool morph_check_structure(const morph_record *r, morph_findings *f) {
    return sizes(r, f) && topology(r, f) && tuples(r, f) && limits(r, f) && target(r, f);
}

double morph_check_radius(const morph_record *r) {
    double radius = 0;
    for (int i = 0; i < r->links; i++)
        radius = fmax(radius, r->link_radius[i]);
    return radius;
}

double morph_check_step(const double *time, int samples) {
    return time[samples - 1] / (samples - 1);
}

int morph_check_even(const double *time, int samples, double tolerance) {
    const double step = morph_check_step(time, samples);
    for (int k = 0; k < samples; k++)
        if (!(fabs(time[k] - k * step) <= tolerance) || (k > 0 && !(time[k] > time[k - 1]))) return k;
    return -1;
}

static bool times(const morph_record *r, morph_findings *f) {
    if (r->samples < 2 || !r->time) return fault(f, "the schedule has fewer than two samples");
    if (!all_usable(r->time, (size_t)r->samples)) return fault(f, "schedule/time is not finite");
    const double step = morph_check_step(r->time, r->samples);
    if (!(step >= 1 / LARGEST)) return fault(f, "schedule/time does not increase");
    /* Even to a millionth of the step: 1e-6 of a rate error where times are used as k * step. The last term
     * is the rounding of k * step itself. */
    const int bad = morph_check_even(r->time, r->samples, 1e-6 * step + 1e-15 * r->time[r->samples - 1]);
    if (bad >= 0) {
        morph_findings_defect(f, "schedule/time is not even from 0: sample %d is at %.9g s", bad,
                              r->time[bad]);
        return false;
    }
    return true;
}

/* Names the first number of a samples x n table that cannot be used. */
static bool table(const morph_record *r, const char *name, const double *x, int n, double largest,
                  morph_element_kind kind, int per_element, morph_findings *f) {
    if (!x) {
        morph_findings_defect(f, "%s is missing", name);
        return false;
    }
    for (int k = 0; k < r->samples; k++)
        for (int i = 0; i < n; i++) {
            const double value = x[(size_t)k * (size_t)n + (size_t)i];
            if (fabs(value) <= largest) continue;
            char text[96];
            morph_element_name(r, morph_element_of(kind, i / per_element), text, sizeof text);
            morph_findings_defect(f, "%s of %s at %.9g s is %s", name, text, r->time[k],
                                  isfinite(value) ? "out of all proportion" : "not finite");
            return false;
        }
    return true;
}

bool morph_check_schedule(const morph_record *r, morph_findings *f) {
    if (!times(r, f)) return false;
    const double far = FURTHEST * r->spacing;
    if (!table(r, "schedule/joints", r->schedule_joints, 3 * r->joints, far, MORPH_ELEMENT_JOINT, 3, f) ||
        !table(r, "schedule/length", r->length, r->links, far, MORPH_ELEMENT_LINK, 1, f) ||
        !table(r, "schedule/rate", r->rate, r->links, LARGEST, MORPH_ELEMENT_LINK, 1, f) ||
        !table(r, "schedule/acceleration", r->acceleration, r->links, LARGEST, MORPH_ELEMENT_LINK, 1, f))
        return false;
    if (!r->offset_schedule) return true;
    for (size_t i = 0; i < 3 * (size_t)r->samples; i++)
        if (!(fabs(r->offset_schedule[i]) <= far))
            return fault(f, "target/offset_schedule is not finite or out of all proportion");
    return true;
}
