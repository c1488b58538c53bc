#!/bin/sh
# All memory traffic of a frame: `scripts/whole-frame.sh SCENES` writes results/whole-frame{,-orders,-bytes}.csv: Crytek Sponza, the black
# forest and jungle as the DK2 shows them, with shadow cascades, four frames of a head's path, on three machines.
set -eu
. "$(dirname "$0")/captures.sh"
for scene in "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf" jungle; do
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    "$bin/tracegen" raster "$scene" --hmd dk2 --shadows --path head --frames 4 --geometry --no-plain --quiet -o "$name.textrace"
    "$bin/replay" info "$name.textrace" --json >"$name.json"
    for machine in tile-based tile-based-g-buffer immediate; do
        for order in morton z2-sta; do
            "$bin/replay" run "$name.textrace" --mode functional --order $order --frame $machine --json 2>/dev/null >"$name,$machine,$order.json"
        done
    done
    # Textures that are not compressed, as the literature's shares are from.
    for order in morton z2-sta; do
        "$bin/replay" run "$name.textrace" --mode functional --order $order --frame tile-based --texel-format rgba8 --json 2>/dev/null >"$name,tile-based rgba8,$order.json"
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

SCENES = ["crytek-sponza", "stk-black-forest", "jungle"]
MACHINES = ["tile-based", "tile-based rgba8", "tile-based-g-buffer", "immediate"]
CLIENTS = ["texture", "index", "vertex", "shaded-vertex", "primitive-list", "colour", "depth", "g-buffer", "composition"]
FRAMES, HERTZ = 4, 90
COMMAND = "# command: scripts/whole-frame.sh SCENES  (tracegen raster SCENE --hmd dk2 --shadows --path head --frames 4 --geometry, replay run TRACE --mode functional --order ORDER --frame MACHINE)\n"


def clients(scene, machine, order):
    return json.load(open(f"{scene},{machine},{order}.json"))["result"]["clients"]


def traffic(scene, machine, order):
    return {c["client"]: c["read_bytes"] + c["write_bytes"] for c in clients(scene, machine, order)}


def milliwatts(scene, machine, order):
    return sum(c["energy_mj"] for c in clients(scene, machine, order)) / FRAMES * HERTZ


def save(name, head, rows):
    with open(f"{sys.argv[1]}/{name}.csv", "w", newline="") as file:
        file.write(COMMAND)
        table = csv.writer(file, lineterminator="\n")
        table.writerow(head)
        table.writerows(rows)


shares, orders, sizes = [], [], []
for scene in SCENES:
    chunks = {c["tag"]: c["length_bytes"] for c in json.load(open(f"{scene}.json"))["chunks"]}
    geometry = [chunks["GEOM"], chunks["PLST"] + chunks["PLIX"]]
    sizes.append([scene] + [f"{bytes / 1e6:.2f}" for bytes in (chunks["TILE"], *geometry)])
    for machine in MACHINES:
        morton, sta = (traffic(scene, machine, order) for order in ("morton", "z2-sta"))
        total, total_sta = sum(morton.values()), sum(sta.values())
        shares.append([scene, machine] + [f"{morton.get(c, 0) / FRAMES / 1e6:.2f}" for c in CLIENTS]
                      + [f"{total / FRAMES / 1e6:.2f}", f"{100 * morton['texture'] / total:.1f}"])
        saved = lambda own, base: f"{100 * (1 - own / base):.1f}"
        orders.append([scene, machine, saved(sta["texture"], morton["texture"]),
                       saved(sta["shaded-vertex"], morton["shaded-vertex"]) if "shaded-vertex" in morton else "-",
                       saved(total_sta, total), f"{total / FRAMES * HERTZ / 1e9:.2f}", f"{total_sta / FRAMES * HERTZ / 1e9:.2f}",
                       *(f"{milliwatts(scene, machine, order):.0f}" for order in ("morton", "z2-sta"))])
save("whole-frame-bytes", ["scene", "texture samples, MB", "meshes, MB", "primitive lists of 4 frames, MB"], sizes)
save("whole-frame", ["scene", "machine"] + CLIENTS + ["all, MB per frame", "texture % of all"], shares)
save("whole-frame-orders", ["scene", "machine", "texture saved %", "shaded vertices saved %", "all saved %", "Morton GB/s at 90 Hz", "Z2 STA GB/s at 90 Hz",
                            "Morton mW at 90 Hz", "Z2 STA mW at 90 Hz"], orders)
PYTHON
