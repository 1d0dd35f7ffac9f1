/* How far each part of the blanket has come: what its rows may sleep by. A row that is some way from its
 * limit need not be looked at before the joints it hangs on have moved by that much, whatever moves
 * elsewhere. */
#include "model/blanket_internal.h"

/* Spans: joints, links, skin triangles, posts, in this order. */
morph_status morph_blanket_paths_create(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const size_t spans = (size_t)s->joints + (size_t)s->links + (size_t)s->skin_triangles + (size_t)s->posts;
    b->path = morph_alloc(spans, sizeof *b->path);
    b->move = morph_alloc(spans, sizeof *b->move);
    return b->path && b->move ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* No place of a span moves further than the furthest of its corners. */
static void spread(const morph_structure *s, double *move) {
    double *link = move + s->joints, *skin = link + s->links, *post = skin + s->skin_triangles;
    for (int l = 0; l < s->links; l++) {
        const double a = move[s->link[l][0]], c = move[s->link[l][1]];
        link[l] = a > c ? a : c;
    }
    for (int t = 0; t < s->skin_triangles; t++) {
        const double a = move[s->skin[t][0]], c = move[s->skin[t][1]], e = move[s->skin[t][2]];
        const double most = a > c ? a : c;
        skin[t] = most > e ? most : e;
    }
    for (int p = 0; p < s->posts; p++) {
        const double a = move[s->post[p][0]], c = move[s->post[p][1]];
        post[p] = a > c ? a : c;
    }
}

double morph_blanket_note_moves(morph_blanket_state *b, const double *x) {
    double most = 0.0;
    for (int j = 0; j < b->joints; j++) {
        b->move[j] = morph_dist(&x[3 * j], &b->before[3 * j]);
        if (b->move[j] > most) most = b->move[j];
    }
    spread(b->structure, b->move);
    const double spacing = b->structure->spacing;
    b->added = fmin(most + MORPH_BLANKET_ADD * spacing, MORPH_BLANKET_ADD_MOST * spacing);
    return most;
}

void morph_blanket_add_paths(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const int spans = s->joints + s->links + s->skin_triangles + s->posts;
    morph_blanket_note_moves(b, b->x);
    for (int n = 0; n < spans; n++)
        b->path[n] += b->move[n];
    b->lift_path += fabs(b->lift_to - b->lift);
}
