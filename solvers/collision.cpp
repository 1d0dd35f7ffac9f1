/* The seal around FCL: its bounding volume hierarchy over the target and its triangle distance, nothing else.
 *
 * Two things of FCL 0.7 are worked around, both shown by tests/solvers/test_collision.c:
 * - its triangle distance skips the test "vertex over face" where |normal|^2 < 1e-15, an absolute number, so
 *   that triangles with edges below about 2e-4 get distances wrong by factors or a false 0. Distances scale
 *   with coordinates, so everything is multiplied by a power of two (exact) that makes the solid 2^40 large;
 * - a triangle that is collinear but for rounding has a normal of pure noise. Such triangles are handed over
 *   as (p, q, q): its normal is exactly zero, and then the edges alone decide, which is exact.
 * FCL's own distance() builds a hierarchy for the query and compares swept rectangles; walking the target's
 * hierarchy with axis-parallel boxes instead gives the same numbers, bit for bit, up to 4 times faster. */
#include "solvers/collision.h"

#include <algorithm>
#include <cmath>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

namespace {

using Vector = fcl::Vector3<double>;
using Model = fcl::BVHModel<fcl::OBBRSS<double>>;

struct Box {
    double lo[3], hi[3];
};

struct Pending {
    int node;
    double squared; /* of the distance between the boxes: a lower bound */
};

void cover(Box &box, const Vector &p) {
    for (int k = 0; k < 3; k++) {
        box.lo[k] = std::min(box.lo[k], p[k]);
        box.hi[k] = std::max(box.hi[k], p[k]);
    }
}

Box nothing() {
    constexpr double inf = std::numeric_limits<double>::infinity();
    return {{inf, inf, inf}, {-inf, -inf, -inf}};
}

Box box_of(const Vector p[3]) {
    Box box = nothing();
    for (int c = 0; c < 3; c++)
        cover(box, p[c]);
    return box;
}

double box_gap_squared(const Box &a, const Box &b) {
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double gap = std::max({0.0, a.lo[k] - b.hi[k], b.lo[k] - a.hi[k]});
        sum += gap * gap;
    }
    return sum;
}

/* Where twice the area is below 1e-12 of the longest edge squared, the triangle is its longest edge to within
 * 1e-12 of that edge: rewritten as (p, q, q). */
void straighten(Vector p[3]) {
    int longest = 0;
    double squared = -1;
    for (int c = 0; c < 3; c++) {
        const double s = (p[(c + 1) % 3] - p[c]).squaredNorm();
        if (s > squared) {
            squared = s;
            longest = c;
        }
    }
    const double area = (p[1] - p[0]).cross(p[2] - p[0]).norm();
    if (area > 1e-12 * squared) return;
    const Vector a = p[longest], b = p[(longest + 1) % 3];
    p[0] = a;
    p[1] = b;
    p[2] = b;
}

bool all_finite(const double *x, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!std::isfinite(x[i])) return false;
    return true;
}

} // namespace

struct morph_solid {
    Model model;
    std::vector<Box> box;       /* per node of the hierarchy */
    std::vector<Vector> corner; /* 3 per leaf triangle, scaled and straightened */
    int shift = 0;              /* coordinates are multiplied by 2^shift */
    size_t depth = 0;

    void build(const double *v, int vertices, const int *t, int triangles);
    void cover_nodes();
    double nearest(const Vector q[3], double best) const;
};

/* Scale so that the bounding box has a diagonal in [2^40, 2^41): a triangle of 1e-9 of the solid then still
 * has |normal|^2 near 1e12, far above FCL's 1e-15, and squares stay far from overflow. */
static int scale_shift(const double *v, int vertices) {
    Box box = nothing();
    for (int i = 0; i < vertices; i++)
        cover(box, Vector(v[3 * i], v[3 * i + 1], v[3 * i + 2]));
    double longest = 0;
    for (int k = 0; k < 3; k++)
        longest = std::max(longest, box.hi[k] - box.lo[k]);
    return longest > 0 && std::isfinite(longest) ? 40 - std::ilogb(longest) : 0;
}

void morph_solid::build(const double *v, int vertices, const int *t, int triangles) {
    shift = scale_shift(v, vertices);
    std::vector<Vector> points;
    std::vector<fcl::Triangle> faces;
    points.reserve(static_cast<size_t>(vertices));
    for (int i = 0; i < vertices; i++)
        points.emplace_back(std::ldexp(v[3 * i], shift), std::ldexp(v[3 * i + 1], shift),
                            std::ldexp(v[3 * i + 2], shift));
    for (int i = 0; i < triangles; i++) {
        faces.emplace_back(static_cast<size_t>(t[3 * i]), static_cast<size_t>(t[3 * i + 1]),
                           static_cast<size_t>(t[3 * i + 2]));
        Vector p[3];
        for (int c = 0; c < 3; c++)
            p[c] = points[static_cast<size_t>(t[3 * i + c])];
        straighten(p);
        corner.insert(corner.end(), p, p + 3);
    }
    if (model.beginModel(triangles, vertices) != fcl::BVH_OK ||
        model.addSubModel(points, faces) != fcl::BVH_OK || model.endModel() != fcl::BVH_OK)
        throw std::runtime_error("FCL refused the mesh");
    cover_nodes();
}

/* Children of a node are numbered after it, so one pass backwards gives the boxes, one forwards the depth. */
void morph_solid::cover_nodes() {
    const int nodes = model.getNumBVs();
    box.assign(static_cast<size_t>(nodes), nothing());
    std::vector<size_t> level(static_cast<size_t>(nodes), 1);
    for (int i = nodes - 1; i >= 0; i--) {
        const auto &node = model.getBV(i);
        Box &own = box[static_cast<size_t>(i)];
        if (node.isLeaf()) {
            own = box_of(&corner[3 * static_cast<size_t>(node.primitiveId())]);
            continue;
        }
        for (const int child : {node.leftChild(), node.rightChild()}) {
            if (child <= i || child >= nodes) throw std::runtime_error("unexpected order of nodes");
            const Box &b = box[static_cast<size_t>(child)];
            cover(own, Vector(b.lo[0], b.lo[1], b.lo[2]));
            cover(own, Vector(b.hi[0], b.hi[1], b.hi[2]));
        }
    }
    for (int i = 0; i < nodes; i++) {
        const auto &node = model.getBV(i);
        depth = std::max(depth, level[static_cast<size_t>(i)]);
        if (node.isLeaf()) continue;
        for (const int child : {node.leftChild(), node.rightChild()})
            level[static_cast<size_t>(child)] = level[static_cast<size_t>(i)] + 1;
    }
}

/* Least distance of triangle q to the solid if below `best`, else `best`. The nearer child goes first; a pair
 * of boxes as far apart as the best so far is skipped. */
double morph_solid::nearest(const Vector q[3], double best) const {
    const Box own = box_of(q);
    std::vector<Pending> stack;
    stack.reserve(depth + 2);
    stack.push_back({0, box_gap_squared(own, box[0])});
    while (!stack.empty() && best > 0) {
        const Pending top = stack.back();
        stack.pop_back();
        if (top.squared >= best * best) continue;
        const auto &node = model.getBV(top.node);
        if (node.isLeaf()) {
            Vector on_q, on_solid;
            const double d = fcl::detail::TriangleDistance<double>::triDistance(
                q, &corner[3 * static_cast<size_t>(node.primitiveId())], on_q, on_solid);
            best = std::min(best, d);
            continue;
        }
        Pending near = {node.leftChild(), box_gap_squared(own, box[static_cast<size_t>(node.leftChild())])};
        Pending far = {node.rightChild(), box_gap_squared(own, box[static_cast<size_t>(node.rightChild())])};
        if (far.squared < near.squared) std::swap(near, far);
        stack.push_back(far);
        stack.push_back(near);
    }
    return best;
}

extern "C" morph_status morph_solid_create(const double *v, int vertices, const int *t, int triangles,
                                           morph_solid **out) noexcept {
    *out = nullptr;
    if (!v || !t || vertices < 1 || triangles < 1 || triangles > std::numeric_limits<int>::max() / 6)
        return MORPH_ERR_INPUT;
    if (!all_finite(v, 3 * static_cast<size_t>(vertices))) return MORPH_ERR_NONFINITE;
    for (size_t i = 0; i < 3 * static_cast<size_t>(triangles); i++)
        if (t[i] < 0 || t[i] >= vertices) return MORPH_ERR_INPUT;
    morph_solid *solid = nullptr;
    try {
        solid = new morph_solid;
        solid->build(v, vertices, t, triangles);
        *out = solid;
        return MORPH_OK;
    } catch (const std::bad_alloc &) {
        delete solid;
        return MORPH_ERR_NOMEM;
    } catch (...) {
        delete solid;
        return MORPH_ERR_BACKEND;
    }
}

extern "C" void morph_solid_destroy(morph_solid *solid) noexcept {
    delete solid;
}

extern "C" morph_status morph_solid_distance(const morph_solid *solid, const double *triangles, int count,
                                             double *distance, int *element) noexcept {
    *distance = 0;
    *element = -1;
    if (!triangles || count < 1) return MORPH_ERR_INPUT;
    if (!all_finite(triangles, 9 * static_cast<size_t>(count))) return MORPH_ERR_NONFINITE;
    try {
        double best = std::numeric_limits<double>::infinity();
        for (int i = 0; i < count; i++) {
            Vector q[3];
            for (int c = 0; c < 3; c++)
                for (int k = 0; k < 3; k++)
                    q[c][k] = std::ldexp(
                        triangles[9 * static_cast<size_t>(i) + static_cast<size_t>(3 * c + k)], solid->shift);
            straighten(q);
            const double d = solid->nearest(q, best);
            if (d < best) {
                best = d;
                *element = i;
            }
        }
        if (!std::isfinite(best)) return MORPH_ERR_NONFINITE; /* coordinates too large to square */
        *distance = std::ldexp(best, -solid->shift);
        return MORPH_OK;
    } catch (const std::bad_alloc &) {
        return MORPH_ERR_NOMEM;
    } catch (...) {
        return MORPH_ERR_BACKEND;
    }
}

/* Sweep along the axis on which the boxes' centres spread most: sorted by their lower ends, each box is
 * compared with those that begin before it ends. Touching boxes overlap. */
static void sweep_boxes(const double *lo, const double *hi, int count,
                        std::vector<std::pair<int, int>> &pairs) {
    size_t axis = 0;
    double widest = -1;
    for (size_t k = 0; k < 3; k++) {
        double least = std::numeric_limits<double>::infinity(), most = -least;
        for (size_t i = 0; i < static_cast<size_t>(count); i++) {
            const double centre = lo[3 * i + k] + hi[3 * i + k];
            least = std::min(least, centre);
            most = std::max(most, centre);
        }
        if (most - least > widest) {
            widest = most - least;
            axis = k;
        }
    }
    std::vector<size_t> order(static_cast<size_t>(count));
    for (size_t i = 0; i < order.size(); i++)
        order[i] = i;
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return std::make_pair(lo[3 * a + axis], a) < std::make_pair(lo[3 * b + axis], b);
    });
    const size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (size_t m = 0; m < order.size(); m++)
        for (size_t n = m + 1; n < order.size(); n++) {
            const size_t a = order[m], b = order[n];
            if (lo[3 * b + axis] > hi[3 * a + axis]) break;
            if (lo[3 * a + u] > hi[3 * b + u] || lo[3 * b + u] > hi[3 * a + u]) continue;
            if (lo[3 * a + w] > hi[3 * b + w] || lo[3 * b + w] > hi[3 * a + w]) continue;
            pairs.emplace_back(static_cast<int>(std::min(a, b)), static_cast<int>(std::max(a, b)));
        }
    std::sort(pairs.begin(), pairs.end());
}

extern "C" morph_status morph_box_pairs(const double *lo, const double *hi, int count, int (*pairs)[2],
                                        int capacity, int *found) noexcept {
    *found = 0;
    if (count < 0 || (count > 0 && (!lo || !hi)) || capacity < 0 || (capacity > 0 && !pairs))
        return MORPH_ERR_INPUT;
    if (!all_finite(lo, 3 * static_cast<size_t>(count)) || !all_finite(hi, 3 * static_cast<size_t>(count)))
        return MORPH_ERR_NONFINITE;
    try {
        std::vector<std::pair<int, int>> all;
        sweep_boxes(lo, hi, count, all);
        if (all.size() > static_cast<size_t>(std::numeric_limits<int>::max())) return MORPH_ERR_NOMEM;
        *found = static_cast<int>(all.size());
        for (int i = 0; i < std::min(*found, capacity); i++) {
            pairs[i][0] = all[static_cast<size_t>(i)].first;
            pairs[i][1] = all[static_cast<size_t>(i)].second;
        }
        return MORPH_OK;
    } catch (const std::bad_alloc &) {
        return MORPH_ERR_NOMEM;
    } catch (...) {
        return MORPH_ERR_BACKEND;
    }
}
