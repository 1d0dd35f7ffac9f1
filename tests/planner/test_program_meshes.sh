#!/bin/sh
# Files that are no target: exit 2, one line that names scene, line and key, within a second, nothing written.
. "$(dirname "$0")/program.sh"
mkdir "$work/here" && cd "$work/here" || exit 1

# The fastest of three runs counts: others may keep the machine busy.
refused() {
    mesh=$1
    printf 'morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1}\ntarget: {shape: mesh, file: %s, fit: [0.2, 0.2, 0.1]}\n' \
        "$mesh" >scene.yaml
    fastest=1000000
    for try in 1 2 3; do
        start=$(date +%s%N)
        expect 2 "$program" plan scene.yaml -o out.plan
        took=$((($(date +%s%N) - start) / 1000000))
        if [ "$took" -lt "$fastest" ]; then fastest=$took; fi
        if [ "$fastest" -lt 1000 ]; then break; fi
    done
    one_line
    says '^scene.yaml:3: target.file: '
    says "$2"
    absent . out.plan
    if [ -z "$slow" ] && [ "$fastest" -ge 1000 ]; then fault "$mesh: refused after $fastest ms"; fi
    echo "$mesh: refused in $fastest ms: $(cat "$work/err")"
}

: >empty.obj
refused empty.obj 'is empty'
: >empty.stl
refused empty.stl 'is empty'
printf 'Dear reader,\nthis is a letter, not a mesh.\n' >letter.obj
refused letter.obj 'no mesh'
cp letter.obj letter.stl
refused letter.stl 'STL'

# Binary STL: 80 bytes, the number of triangles (little endian), 50 bytes for each.
{ head -c 80 /dev/zero && printf '\350\003\000\000' && head -c 500 /dev/zero; } >truncated.stl
refused truncated.stl 'claims 1000 triangles'
{ head -c 80 /dev/zero && printf '\000\312\232\073' && head -c 100 /dev/zero; } >boastful.stl
refused boastful.stl 'claims 1000000000 triangles'
printf 'OFF\n1000000000 1000000000 0\n0 0 0\n' >boastful.off
refused boastful.off 'claims 1000000000 vertices'
printf 'ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\nproperty float z
element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n' >boastful.ply
refused boastful.ply 'claims'
refused missing.obj 'does not exist'

# Two tetrahedra joined along an edge: more than two faces meet there.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 0 0 -1
f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nf 1 5 2\nf 1 2 6\nf 2 5 6\nf 1 6 5\n' >edge.obj
refused edge.obj 'more than two faces'
if [ -r "$source/../shared/models/joined_tetrahedra.obj" ]; then
    cp "$source/../shared/models/joined_tetrahedra.obj" .
    refused joined_tetrahedra.obj 'more than two faces'
else
    echo "joined_tetrahedra.obj is not there: its case is left out"
fi
