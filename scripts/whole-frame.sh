#!/bin/sh
# All memory traffic of a frame: `scripts/whole-frame.sh SCENES` writes results/whole-frame{,-orders,-bytes,-dram}.csv: Crytek Sponza, the black
# forest and jungle as the DK2 shows them, with shadow cascades, four frames of a head's path, on three machines.
set -eu
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf stk-black-forest/stk-black-forest.gltf
for scene in "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf" jungle; do
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    "$bin/tracegen" raster "$scene" --hmd dk2 --shadows --path head --frames 4 --geometry --no-plain --quiet --image "$name.png" -o "$name.textrace"
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
    # The same on a tile-based machine with DRAM, and what may change the answer.
    for variant in plain "level-3 all clients" "colour compressed" "tiles of 32" "tiles of 64"; do
        case $variant in
            plain) set -- ;;
            level-3*) printf 'l3 = {size_bytes = "2MiB", line_bytes = 64, clients = "all"}\n' >machine.toml; set -- --config machine.toml ;;
            colour*) set -- --picture "$name.png" ;;
            tiles*) set -- --tile-px "${variant#tiles of }" ;;
        esac
        for order in morton z2-sta; do
            "$bin/replay" run "$name.textrace" --mode functional --order $order --frame tile-based --dram lpddr4 "$@" --json 2>/dev/null >"$name,$variant,$order.json"
        done
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


VARIANTS = {"plain": "as above", "level-3 all clients": "an L3 of 2 MiB for all clients", "colour compressed": "colour compressed without loss",
            "tiles of 32": "tiles of 32x32 pixels", "tiles of 64": "tiles of 64x64 pixels"}
shares, orders, sizes, drams = [], [], [], []
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
    for variant, title in VARIANTS.items():
        found = [json.load(open(f"{scene},{variant},{order}.json")) for order in ("morton", "z2-sta")]
        totals = [sum(c["read_bytes"] + c["write_bytes"] for c in of["result"]["clients"]) for of in found]
        dram = [of["result"]["dram"] for of in found]
        hits = [100 * (of["row_hits"] + of["write_row_hits"]) / (of["reads"] + of["writes"]) for of in dram]
        energy = [of["energy_mj"] / FRAMES for of in dram]
        permille = found[0]["config"]["frame"].get("color_compressed_permille")
        drams.append([scene, title + (f" to {permille / 10:.1f} %" if permille else ""), *(f"{total / FRAMES / 1e6:.2f}" for total in totals),
                      saved(totals[1], totals[0]), *(f"{hit:.1f}" for hit in hits), *(f"{mj:.2f}" for mj in energy), saved(energy[1], energy[0])])
save("whole-frame-dram", ["scene", "machine", "Morton: all, MB per frame", "Z2 STA: all, MB per frame", "saved %", "Morton: row hits %",
                          "Z2 STA: row hits %", "Morton: DRAM energy, mJ per frame", "Z2 STA: DRAM energy, mJ per frame", "energy saved %"], drams)
save("whole-frame-bytes", ["scene", "texture samples, MB", "meshes, MB", "primitive lists of 4 frames, MB"], sizes)
save("whole-frame", ["scene", "machine"] + CLIENTS + ["all, MB per frame", "texture % of all"], shares)
save("whole-frame-orders", ["scene", "machine", "texture saved %", "shaded vertices saved %", "all saved %", "Morton GB/s at 90 Hz", "Z2 STA GB/s at 90 Hz",
                            "Morton mW at 90 Hz", "Z2 STA mW at 90 Hz"], orders)
PYTHON
