#!/bin/sh
# Size and speed of the optional columns of ray traces: `scripts/ray-columns.sh SCENES` writes results/ray-columns.csv and
# results/ray-hierarchy.csv.
#   SIZE=WxH   pixels per eye (512x512)
set -eu
size=${SIZE:-512x512}
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf stk-black-forest/stk-black-forest.gltf
here=$(dirname "$results")
bench=$(cd "$here" && cargo bench --offline -p formats --bench ray_columns --no-run --message-format json 2>/dev/null |
    python3 -c 'import json, sys
for line in sys.stdin:
    message = json.loads(line)
    if message.get("executable") and message["target"]["name"] == "ray_columns":
        print(message["executable"])')
for scene in chess atrium "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf"; do
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    "$bin/tracegen" rays "$scene" --size "$size" --all-columns --quiet -o "$name.raytrace" 2>/dev/null
    "$bin/replay" validate "$name.raytrace" >&2
    "$bench" "$name.raytrace" >>measured.csv
done
python3 - "$results" "$size" <<'PYTHON'
import csv, sys

results, size = sys.argv[1:]
COMMAND = f"# command: scripts/ray-columns.sh SCENES  (tracegen rays SCENE --size {size} --all-columns, cargo bench -p formats --bench ray_columns -- TRACE)\n"
scenes = {}
with open("measured.csv", newline="") as file:
    for scene, column, *numbers in csv.reader(file):
        scenes.setdefault(scene, {})[column] = [float(number) for number in numbers]


def write(name, heading, rows):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write(COMMAND)
        csv.writer(file, lineterminator="\n").writerows([heading, *rows])


def speed(items, seconds):
    return f"{items / seconds / 1e6:.1f}"


rays_rows, tree_rows = [], []
for scene, columns in scenes.items():
    rays = columns["records"][0]
    total = [0.0] * 4
    named = f"{scene}, {rays:,.0f} rays"
    for column in ["records", "visits", "geometry"]:
        _, coded, uncoded, *seconds = columns[column]
        total = [a + b for a, b in zip(total, [coded, uncoded, *seconds])]
        rays_rows.append([named, column, f"{coded / rays:.2f}", f"{uncoded / rays:.2f}", *(speed(rays, s) for s in seconds)])
        named = ""
    coded, uncoded, *seconds = total
    tree = columns["nodes"][1] + columns["triangles"][1]
    bare = columns["nodes"][2] + columns["triangles"][2]
    rays_rows.append(["", "hierarchy", f"{tree / rays:.2f}", f"{bare / rays:.2f}", "-", "-"])
    rays_rows.append(["", "all", f"{(coded + tree) / rays:.2f}", f"{(uncoded + bare) / rays:.2f}", *(speed(rays, s) for s in seconds)])
    nodes, triangles = columns["nodes"], columns["triangles"]
    tree_rows.append([
        scene, f"{nodes[0]:,.0f}", f"{triangles[0]:,.0f}", f"{nodes[1] / nodes[0]:.1f}", f"{triangles[1] / triangles[0]:.1f}",
        f"{tree / 1e6:.2f}", f"{bare / 1e6:.2f}", *(speed(triangles[0], s) for s in nodes[3:]),
    ])
write("ray-columns", ["scene", "columns", "bytes per ray", "uncoded, bytes per ray", "write, Mray/s", "read, Mray/s"], rays_rows)
write("ray-hierarchy", ["scene", "nodes", "triangles", "bytes per node", "bytes per triangle", "MB", "uncoded, MB", "write, Mtriangle/s", "read, Mtriangle/s"], tree_rows)
PYTHON
