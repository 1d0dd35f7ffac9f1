/* Bad scenes: the exact line, the key, and what is said; all faults at once. */
#include "tests/planner/test_scene_fault_fixture.h"

/* Every case is the scene below with one line replaced (line 0: the text stands as it is). */
static const char *const lines[] = {
    "morphplan: 1",             /* 1 */
    "title: A title",           /* 2 */
    "structure:",               /* 3 */
    "  nodes: [4, 5]",          /* 4 */
    "  spacing: 0.1",           /* 5 */
    "  link:",                  /* 6 */
    "    radius: 0.004",        /* 7 */
    "  angle:",                 /* 8 */
    "    link_post: [55, 125]", /* 9 */
    "target:",                  /* 10 */
    "  shape: box",             /* 11 */
    "  size: [0.1, 0.1, 0.1]",  /* 12 */
    "base: 0",                  /* 13 */
    "motion:",                  /* 14 */
    "  drag: 0.2",              /* 15 */
    "attractors: auto",         /* 16 */
    "start: flat",              /* 17 */
    "goal:",                    /* 18 */
    "schedule:",                /* 19 */
    "  duration: auto",         /* 20 */
};
enum { LINES = sizeof lines / sizeof *lines };

typedef struct bad_case {
    int replaced;   /* line that is replaced, from 1 */
    const char *by; /* may hold several lines */
    int line;       /* of the one fault */
    const char *key, *phrase;
} bad_case;

static void compose(int replaced, const char *by, char *text, size_t size) {
    size_t used = 0;
    for (int k = 0; k < LINES; k++)
        used += (size_t)snprintf(text + used, size - used, "%s\n", k + 1 == replaced ? by : lines[k]);
}

static const bad_case cases[] = {
    /* version and title */
    {1, "# nothing", 2, "morphplan", "is missing, allowed: 1"},
    {1, "morphplan: 2", 1, "morphplan", "2 is too large, allowed: 1"},
    {1, "morphplan: 0", 1, "morphplan", "0 is too small"},
    {1, "morphplan: one", 1, "morphplan", "one is no number"},
    {1, "morphplan: 1.0", 1, "morphplan", "1.0 is no whole number"},
    {1, "morphplan: \"1\"", 1, "morphplan", "text in quotes"},
    {1, "morphplan:", 1, "morphplan", "nothing is no number"},
    {2, "title: [a, b]", 2, "title", "a list of 2 is no text"},
    {2, "title:", 2, "title", "nothing is no text"},
    {2, "title: \"a\\nb\"", 2, "title", "control character"},
    {2,
     "title: "
     "0123456789012345678901234567890123456789012345678901234567890123456789012345678901234567890123456789"
     "0123456789012345678901234567890123456789",
     2, "title", "too long, allowed: at most 120 bytes"},
    /* keys */
    {2, "titel: A", 2, "titel", "unknown key, did you mean title?"},
    {2, "spacing: 0.1", 2, "spacing", "did you mean structure.spacing?"},
    {2, "colour: red", 2, "colour", "unknown key, allowed: morphplan, title, structure"},
    {2, "title: a\ntitle: b", 3, "title", "given twice, first in line 2"},
    {2, "[a]: 1", 2, "a list of 1", "unknown key"},
    {2, "\"ti\\ttle\": 1", 2, "\"ti?tle\"", "did you mean title"},
    {5, "  spacing: 0.1\n  thicknes: 0.05", 6, "structure.thicknes", "did you mean thickness?"},
    {5, "  spacing: 0.1\n  radius: 0.05", 6, "structure.radius",
     "unknown key here, did you mean structure.link.radius or target.radius? allowed: layout, nodes"},
    {5, "  spacing: 0.1\n  stiffness: 5", 6, "structure.stiffness",
     "did you mean structure.link.stiffness or structure.angle.stiffness?"},
    {5, "  spacing: 0.1\n  damping: 5", 6, "structure.damping", "did you mean structure.link.damping?"},
    {5, "  spacing: 0.1\n  spacing: 0.2", 6, "structure.spacing", "given twice, first in line 5"},
    {7, "    radius: 0.004\n    accel: 1", 8, "structure.link.accel", "did you mean acceleration?"},
    {15, "  drag: 0.2\n  hieght: 1", 16, "motion.hieght", "did you mean height?"},
    /* the grid */
    {4, "  mass: 0.1", 3, "structure.nodes", "is missing, allowed: a list of 2"},
    {4, "  nodes: 4", 4, "structure.nodes", "4, allowed: a list of 2"},
    {4, "  nodes: [4]", 4, "structure.nodes", "a list of 1, allowed: a list of 2"},
    {4, "  nodes: [4, 4, 4]", 4, "structure.nodes", "a list of 3"},
    {4, "  nodes: {x: 4, y: 4}", 4, "structure.nodes", "a mapping, allowed: a list of 2"},
    {4, "  nodes:\n    - 4\n    - 1", 6, "structure.nodes[1]",
     "1 is too small, allowed: a whole number from 2 to 64"},
    {4, "  nodes: [65, 4]", 4, "structure.nodes[0]", "65 is too large"},
    {4, "  nodes: [4, 99999999999999999999]", 4, "structure.nodes[1]", "is too large"},
    {4, "  nodes: [4, -99999999999999999999]", 4, "structure.nodes[1]", "is too small"},
    {4, "  nodes: [4.5, 4]", 4, "structure.nodes[0]", "4.5 is no whole number"},
    {4, "  nodes: [4, four]", 4, "structure.nodes[1]", "four is no number"},
    {4, "  nodes: [4, nan]", 4, "structure.nodes[1]", "nan is not finite"},
    {5, "  mass: 0.1", 3, "structure.spacing", "is missing"},
    {5, "  spacing: 0", 5, "structure.spacing", "0 is too small"},
    {5, "  spacing: -0.1", 5, "structure.spacing", "-0.1 is too small, allowed: a number of at least 1e-06"},
    {5, "  spacing: .nan", 5, "structure.spacing", ".nan is not finite"},
    {5, "  spacing: NaN", 5, "structure.spacing", "NaN is not finite"},
    {5, "  spacing: inf", 5, "structure.spacing", "inf is not finite"},
    {5, "  spacing: -.inf", 5, "structure.spacing", "-.inf is not finite"},
    {5, "  spacing: 1e999", 5, "structure.spacing", "1e999 is not finite"},
    {5, "  spacing: 1e7", 5, "structure.spacing", "1e7 is too large"},
    {5, "  spacing: 0x1p-3", 5, "structure.spacing", "0x1p-3 is no number"},
    {5, "  spacing: 0,1", 5, "structure.spacing", "0,1 is no number"},
    {5, "  spacing: 0.1 m", 5, "structure.spacing", "0.1 m is no number"},
    {5, "  spacing: '0.1'", 5, "structure.spacing", "text in quotes"},
    {5, "  spacing: [0.1]", 5, "structure.spacing", "a list of 1 is no number"},
    {5, "  spacing: {}", 5, "structure.spacing", "a mapping is no number"},
    {5, "  spacing:", 5, "structure.spacing", "nothing is no number"},
    {5, "  spacing: ~", 5, "structure.spacing", "~ is no number"},
    {5, "  spacing: true", 5, "structure.spacing", "true is no number"},
    {5, "  spacing: 0.1\n  thickness: -0.05", 6, "structure.thickness",
     "-0.05 is negative, allowed: a number above 0"},
    {5, "  spacing: 0.1\n  thickness: 0", 6, "structure.thickness", "0 is too small"},
    {5, "  spacing: 0.1\n  thickness: 0.007", 7 + 1, "structure.link.radius", "touch at the start"},
    {7, "    rate: 0.05\n  thickness: 0.007", 8, "structure.thickness",
     "allowed: a radius below half the thickness"},
    {5, "  spacing: 0.1\n  mass: 0", 6, "structure.mass", "0 is too small"},
    {5, "  spacing: 0.1\n  layout: post", 6, "structure.layout", "post is not known, did you mean posts?"},
    {5, "  spacing: 0.1\n  joints: [ball]", 6, "structure.joints",
     "a list of 1 is not known, allowed: ball, universal"},
    {5, "  spacing: 0.1\n  fixed: edge", 6, "structure.fixed", "allowed: none, border, corners"},
    {5, "  spacing: 0.1\n  fixed: [[0, 0], [4, 0]]", 6, "structure.fixed[1][0]",
     "4 is too large, allowed: a whole number"},
    {5, "  spacing: 0.1\n  fixed: [3]", 6, "structure.fixed[0]", "3, allowed: a list of 2"},
    {5, "  spacing: 0.1\n  fixed: {node: [1, 1]}", 6, "structure.fixed", "a mapping is not known"},
    {5, "  spacing: 0.1\n  fixed: [[0, 5]]", 6, "structure.fixed[0][1]",
     "5 is too large, allowed: a whole number from 0 to 4"},
    {5, "  spacing: 0.1\n  fixed: [[-1, 0]]", 6, "structure.fixed[0][0]", "-1 is too small"},
    {5, "  spacing: 0.1\n  fixed: [[0.5, 0]]", 6, "structure.fixed[0][0]", "0.5 is no whole number"},
    {5, "  spacing: 0.1\n  fixed:\n    - [3, 4]\n    - [0, 0]\n    - [3, 4]", 9, "structure.fixed[2]",
     "[3, 4] is given twice, first in line 7, allowed: once"},
    {5, "  spacing: 0.1\n  bracing: cross", 6, "structure.bracing", "allowed: none, web, full"},
    {5, "  spacing: 0.1\n  support: table", 6, "structure.support", "allowed: base, frame, target"},
    {5, "  spacing: 0.1\n  layout: offset\n  joints: universal", 7, "structure.joints",
     "universal joints have their axes along posts, allowed with layout offset: ball"},
    {5, "  spacing: 0.1\n  layout: offset\n  bracing: web", 7, "structure.bracing",
     "web braces panels between posts, allowed with layout offset (braced by itself): none"},
    {4, "  nodes: [2, 5]\n  layout: offset", 4, "structure.nodes", "without a cell, allowed: at least 3"},
    /* links */
    {7, "    radius: -1", 7, "structure.link.radius", "-1 is negative"},
    {7, "    radius: 0.03", 7, "structure.link.radius", "links of radius 0.03 touch"},
    {7, "    rate: 0", 7, "structure.link.rate", "too small"},
    {7, "    acceleration: fast", 7, "structure.link.acceleration", "fast is no number"},
    {7, "    jerk: -2", 7, "structure.link.jerk",
     "-2 is negative, allowed: a number above 0 and at most 1e+09 m/s3"},
    {7, "    stiffness: 1e10", 7, "structure.link.stiffness", "1e10 is too large"},
    {7, "    damping: -0.5", 7, "structure.link.damping",
     "-0.5 is negative, allowed: a number of at least 0"},
    {7, "    length: 0.1", 7, "structure.link.length", "0.1, allowed: a pair [shortest, longest]"},
    {7, "    length: [0.08]", 7, "structure.link.length", "a list of 1, allowed: a list of 2"},
    {7, "    length: [0.13, 0.08]", 7, "structure.link.length", "[0.13, 0.08] is inverted"},
    {7, "    length: [0.09, 0.09]", 7, "structure.link.length",
     "[0.09, 0.09] leaves out the start length 0.1"},
    {7, "    length: [-0.1, 0.2]", 7, "structure.link.length[0]", "-0.1 is negative"},
    {7, "    length: [0.11, 0.2]", 7, "structure.link.length", "leaves out the start length 0.1"},
    {7, "    length: [0.05, 0.09]", 7, "structure.link.length", "[0.05, 0.09] leaves out the start length"},
    {7, "    length:\n      bottom: [0.08, 0.13]\n      top: [0.12, 0.13]", 9, "structure.link.length.top",
     "leaves out the start length"},
    {7, "    length: {brace: [1.1, 1.2]}", 7, "structure.link.length.brace", "leaves out the start length 1"},
    {7, "    length: {brace: [0.075, 0.135]}", 7, "structure.link.length.brace", "times the start length"},
    {7, "    length: {bottom: [0.13, 0.08]}", 7, "structure.link.length.bottom", "inverted"},
    {7, "    length: {side: [0.08, 0.13]}", 7, "structure.link.length.side",
     "unknown key, allowed: bottom, top, brace"},
    {7, "    force: [10, 50]", 7, "structure.link.force", "leaves out 0"},
    {7, "    force: [50, -50]", 7, "structure.link.force", "inverted"},
    {7, "    stuck: 3", 7, "structure.link.stuck", "3, allowed: a list of link numbers"},
    {7, "    stuck: [0, 62]", 7, "structure.link.stuck[1]",
     "62 is too large, allowed: a whole number from 0 to 61"},
    {7, "    stuck: [4, 5,\n      4]", 8, "structure.link.stuck[2]", "4 is given twice, first in line 7"},
    {7, "    stuck: [1.5]", 7, "structure.link.stuck[0]", "1.5 is no whole number"},
    {7, "    stuck: [93]\n  bracing: web", 7, "structure.link.stuck[0]", "a whole number from 0 to 92"},
    {7, "    stuck: [-1]", 7, "structure.link.stuck[0]", "-1 is too small"},
    /* angles */
    {9, "    link_post: [55, 180.5]", 9, "structure.angle.link_post[1]",
     "180.5 is too large, allowed: a number above 0 and below 180 degrees"},
    {9, "    link_post: [0, 125]", 9, "structure.angle.link_post[0]",
     "0 is too small, allowed: a number above 0 and below 180 degrees"},
    {9, "    link_post: [55, 180]", 9, "structure.angle.link_post[1]",
     "180 is too large, allowed: a number above 0 and below 180 degrees"},
    {9, "    link_link: [0, 130]", 9, "structure.angle.link_link[0]", "0 is too small"},
    {9, "    link_post: [90, 90]", 9, "structure.angle.link_post",
     "[90, 90] is empty, allowed: the larger must be above the smaller"},
    {9, "    link_post: [-5, 125]", 9, "structure.angle.link_post[0]", "-5 is negative"},
    {9, "    link_post: [125, 55]", 9, "structure.angle.link_post", "inverted"},
    {9, "    link_post: [95, 125]", 9, "structure.angle.link_post", "[95, 125] leaves out 90"},
    {9, "    link_post: [20, 85]", 9, "structure.angle.link_post", "leaves out 90"},
    {9, "    link_link: [91, 100]", 9, "structure.angle.link_link", "leaves out 90"},
    {9, "    link_link: 50", 9, "structure.angle.link_link", "50, allowed: a list of 2, each a number"},
    /* springs at them */
    {9, "    stiffness: -1", 9, "structure.angle.stiffness",
     "-1 is negative, allowed: a number of at least 0 and at most 1e+09 N m"},
    {9, "    stiffness: .nan", 9, "structure.angle.stiffness", "allowed: a number"},
    {9, "    stiffness: soft", 9, "structure.angle.stiffness", "soft is no number"},
    {9, "    soft: -5", 9, "structure.angle.soft", "-5 is negative"},
    {9, "    soft: 90.5", 9, "structure.angle.soft", "90.5 is too large, allowed"},
    {9, "    soft: .nan", 9, "structure.angle.soft", "allowed: a number"},
    {9, "    soft: \"5\"", 9, "structure.angle.soft", "text in quotes"},
    {9, "    square: -0.1", 9, "structure.angle.square", "-0.1 is negative"},
    {9, "    square: .nan", 9, "structure.angle.square", "allowed: a number"},
    {9, "    square: .inf", 9, "structure.angle.square", "allowed: a number"},
    {9, "    square: [1]", 9, "structure.angle.square", "a list of 1 is no number"},
    {9, "    brace: [1, 2]", 9, "structure.angle.brace", "did you mean structure.link.length.brace?"},
    /* target */
    {11, "  shape: cube", 11, "target.shape", "cube is not known, allowed: box, sphere"},
    {11, "  shape: shpere", 11, "target.shape", "did you mean sphere?"},
    {11, "  scale: 1", 10, "target.shape", "is missing, allowed: box, sphere"},
    {12, "  scale: 1", 10, "target.size", "is missing, allowed for box: size"},
    {12, "  size: [0.1, 0.1]", 12, "target.size", "a list of 2, allowed: a list of 3"},
    {12, "  size: 0.1", 12, "target.size", "allowed: a list of 3, each a number above 0"},
    {12, "  size: [0.1, -0.1, 0.1]", 12, "target.size[1]", "-0.1 is negative"},
    {12, "  size: [0.1, 0.1, 0]", 12, "target.size[2]", "0 is too small"},
    {12, "  size:\n    - 0.1\n    - nan\n    - 0.1", 14, "target.size[1]", "nan is not finite"},
    {12, "  size: [150, 150, 100]", 11, "target.shape", "the shape is 150 m large, allowed: at most 20 m"},
    {12, "  size: [1, 1, 1]\n  radius: 2", 13, "target.radius",
     "is a key of sphere, cylinder, cone, torus, capsule, not of this shape, allowed for box: size"},
    {12, "  size: [1, 1, 1]\n  file: a.obj", 13, "target.file",
     "is a key of mesh, heightmap, not of this shape"},
    {12, "  size: [1, 1, 1]\n  scale: 0", 13, "target.scale", "0 is too small"},
    {12, "  size: [1, 1, 1]\n  scale: 1\n  fit: [1, 1, 1]", 14, "target.fit",
     "stands beside scale (line 13)"},
    {12, "  size: [1, 1, 1]\n  fit: [1, 1, -1]", 13, "target.fit[2]", "-1 is negative"},
    {12, "  size: [1, 1, 1]\n  rotate: [0, 0, 400]", 13, "target.rotate[2]", "400 is too large"},
    {12, "  size: [1, 1, 1]\n  rotate: 90", 13, "target.rotate", "allowed: a list of 3"},
    {12, "  size: [1, 1, 1]\n  at: [0, 0, inf]", 13, "target.at[2]", "inf is not finite"},
    {12, "  size: [1, 1, 1]\n  at: [0, 0, -1]", 13, "target.at", "below the base"},
    {12, "  size: [1, 1, 1]\n  deformable: 5", 13, "target.deformable", "5 is no mapping"},
    {12, "  size: [1, 1, 1]\n  deformable: {young: -1, density: 300}", 13, "target.deformable.young",
     "-1 is negative, allowed: a number above 0 and at most 1e+15 Pa"},
    {12, "  size: [1, 1, 1]\n  deformable: {young: 1, density: 0}", 13, "target.deformable.density",
     "0 is too small"},
    {12, "  size: [1, 1, 1]\n  deformable:\n    young: 1", 13, "target.deformable.density",
     "is missing, allowed: a number above 0"},
    {12, "  size: [1, 1, 1]\n  deformable: {young: 1, density: .nan}", 13, "target.deformable.density",
     "not finite"},
    /* base, motion */
    {13, "base: floor", 13, "base", "floor is no number"},
    {13, "base: nan", 13, "base", "nan is not finite"},
    {13, "base: [0]", 13, "base", "a list of 1 is no number"},
    {15, "  drag: -1", 15, "motion.drag", "-1 is negative"},
    {15, "  mode: fall", 15, "motion.mode", "fall is not known, allowed: drop, rise"},
    {15, "  height: -0.1", 15, "motion.height", "-0.1 is negative"},
    {15, "  height: 0.001", 15, "motion.height",
     "start inside the target, allowed: at least their radius 0.004"},
    {15, "  gravity: -9.81", 15, "motion.gravity", "-9.81 is negative"},
    {15, "  friction: .Inf", 15, "motion.friction", ".Inf is not finite"},
    {15, "  time: 0", 15, "motion.time", "0 is too small"},
    {15, "  time: 1e5", 15, "motion.time", "too large"},
    {15, "  touch: {node: [1, 1]}", 15, "motion.touch", "a mapping, allowed: a list of mappings"},
    {15, "  touch: [5]", 15, "motion.touch[0]", "5, allowed: a mapping of node"},
    {15, "  touch:\n    - {node: [4, 0], layer: top, force: [0, 0, 1], from: 0, to: 1}", 16,
     "motion.touch[0].node[0]", "4 is too large, allowed: a whole number from 0 to 3"},
    {15, "  touch:\n    - {node: [1, 0], layer: topp, force: [0, 0, 1], from: 0, to: 1}", 16,
     "motion.touch[0].layer", "did you mean top?"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, 1], from: 1, to: 1}", 16,
     "motion.touch[0].to", "1 is not after from"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, 1], from: 2, to: 1.5}", 16,
     "motion.touch[0].to", "1.5 is not after from, allowed: more than 2 s"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, 1], from: -1, to: 1}", 16,
     "motion.touch[0].from", "-1 is negative"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, nan], from: 0, to: 1}", 16,
     "motion.touch[0].force[2]", "nan is not finite"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 1], from: 0, to: 1}", 16,
     "motion.touch[0].force", "a list of 2, allowed: a list of 3"},
    {15, "  touch:\n    - {node: [1, 0], force: [0, 0, 1], from: 0, to: 1}", 16, "motion.touch[0].layer",
     "is missing, allowed: bottom, top"},
    {15,
     "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, 1], from: 0, to: 1}\n"
     "    - {layer: top, force: [0, 0, 1], from: 0, to: 1}",
     17, "motion.touch[1].node", "is missing"},
    {15, "  mode: rise\n  height: 0", 16, "motion.height", "0 lets the target rise by nothing"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, from: 0, to: 1}", 16, "motion.touch[0].force",
     "is missing"},
    {15, "  touch:\n    - {node: [1, 0], layer: top, force: [0, 0, 1], from: 0, to: 1, forse: 1}", 16,
     "motion.touch[0].forse", "did you mean force?"},
    /* the rest */
    {16, "attractors: some", 16, "attractors", "some is not known, allowed: auto, none"},
    {16, "attractors:\n  - {at: [0, 0], strength: 1}", 17, "attractors[0].at",
     "a list of 2, allowed: a list of 3"},
    {16, "attractors:\n  - {at: [0, 0, 0], strength: -1}", 17, "attractors[0].strength", "-1 is negative"},
    {16, "attractors:\n  - {at: [0, 0, 0], strength: inf}", 17, "attractors[0].strength", "not finite"},
    {16, "attractors:\n  - {at: [0, 0, 0], strength: 1}\n  - {strength: 1}", 18, "attractors[1].at",
     "is missing, allowed: a list of 3 numbers"},
    {16, "attractors:\n  - {at: [0, 0, 0], strength: 1, power: 2}", 17, "attractors[0].power",
     "unknown key, allowed: at, strength"},
    {16, "attractors: {at: [0, 0, 0], strength: 1}", 16, "attractors", "a mapping is not known"},
    {16, "attractors:\n  - {at: [0, 0, 0]}", 17, "attractors[0].strength", "is missing"},
    {17, "start: [1]", 17, "start", "a list of 1 is no text"},
    {18, "goal:\n  coverage: 1.1", 19, "goal.coverage", "1.1 is too large"},
    {18, "goal:\n  mean_gap: 0", 19, "goal.mean_gap", "0 is too small"},
    {18, "goal:\n  coverage: 0", 19, "goal.coverage", "0 is too small, allowed: a number above 0"},
    {18, "goal:\n  coverage: -0.5", 19, "goal.coverage", "-0.5 is negative"},
    {18, "goal:\n  max_gap: -1", 19, "goal.max_gap", "-1 is negative, allowed: a number above 0"},
    {18, "goal:\n  max_gap: inf", 19, "goal.max_gap", "inf is not finite"},
    {18, "goal:\n  mean_gap: [0.1]", 19, "goal.mean_gap", "a list of 1 is no number"},
    {18, "goal: {}", 18, "goal", "asks for nothing, allowed: at least one of mean_gap, max_gap, coverage"},
    {18, "goal:\n  gap: 0.1", 19, "goal.gap", "unknown key, allowed: mean_gap, max_gap, coverage"},
    {20, "  duration: soon", 20, "schedule.duration", "soon is no number"},
    {20, "  duration: 0", 20, "schedule.duration", "0 is too small"},
    {20, "  duration: 1.0005", 20, "schedule.duration",
     "no whole number of samples, allowed: a multiple of 0.001 s"},
    {20, "  duration: 200.001", 20, "schedule.duration",
     "200.001 s at a schedule.sample of 0.001 s is too many samples, allowed: at most 200000, so a duration "
     "of "
     "at most 200 s or a schedule.sample of at least 0.001000005 s"},
    {20, "  sample: 0", 20, "schedule.sample", "0 is too small"},
    {20, "  samples: 1", 20, "schedule.samples", "did you mean sample?"},
    /* understood, but of a later version */
    {7, "    force: [-50, 50]", 7, "structure.link.force", "not available yet: structure.link.force: "},
    {17, "start: no_such.plan", 17, "start", "no_such.plan is not there, allowed: flat, a plan folder"},
};

/* Each case has its one fault and no other. */
static void test_cases(void **state) {
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const bad_case *c = &cases[k];
        char text[2048];
        compose(c->replaced, c->by, text, sizeof text);
        parse_bad(text, strlen(text));
        expect(c->line, c->key, c->phrase);
        if (faults.count != 1) {
            for (int j = 0; j < faults.count; j++)
                print_message("  %s\n", faults.text[j]);
            fail_msg("%d faults for \"%s\"", faults.count, c->by);
        }
    }
    print_message("%zu bad scenes\n", sizeof cases / sizeof *cases);
}

/* Nodes of the smaller layer of an offset grid; a layout that is not known bounds them by the larger. */
static void test_layer_nodes(void **state) {
    (void)state;
    static const struct {
        const char *layout, *touch;
        const char *phrase; /* NULL: good */
    } cases[] = {
        {"posts", "node: [3, 4], layer: bottom", NULL},
        {"offset", "node: [3, 4], layer: top", NULL},
        {"offset", "node: [2, 3], layer: bottom", NULL},
        {"offset", "node: [3, 3], layer: bottom", "[0]: 3 is too large, allowed: a whole number from 0 to 2"},
        {"offset", "node: [2, 4], layer: bottom", "[1]: 4 is too large, allowed: a whole number from 0 to 3"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[600];
        snprintf(text, sizeof text,
                 "morphplan: 1\nstructure: {nodes: [4, 5], spacing: 0.1, layout: %s}\n"
                 "target: {shape: box, size: [0.1, 0.1, 0.1]}\n"
                 "motion:\n  touch:\n    - {%s, force: [0, 0, 1], from: 0, to: 1}\n",
                 cases[k].layout, cases[k].touch);
        morph_scene *scene;
        faults.count = 0;
        const morph_status status =
            morph_scene_parse("s.yaml", text, strlen(text), keep, ignore, &faults, &scene);
        assert_int_equal(status, cases[k].phrase ? MORPH_ERR_INPUT : MORPH_OK);
        assert_int_equal(faults.count, cases[k].phrase ? 1 : 0);
        if (cases[k].phrase) assert_non_null(strstr(faults.text[0], cases[k].phrase));
        morph_scene_destroy(scene);
    }
}

/* The unchanged scene is good: the cases fail for their own line only. */
static void test_control(void **state) {
    (void)state;
    char text[2048];
    compose(0, "", text, sizeof text);
    morph_scene *scene;
    faults.count = 0;
    assert_int_equal(morph_scene_parse("s.yaml", text, strlen(text), keep, ignore, &faults, &scene),
                     MORPH_OK);
    assert_int_equal(faults.count, 0);
    morph_scene_destroy(scene);
}

/* All faults come at once, ordered by line, those of the target's file too. */
static void test_all_at_once(void **state) {
    (void)state;
    static const char text[] =
        "morphplan: 3\n"
        "structure:\n"
        "  nodes: [1, 4]\n"
        "  spacing: x\n"
        "  link: {radius: -1, jerk: nan}\n"
        "target:\n"
        "  shape: mesh\n"
        "  file: no_such_file.obj\n"
        "  fit: [1, 1, 1]\n"
        "motion: {mode: rise, drag: -1}\n"
        "schedule:\n"
        "  sample: -1\n"
        "extra: 1\n";
    parse_bad(text, strlen(text));
    assert_int_equal(faults.count, 9);
    expect(1, "morphplan", "3");
    expect(3, "structure.nodes[0]", "1");
    expect(4, "structure.spacing", "x");
    expect(5, "structure.link.radius", "-1");
    expect(5, "structure.link.jerk", "nan");
    expect(8, "target.file", "");
    expect(10, "motion.drag", "-1");
    expect(12, "schedule.sample", "-1");
    expect(13, "extra", "unknown key");
    int last = 0;
    for (int k = 0; k < faults.count; k++) {
        const int line = (int)strtol(faults.text[k] + strlen("s.yaml:"), NULL, 10);
        assert_true(line >= last);
        last = line;
    }
    /* Sinks may be absent. */
    morph_scene *scene;
    assert_int_equal(morph_scene_parse("s.yaml", text, strlen(text), NULL, NULL, NULL, &scene),
                     MORPH_ERR_INPUT);
}

/* Sections that are no mapping or empty; required ones missing altogether. */
static void test_sections(void **state) {
    (void)state;
    static const char wrong[] =
        "morphplan: 1\nstructure: 5\ntarget: box\nmotion: [drop]\ngoal: 1\nschedule: auto\n";
    parse_bad(wrong, strlen(wrong));
    expect(2, "structure", "5 is no mapping, allowed: the keys layout, nodes, spacing");
    expect(3, "target", "box is no mapping, allowed: the keys shape, size");
    expect(4, "motion", "a list of 1 is no mapping, allowed: the keys mode");
    expect(5, "goal", "1 is no mapping");
    expect(6, "schedule", "auto is no mapping, allowed: the keys duration, sample");
    assert_int_equal(faults.count, 5);

    static const char inner[] =
        "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1,\n  link: [1],\n  angle: 90}\n"
        "target: {shape: box, size: [1, 1, 1],\n  deformable: soft}\n";
    parse_bad(inner, strlen(inner));
    expect(3, "structure.link", "a list of 1 is no mapping, allowed: the keys length");
    expect(4, "structure.angle",
           "90 is no mapping, allowed: the keys link_post, link_link, stiffness, soft, square");
    expect(6, "target.deformable", "soft is no mapping, allowed: the keys young, density");
    assert_int_equal(faults.count, 3);

    static const char empty[] = "title: none\nstructure:\ntarget:\n";
    parse_bad(empty, strlen(empty));
    expect(1, "morphplan", "is missing");
    expect(2, "structure.nodes", "is missing");
    expect(2, "structure.spacing", "is missing");
    expect(3, "target", "is missing, allowed: a mapping with a shape and its keys");
    assert_int_equal(faults.count, 4);

    parse_bad("{}", 2);
    expect(1, "morphplan", "is missing");
    expect(1, "structure.nodes", "is missing");
    expect(1, "structure.spacing", "is missing");
    expect(1, "target", "is missing");
    assert_int_equal(faults.count, 4);
}

/* Relations between a shape's own sizes, and each shape's required keys. */
static void test_shapes(void **state) {
    (void)state;
    static const struct {
        const char *target, *key, *phrase;
    } bad[] = {
        {"shape: torus, radius: 0.1, tube: 0.1", "target.tube",
         "0.1 closes the hole, allowed: less than the radius"},
        {"shape: torus, radius: 0.1", "target.tube", "is missing, allowed for torus: radius, tube"},
        {"shape: capsule, radius: 0.1, height: 0.2", "target.height", "more than twice the radius (0.2)"},
        {"shape: capsule, height: 0.2", "target.radius", "is missing"},
        {"shape: sphere", "target.radius", "is missing"},
        {"shape: sphere, radius: 0.1, radii: [1, 1, 1]", "target.radii", "is a key of ellipsoid, not"},
        {"shape: ellipsoid, radii: [0.1, 0.1]", "target.radii", "a list of 2, allowed: a list of 3"},
        {"shape: cylinder, radius: 0.1", "target.height", "is missing"},
        {"shape: cone, height: 0.1, radius: -0.1", "target.radius", "-0.1 is negative"},
        {"shape: cone, height: 0.1, radius: 0.1, scale: 1000", "target.shape", "200 m large"},
        {"shape: mesh", "target.file", "is missing, allowed for mesh: file"},
        {"shape: mesh, file: []", "target.file", "a list of 0 is no text"},
        {"shape: mesh, file: no_such.obj", "target.file", ""},
        {"shape: mesh, file: a.obj, cell: 1", "target.cell", "is a key of heightmap, not"},
        {"shape: heightmap, file: a.csv, cell: 0", "target.cell", "0 is too small"},
        {"shape: heightmap, file: no_such.csv", "target.file", ""},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char text[400];
        snprintf(text, sizeof text, "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1}\ntarget: {%s}\n",
                 bad[k].target);
        parse_bad(text, strlen(text));
        expect(3, bad[k].key, bad[k].phrase);
        assert_int_equal(faults.count, 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_control),  cmocka_unit_test(test_cases),  cmocka_unit_test(test_layer_nodes),
        cmocka_unit_test(test_sections), cmocka_unit_test(test_shapes), cmocka_unit_test(test_all_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
