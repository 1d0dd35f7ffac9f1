/* TetGen: NAME.node holds the vertices, NAME.ele the tetrahedra. */
#include "planner/import_tetra_private.h"

#include <stdlib.h>

/* Rows are numbered one after the other from 0 or from 1; the first of the vertices decides. */
static morph_status row_number(morph_scan *s, const char *what, int row, long long expected) {
    const morph_sentence *to = s->sentence;
    long long number;
    morph_scan_blank(s);
    if (s->p == s->end)
        return morph_refuse(to, "'%s' is truncated: it ends after %d of its %s", to->name, row, what);
    if (!morph_scan_whole(s, &number) || number != expected)
        return morph_refuse(to, "'%s' is damaged: its %s must be numbered one by one, %lld is missing",
                            to->name, what, expected);
    return MORPH_OK;
}

morph_status morph_read_node(morph_scan *s, int *base, morph_raw_tetra *out) {
    const morph_sentence *to = s->sentence;
    long long n, dimension = 0, first = 0;
    morph_status status = morph_scan_count(s, "vertices", &n);
    if (status != MORPH_OK) return status;
    if (!morph_scan_line_ends(s) && (!morph_scan_whole(s, &dimension) || dimension != 3))
        return morph_refuse(to, "'%s' must have three dimensions, as its first line's second number",
                            to->name);
    morph_scan_next_line(s);
    if (n == 0) return morph_refuse(to, "'%s' lists no vertices; a tetrahedron needs four", to->name);
    out->v = morph_alloc((size_t)n, 3 * sizeof *out->v);
    if (!out->v) return MORPH_ERR_NOMEM;
    out->vertices = (int)n;
    const morph_scan start = *s;
    if (!morph_scan_whole(s, &first) || (first != 0 && first != 1)) {
        morph_scan_blank(s);
        if (s->p == s->end)
            return morph_refuse(to, "'%s' is truncated: it ends before its vertices", to->name);
        return morph_refuse(to, "'%s' is damaged: its vertices must be numbered from 0 or from 1", to->name);
    }
    *s = start;
    *base = (int)first;
    for (int i = 0; i < out->vertices; i++) {
        status = row_number(s, "vertices", i, i + first);
        if (status == MORPH_OK) status = morph_scan_place(s, i + first, &out->v[3 * i]);
        if (status != MORPH_OK) return status;
        morph_scan_next_line(s); /* attributes and marker */
    }
    return MORPH_OK;
}

morph_status morph_read_ele(morph_scan *s, int base, morph_raw_tetra *out) {
    const morph_sentence *to = s->sentence;
    long long n, corners = 4;
    morph_status status = morph_scan_count(s, "tetrahedra", &n);
    if (status != MORPH_OK) return status;
    if (!morph_scan_line_ends(s) && (!morph_scan_whole(s, &corners) || (corners != 4 && corners != 10)))
        return morph_refuse(to,
                            "'%s' must have 4 or 10 vertices per tetrahedron, as its first line's second "
                            "number",
                            to->name);
    morph_scan_next_line(s);
    out->tet = morph_alloc((size_t)n, sizeof *out->tet);
    if (!out->tet) return MORPH_ERR_NOMEM;
    out->tets = (int)n;
    for (int t = 0; t < out->tets; t++) {
        status = row_number(s, "tetrahedra", t, (long long)t + base);
        for (int k = 0; k < 4 && status == MORPH_OK; k++) {
            long long at;
            if (morph_scan_line_ends(s) || !morph_scan_whole(s, &at) || at < base ||
                at >= (long long)out->vertices + base)
                status =
                    morph_refuse(to,
                                 "'%s' is damaged: tetrahedron %lld must name four vertices from %d to "
                                 "%lld",
                                 to->name, (long long)t + base, base, (long long)out->vertices + base - 1);
            else
                out->tet[t][k] = (int)(at - base);
        }
        if (status != MORPH_OK) return status;
        morph_scan_next_line(s);
    }
    return MORPH_OK;
}
