#!/bin/sh
# Writes the targets of this folder that are meshes: sh make.sh [FOLDER] (default: where this script stands). Any POSIX awk
# gives the same bytes: coordinates in metres to the micrometre, closed, faces counter-clockwise seen from outside.
set -eu
folder=${1:-$(dirname "$0")}

# Shared by all: vertices, faces, a turned profile, an extruded outline, a stack of equal rings.
common='
function near0(x) { return x < 5e-7 && x > -5e-7 ? 0 : x }
function vertex(x, y, z) {
    printf "v %.6f %.6f %.6f\n", near0(x), near0(y), near0(z)
    return ++vertices
}
function triangle(a, b, c) { printf "f %d %d %d\n", a, b, c }
function quad(a, b, c, d) { triangle(a, b, c); triangle(a, c, d) }

# Turns the points (pr[k], pz[k]), k = 1..n, about the z axis. The first and the last lie on it; the way from first to last
# has the inside on its left seen with r to the right and z up (it starts below and ends above).
function turned(n, around,   k, i, a, b, ring, last) {
    for (k = 1; k <= n; k++) {
        ring[k] = vertices + 1
        if (pr[k] == 0) { vertex(0, 0, pz[k]); continue }
        for (i = 0; i < around; i++)
            vertex(pr[k] * cos(2 * pi * i / around), pr[k] * sin(2 * pi * i / around), pz[k])
    }
    for (k = 1; k < n; k++)
        for (i = 0; i < around; i++) {
            a = i; b = (i + 1) % around
            if (pr[k] == 0) triangle(ring[k], ring[k + 1] + b, ring[k + 1] + a)
            else if (pr[k + 1] == 0) triangle(ring[k] + a, ring[k] + b, ring[k + 1])
            else quad(ring[k] + a, ring[k] + b, ring[k + 1] + b, ring[k + 1] + a)
        }
}

# Extrudes the outline (px[k], pz[k]), k = 1..n, counter-clockwise seen from -y, from y = -half to y = half.
function extruded(n, half,   k, next_k, line) {
    for (k = 1; k <= n; k++) vertex(px[k], -half, pz[k])
    for (k = 1; k <= n; k++) vertex(px[k], half, pz[k])
    for (k = 1; k <= n; k++) {
        next_k = k % n + 1
        quad(k, n + k, n + next_k, next_k)
    }
    line = "f"
    for (k = 1; k <= n; k++) line = line " " k
    print line
    line = "f"
    for (k = n; k >= 1; k--) line = line " " (n + k)
    print line
}

function point(r, z) { points++; pr[points] = r; pz[points] = z }
function corner(x, z) { points++; px[points] = x; pz[points] = z }
'

# For targets with a function height(x, y): the solid under it, n x n cells of width w, standing on z = 0.
relief='
function relief(n, w,   i, j, k, side) {
    for (j = 0; j <= n; j++)
        for (i = 0; i <= n; i++) vertex((i - n / 2) * w, (j - n / 2) * w, height((i - n / 2) * w, (j - n / 2) * w))
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            k = j * (n + 1) + i + 1
            quad(k, k + 1, k + n + 2, k + n + 1)
        }
    # The border, counter-clockwise seen from above, and the same on the ground.
    side = 0
    for (i = 0; i < n; i++) edge[++side] = i + 1
    for (j = 0; j < n; j++) edge[++side] = j * (n + 1) + n + 1
    for (i = n; i > 0; i--) edge[++side] = n * (n + 1) + i + 1
    for (j = n; j > 0; j--) edge[++side] = j * (n + 1) + 1
    for (k = 1; k <= side; k++) {
        i = (edge[k] - 1) % (n + 1)
        j = (edge[k] - 1 - i) / (n + 1)
        foot[k] = vertex((i - n / 2) * w, (j - n / 2) * w, 0)
    }
    middle = vertex(0, 0, 0)
    for (k = 1; k <= side; k++) {
        i = k % side + 1
        quad(edge[k], foot[k], foot[i], edge[i])
        triangle(middle, foot[i], foot[k])
    }
}
'

# make NAME COMMENT PROGRAM
make() {
    { echo "# $2; metres"; LC_ALL=C awk "$common $3 BEGIN { pi = atan2(0, -1); build() }" </dev/null; } >"$folder/$1.obj"
}

make hemisphere 'Upper half of a sphere, radius 0.22' '
function build(   k) {
    point(0, 0)
    for (k = 0; k <= 16; k++) point(k == 16 ? 0 : 0.22 * cos(pi / 2 * k / 16), 0.22 * sin(pi / 2 * k / 16))
    turned(points, 48)
}'

make saddle 'Saddle 0.40 wide: 0.13 + 2 (x^2 - y^2)' "$relief"'
function height(x, y) { return 0.13 + 2 * (x * x - y * y) }
function build() { relief(20, 0.02) }'

make two_bumps 'Two bumps 0.14 and 0.10 high, 0.24 apart' "$relief"'
function bump(x, y, h) { return h * exp(-(x * x + y * y) / (2 * 0.065 * 0.065)) }
function height(x, y) { return 0.02 + bump(x + 0.12, y, 0.14) + bump(x - 0.12, y, 0.10) }
function build() { relief(24, 0.02) }'

make dish 'Round dish: rim of radius 0.22 at 0.12, a bowl 0.07 deep' '
function build(   k, a, bowl, w) {
    # The bowl is a cap of a sphere: radius (a^2 + d^2) / 2d with a = 0.19, d = 0.07.
    a = 0.19; bowl = (a * a + 0.07 * 0.07) / 0.14; w = atan2(a, bowl - 0.07)
    point(0, 0); point(0.22, 0); point(0.22, 0.12)
    for (k = 0; k <= 10; k++) point(k == 10 ? 0 : bowl * sin(w * (1 - k / 10)), 0.05 + bowl * (1 - cos(w * (1 - k / 10))))
    turned(points, 48)
}'

make dish_bore 'Round dish: rim of radius 0.22 at 0.17, a bore of radius 0.10 and 0.13 deep' '
function build() {
    point(0, 0); point(0.22, 0); point(0.22, 0.17); point(0.10, 0.17); point(0.09, 0.04); point(0, 0.04)
    turned(points, 48)
}'

make step 'Two levels, 0.09 and 0.18, on 0.40 x 0.36' '
function build() {
    corner(-0.20, 0); corner(0.20, 0); corner(0.20, 0.09); corner(0, 0.09); corner(0, 0.18); corner(-0.20, 0.18)
    extruded(points, 0.18)
}'

make ridge 'Ridge that leans over: foot 0.16 wide, crest 0.20 high and 0.08 beyond the foot, 0.36 long' '
function build() {
    corner(-0.12, 0); corner(0.04, 0); corner(0.12, 0.17); corner(0.09, 0.20); corner(0, 0.20)
    extruded(points, 0.18)
}'

make twisted_prism 'Square prism, 0.28 wide and 0.20 high, twisted by 45 degrees' '
function build(   k, i, w, levels) {
    levels = 12
    for (k = 0; k <= levels; k++)
        for (i = 0; i < 4; i++) {
            w = pi / 4 * (2 * i + 1 + k / levels)
            vertex(0.28 / sqrt(2) * cos(w), 0.28 / sqrt(2) * sin(w), 0.20 * k / levels)
        }
    quad(4, 3, 2, 1)
    for (k = 0; k < levels; k++)
        for (i = 0; i < 4; i++)
            quad(4 * k + i + 1, 4 * k + (i + 1) % 4 + 1, 4 * k + (i + 1) % 4 + 5, 4 * k + i + 5)
    quad(4 * levels + 1, 4 * levels + 2, 4 * levels + 3, 4 * levels + 4)
}'
