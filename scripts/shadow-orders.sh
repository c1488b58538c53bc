#!/bin/sh
# What Z2 STA saves on shadow maps and on other textures: `scripts/shadow-orders.sh SCENES` writes results/shadow-orders.csv, with four cascades and
# as the DK2 shows the scenes.
set -eu
. "$(dirname "$0")/captures.sh"
for scene in "$scenes/crytek-sponza/sponza.gltf" "$scenes/dabrovic-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf" jungle; do
    [ "$scene" = jungle ] || present "${scene#"$scenes/"}" || continue
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    "$bin/tracegen" raster "$scene" --hmd dk2 --shadows --no-plain --quiet -o "$name.textrace"
    for order in morton z2-sta; do
        "$bin/replay" run "$name.textrace" --order $order --json 2>/dev/null >"$name,$order.json"
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, os, sys

rows = []
for scene in ("crytek-sponza", "dabrovic-sponza", "stk-black-forest", "jungle"):
    if not os.path.exists(f"{scene},morton.json"):
        continue
    parts = []
    for order in ("morton", "z2-sta"):
        found = json.load(open(f"{scene},{order}.json"))["result"]["by_texture"]
        of = lambda wanted: sum(part["l2"]["line_misses"] for part in found if (part["name"] == "shadow cascades") == wanted) * 16
        parts.append((of(True), of(False)))
    (maps, others), (maps_sta, others_sta) = parts
    assert maps > 0, scene
    saved = lambda own, base: f"{100 * (1 - own / base):.1f}"
    rows.append([scene, f"{(maps + others) / 1e6:.3f}", f"{100 * maps / (maps + others):.1f}", saved(maps_sta, maps), saved(others_sta, others),
                 saved(maps_sta + others_sta, maps + others)])
with open(sys.argv[1] + "/shadow-orders.csv", "w", newline="") as file:
    file.write("# command: scripts/shadow-orders.sh SCENES  (tracegen raster SCENE --hmd dk2 --shadows --no-plain, replay run TRACE --order ORDER --json: by_texture)\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(["scene", "Morton: MB per frame", "shadow maps, % of it", "Z2 STA saves on shadow maps, %", "on other textures, %", "on both, %"])
    table.writerows(rows)
PYTHON
