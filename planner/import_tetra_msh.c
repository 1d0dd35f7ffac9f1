/* Gmsh .msh as text: versions 2.0 to 2.2 (one list) and 4.1 (lists in blocks of one entity). Sections that
 * are not $MeshFormat, $Nodes or $Elements are passed over, also ones that Gmsh does not know. */
#include "planner/import_tetra_private.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TETRAHEDRON = 4, TETRAHEDRON_10 = 11, MOST_TAGS = 1000 };

typedef struct label {
    long long tag;
    int at;
} label;

typedef struct msh {
    morph_scan *s;
    const morph_sentence *to;
    int version; /* 2 or 4; 0: not said yet */
    bool nodes, elements;
    int vertices, tets;
    double *v;
    label *label;        /* vertices: the file's numbers */
    long long (*tag)[4]; /* tets: the file's numbers of vertices */
} msh;

static morph_status damaged(const msh *m, const char *what) {
    return morph_refuse(m->to, "'%s' is damaged: %s", m->to->name, what);
}

/* Element types of solids other than tetrahedra of first or second order. */
static const char *other_solid(long long type) {
    switch (type) {
    case 5:
    case 12:
    case 17:
        return "hexahedra";
    case 6:
    case 13:
    case 18:
        return "prisms";
    case 7:
    case 14:
    case 19:
        return "pyramids";
    case 29:
    case 30:
    case 31:
        return "tetrahedra of third or higher order";
    default:
        return NULL;
    }
}

static morph_status read_format(msh *m) {
    double version;
    long long binary, size;
    if (!morph_scan_number(m->s, &version) || !morph_scan_whole(m->s, &binary) ||
        !morph_scan_whole(m->s, &size))
        return damaged(m, "$MeshFormat must say version, file type and size of numbers");
    if (binary != 0)
        return morph_refuse(m->to, "'%s' is a binary Gmsh file; only text ones are read (file type 0)",
                            m->to->name);
    /* Written as decimals: nothing lies between. */
    if (version >= 2.0 && version < 2.25)
        m->version = 2;
    else if (version > 4.05 && version < 4.15)
        m->version = 4;
    else
        return morph_refuse(m->to, "'%s' is a Gmsh file of version %g; versions 2.0 to 2.2 and 4.1 are read",
                            m->to->name, version);
    return MORPH_OK;
}

static morph_status reserve_nodes(msh *m, long long n) {
    if (m->nodes) return damaged(m, "it has two sections $Nodes; one is allowed");
    m->nodes = true;
    m->v = morph_alloc((size_t)n, 3 * sizeof *m->v);
    m->label = morph_alloc((size_t)n, sizeof *m->label);
    return m->v && m->label ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status reserve_tets(msh *m, long long n) {
    if (m->elements) return damaged(m, "it has two sections $Elements; one is allowed");
    m->elements = true;
    m->tag = morph_alloc((size_t)n, sizeof *m->tag);
    return m->tag ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status no_node(msh *m) {
    morph_scan_blank(m->s);
    if (m->s->p == m->s->end)
        return morph_refuse(m->to, "'%s' is truncated: it ends after %d vertices", m->to->name, m->vertices);
    return morph_refuse(m->to, "'%s' is damaged: after %d vertices a whole number of the next must stand",
                        m->to->name, m->vertices);
}

static morph_status read_nodes_2(msh *m) {
    long long n;
    morph_status status = morph_scan_count(m->s, "vertices", &n);
    if (status == MORPH_OK) status = reserve_nodes(m, n);
    for (long long i = 0; i < n && status == MORPH_OK; i++, m->vertices++) {
        label *l = &m->label[i];
        l->at = (int)i;
        if (!morph_scan_whole(m->s, &l->tag)) return no_node(m);
        status = morph_scan_place(m->s, l->tag, &m->v[3 * i]);
    }
    return status;
}

/* A block: its numbers, then its places; with parametric nodes as many parameters as the entity has
 * dimensions. */
static morph_status read_node_block(msh *m, long long left) {
    long long dimension, entity, parametric, n;
    if (!morph_scan_whole(m->s, &dimension) || !morph_scan_whole(m->s, &entity) ||
        !morph_scan_whole(m->s, &parametric) || dimension < 0 || dimension > 3)
        return no_node(m);
    morph_status status = morph_scan_count(m->s, "vertices", &n);
    if (status != MORPH_OK) return status;
    if (n > left) return damaged(m, "the blocks of $Nodes hold more vertices than its first line says");
    const int from = m->vertices, end = from + (int)n;
    for (; m->vertices < end; m->vertices++) {
        m->label[m->vertices].at = m->vertices;
        if (!morph_scan_whole(m->s, &m->label[m->vertices].tag)) return no_node(m);
    }
    for (int i = from; i < end; i++) {
        double parameter;
        status = morph_scan_place(m->s, m->label[i].tag, &m->v[3 * i]);
        for (long long k = 0; k < dimension && parametric != 0 && status == MORPH_OK; k++)
            if (!morph_scan_number(m->s, &parameter)) status = no_node(m);
        if (status != MORPH_OK) return status;
    }
    return MORPH_OK;
}

static morph_status read_nodes_4(msh *m) {
    long long blocks, n, low, high;
    morph_status status = morph_scan_count(m->s, "blocks of vertices", &blocks);
    if (status == MORPH_OK) status = morph_scan_count(m->s, "vertices", &n);
    if (status != MORPH_OK) return status;
    if (!morph_scan_whole(m->s, &low) || !morph_scan_whole(m->s, &high))
        return damaged(m, "$Nodes must begin with four whole numbers");
    status = reserve_nodes(m, n);
    for (long long b = 0; b < blocks && status == MORPH_OK; b++)
        status = read_node_block(m, n - m->vertices);
    if (status == MORPH_OK && m->vertices < n)
        return damaged(m, "the blocks of $Nodes hold fewer vertices than its first line says");
    return status;
}

static morph_status no_element(msh *m, long long done) {
    morph_scan_blank(m->s);
    if (m->s->p == m->s->end)
        return morph_refuse(m->to, "'%s' is truncated: it ends after %lld elements", m->to->name, done);
    return morph_refuse(m->to, "'%s' is damaged: element %lld (counted from 1) is no list of whole numbers",
                        m->to->name, done + 1);
}

/* The corners of a tetrahedron; the rest of the line is passed over. */
static bool read_corners(msh *m) {
    for (int k = 0; k < 4; k++)
        if (morph_scan_line_ends(m->s) || !morph_scan_whole(m->s, &m->tag[m->tets][k])) return false;
    m->tets++;
    morph_scan_next_line(m->s);
    return true;
}

static morph_status refuse_solid(const msh *m, long long type) {
    return morph_refuse(m->to, "'%s' has %s; only tetrahedra with 4 or 10 vertices are read", m->to->name,
                        other_solid(type));
}

static morph_status read_elements_2(msh *m) {
    long long n;
    morph_status status = morph_scan_count(m->s, "elements", &n);
    if (status == MORPH_OK) status = reserve_tets(m, n);
    for (long long i = 0; i < n && status == MORPH_OK; i++) {
        long long number, type, tags, tag;
        if (!morph_scan_whole(m->s, &number) || !morph_scan_whole(m->s, &type) ||
            !morph_scan_whole(m->s, &tags) || tags < 0 || tags > MOST_TAGS)
            return no_element(m, i);
        if (other_solid(type)) return refuse_solid(m, type);
        if (type != TETRAHEDRON && type != TETRAHEDRON_10) {
            morph_scan_next_line(m->s);
            continue;
        }
        for (long long k = 0; k < tags; k++)
            if (!morph_scan_whole(m->s, &tag)) return no_element(m, i);
        if (!read_corners(m)) return no_element(m, i);
    }
    return status;
}

static morph_status read_element_block(msh *m, long long *done, long long all) {
    long long dimension, entity, type, n, number;
    if (!morph_scan_whole(m->s, &dimension) || !morph_scan_whole(m->s, &entity) ||
        !morph_scan_whole(m->s, &type))
        return no_element(m, *done);
    const morph_status status = morph_scan_count(m->s, "elements", &n);
    if (status != MORPH_OK) return status;
    if (n > all - *done)
        return damaged(m, "the blocks of $Elements hold more elements than its first line says");
    if (other_solid(type)) return refuse_solid(m, type);
    for (long long i = 0; i < n; i++, (*done)++) {
        if (!morph_scan_whole(m->s, &number)) return no_element(m, *done);
        if (type != TETRAHEDRON && type != TETRAHEDRON_10)
            morph_scan_next_line(m->s);
        else if (!read_corners(m))
            return no_element(m, *done);
    }
    return MORPH_OK;
}

static morph_status read_elements_4(msh *m) {
    long long blocks, n, low, high, done = 0;
    morph_status status = morph_scan_count(m->s, "blocks of elements", &blocks);
    if (status == MORPH_OK) status = morph_scan_count(m->s, "elements", &n);
    if (status != MORPH_OK) return status;
    if (!morph_scan_whole(m->s, &low) || !morph_scan_whole(m->s, &high))
        return damaged(m, "$Elements must begin with four whole numbers");
    status = reserve_tets(m, n);
    for (long long b = 0; b < blocks && status == MORPH_OK; b++)
        status = read_element_block(m, &done, n);
    if (status == MORPH_OK && done < n)
        return damaged(m, "the blocks of $Elements hold fewer elements than its first line says");
    return status;
}

/* To behind the line $End and the section's name. `strict`: nothing may stand before it. */
static morph_status end_section(msh *m, const char *name, size_t length, bool strict) {
    while (m->s->p < m->s->end) {
        morph_scan_blank(m->s);
        const char *p = m->s->p;
        if (m->s->end - p >= (ptrdiff_t)(4 + length) && strncmp(p, "$End", 4) == 0 &&
            strncmp(p + 4, name, length) == 0 &&
            (p + 4 + length == m->s->end || isspace((unsigned char)p[4 + length]))) {
            morph_scan_next_line(m->s);
            return MORPH_OK;
        }
        if (p < m->s->end && strict)
            return morph_refuse(m->to, "'%s' is damaged: $End%.*s must follow what section $%.*s announces",
                                m->to->name, (int)length, name, (int)length, name);
        morph_scan_next_line(m->s);
    }
    return morph_refuse(m->to, "'%s' is truncated: section $%.*s has no end", m->to->name, (int)length, name);
}

static bool named(const char *name, size_t length, const char *what) {
    return length == strlen(what) && strncmp(name, what, length) == 0;
}

static morph_status read_section(msh *m) {
    const char *name = m->s->p + 1;
    size_t length = 0;
    while (name + length < m->s->end && !isspace((unsigned char)name[length]))
        length++;
    if (length > 60) return damaged(m, "a section has a name of more than 60 letters");
    m->s->p = name + length;
    const bool nodes = named(name, length, "Nodes"), elements = named(name, length, "Elements");
    morph_status status = MORPH_OK;
    bool strict = true;
    if ((nodes || elements) && m->version == 0)
        return damaged(m, "$MeshFormat must stand before $Nodes and $Elements");
    if (named(name, length, "MeshFormat"))
        status = read_format(m);
    else if (nodes)
        status = m->version == 2 ? read_nodes_2(m) : read_nodes_4(m);
    else if (elements)
        status = m->version == 2 ? read_elements_2(m) : read_elements_4(m);
    else
        strict = false;
    return status == MORPH_OK ? end_section(m, name, length, strict) : status;
}

static int compare_labels(const void *p, const void *q) {
    const label *a = p, *b = q;
    return (a->tag > b->tag) - (a->tag < b->tag);
}

static morph_status resolve(msh *m, morph_raw_tetra *out) {
    if (!m->nodes) return damaged(m, "it has no section $Nodes");
    if (!m->elements) return damaged(m, "it has no section $Elements");
    qsort(m->label, (size_t)m->vertices, sizeof *m->label, compare_labels);
    for (int i = 1; i < m->vertices; i++)
        if (m->label[i].tag == m->label[i - 1].tag)
            return morph_refuse(m->to, "'%s' is damaged: two vertices have the number %lld", m->to->name,
                                m->label[i].tag);
    out->tet = morph_alloc((size_t)m->tets, sizeof *out->tet);
    if (!out->tet) return MORPH_ERR_NOMEM;
    for (int t = 0; t < m->tets; t++)
        for (int k = 0; k < 4; k++) {
            const label key = {m->tag[t][k], 0};
            const label *at = bsearch(&key, m->label, (size_t)m->vertices, sizeof key, compare_labels);
            if (!at)
                return morph_refuse(m->to,
                                    "'%s' is damaged: tetrahedron %d (counted from 1) names vertex %lld, "
                                    "which is not in $Nodes",
                                    m->to->name, t + 1, key.tag);
            out->tet[t][k] = at->at;
        }
    out->vertices = m->vertices;
    out->tets = m->tets;
    out->v = m->v;
    m->v = NULL;
    return MORPH_OK;
}

morph_status morph_read_msh(morph_scan *s, morph_raw_tetra *out) {
    msh m = {.s = s, .to = s->sentence};
    morph_scan_blank(s);
    morph_status status = MORPH_OK;
    if (s->end - s->p < 11 || strncmp(s->p, "$MeshFormat", 11) != 0)
        return morph_refuse(s->sentence,
                            "'%s' is no Gmsh file of version 2 or 4: that begins with $MeshFormat",
                            s->sentence->name);
    while (status == MORPH_OK) {
        morph_scan_blank(s);
        if (s->p == s->end) break;
        status = *s->p == '$' ? read_section(&m) : damaged(&m, "outside its sections only '$' begins a line");
    }
    if (status == MORPH_OK) status = resolve(&m, out);
    free(m.v);
    free(m.label);
    free(m.tag);
    return status;
}
