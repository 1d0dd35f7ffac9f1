#!/bin/sh
# The suite of hard targets: its meshes are made again byte for byte, are closed and looked at from outside, and the reach
# check says of each what the suite's table says.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: what it runs has tests of its own there"
    exit 77
fi
suite=$source/examples/suite

mkdir "$work/made"
expect 0 sh "$suite/make.sh" "$work/made"
count=0
for mesh in "$work"/made/*.obj; do
    count=$((count + 1))
    holds "$(basename "$mesh") is made again as it stands" cmp -s "$mesh" "$suite/$(basename "$mesh")"
done
holds "every mesh of the suite is made, not $count" [ "$count" -eq "$(ls "$suite"/*.obj | wc -l)" ]
# Another awk, where there is one, makes the same.
for other in gawk busybox original-awk; do
    command -v "$other" >/dev/null 2>&1 || continue
    mkdir -p "$work/bin" "$work/$other"
    if [ "$other" = busybox ]; then
        busybox awk 'BEGIN { exit 0 }' </dev/null >/dev/null 2>&1 || continue
        printf '#!/bin/sh\nexec busybox awk "$@"\n' >"$work/bin/awk"
        chmod +x "$work/bin/awk"
    else
        ln -sf "$(command -v "$other")" "$work/bin/awk"
    fi
    expect 0 env PATH="$work/bin:$PATH" sh "$suite/make.sh" "$work/$other"
    holds "$other makes the same meshes" diff -r "$work/made" "$work/$other"
done

# A mesh made wrong is seen.
sed 's/0\.200000/0.210000/' "$suite/ridge.obj" >"$work/made/ridge.obj"
if cmp -s "$work/made/ridge.obj" "$suite/ridge.obj"; then fault "a changed mesh is not told from the suite's"; fi

scenes=0
within=0
for file in "$suite"/*.yaml; do
    name=$(basename "$file" .yaml)
    scenes=$((scenes + 1))
    expect 0 "$program" info "$file"
    holds "$name is closed" grep -Eq '^target .*, closed, volume 0\.' "$work/out"
    holds "$name needs no mending" grep -Eq ' 0 faces turned, 0 boundary edges, 0 self-intersections, 1 parts$' "$work/out"
    holds "$name is 8 x 8" grep -q '^structure  8 x 8 nodes' "$work/out"
    said=$(sed -n 's/^ *\(within\|out of\) reach: .*$/\1/p' "$work/out")
    listed=$(sed -n "s/^| \`$name\` .* | \(within\|out of\) reach |.*\$/\1/p" "$suite/README.md")
    holds "$name: the table says \"$listed\", info \"$said\"" [ "$said" = "$listed" ]
    holds "$name has a verdict" [ -n "$said" ]
    if [ "$said" = within ]; then within=$((within + 1)); fi
done
holds "12 scenes at least, not $scenes" [ "$scenes" -ge 12 ]
holds "9 within reach at least, not $within" [ "$within" -ge 9 ]

# plan warns of what is out of reach, but not with --quiet, and writes it down.
cat >"$work/steep.yaml" <<'END'
morphplan: 1
structure: {nodes: [3, 3], spacing: 0.1, link: {stiffness: 20}}
target: {shape: box, size: [0.4, 0.1, 0.05]}
motion: {friction: 0.4, time: 0.2}
schedule: {sample: 0.01}
END
run "$program" plan "$work/steep.yaml" --method blanket -o "$work/steep.plan"
says '^out of reach: length: the way across the target is 0.4 m, the links of a line reach 0.27 m'
holds "summary.json has it" grep -q '"reach":' "$work/steep.plan/summary.json"
run "$program" plan "$work/steep.yaml" --method blanket --overwrite --quiet -o "$work/steep.plan"
if grep -q '^out of reach' "$work/err"; then fault "a warning in spite of --quiet"; fi
