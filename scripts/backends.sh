#!/bin/sh
# How far captures of the drivers are apart: `scripts/backends.sh SCENES` writes results/backends.csv, four scenes at 2 x 512x512 through lavapipe,
# OSMesa's llvmpipe, softpipe, and as the reference in double precision has them.
set -eu
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf stk-cocoa-temple/stk-cocoa-temple.gltf
for scene in "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-cocoa-temple/stk-cocoa-temple.gltf" atrium jungle; do
    name=$(basename "$scene" .gltf)
    "$bin/tracegen" raster "$scene" --size 512x512 --quiet -o "$name.lavapipe.textrace"
    "$bin/tracegen" raster "$scene" --size 512x512 --quiet --backend osmesa -o "$name.osmesa.textrace"
    GALLIUM_DRIVER=softpipe "$bin/tracegen" raster "$scene" --size 512x512 --quiet --backend osmesa -o "$name.softpipe.textrace"
    "$bin/tracegen" verify "$scene" --quiet --trace "$name.lavapipe.textrace" --write-reference "$name.reference.textrace" >/dev/null
    for other in osmesa softpipe reference; do
        "$bin/replay" compare "$name.lavapipe.textrace" "$name.$other.textrace" --mode functional --json 2>/dev/null >"$name.$other.json"
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

SCENES = {"sponza": "Crytek Sponza", "stk-cocoa-temple": "cocoa temple", "atrium": "atrium", "jungle": "jungle"}


def found(other):
    return [json.load(open(f"{scene}.{other}.json")) for scene in SCENES]


def change(value):
    return "0" if abs(value) < 5e-4 else f"{value:+.3f} %"


def replayed(document, order):
    return next(row for row in document["replayed"] if row["order"] == order)


def over(other, order):
    return [change(replayed(document, order)["external_over_pct"]) for document in found(other)]


def overlap(other):
    cells = [document["intersection_over_union_pct"] for document in found(other)]
    return ["100 %" if cell == 100 else f"{cell:.4f} %" for cell in cells]


def differ(other):
    return [f"{100 * d['all']['footprints_that_differ'] / d['all']['footprints']:.3f} %" for d in found(other)]


def equal(are):
    assert all(are), are
    return ["equal"] * len(SCENES)


osmesa = found("osmesa")
both = [d["all"]["fragments_in_both"] + d["all"]["fragments_only_in_a"] for d in osmesa]
alike = lambda d: d["all"]["uv_texels"]["largest"] == 0 and d["all"]["lod_levels"]["largest"] == 0 and d["all"]["footprints_that_differ"] == 0
uv = lambda d: f"{d['all']['uv_texels']['mean']:.3f}, {d['all']['uv_texels']['percentile_99']:.2f}"
lod = lambda d: f"{d['all']['lod_levels']['mean']:.4f}, {d['all']['lod_levels']['largest']:.2f}"
rows = [
    ["lavapipe", "fragments", *(f"{count:,}" for count in both)],
    *(["", f"bytes, {title}", *(f"{replayed(d, order)['a']['external_bytes']:,}" for d in osmesa)] for order, title in (("morton", "Morton"), ("z2-sta", "Z2 STA"))),
    ["OSMesa, llvmpipe", "overlap of fragments", *overlap("osmesa")],
    ["", "coordinates, levels, footprints", *equal([alike(d) for d in osmesa])],
    ["", "bytes, every order", *equal([all(row["external_over_pct"] == 0 for row in d["replayed"]) for d in osmesa])],
]
for other, title in (("reference", "reference"), ("softpipe", "OSMesa, softpipe")):
    rows.append([title, "overlap of fragments", *overlap(other)])
    if other == "softpipe":
        rows.append(["", "coordinates, texels: mean, 99 %", *map(uv, found(other))])
        rows.append(["", "LOD, levels: mean, largest", *map(lod, found(other))])
    rows.append(["", "footprints that differ, one LOD formula", *differ(other)])
    rows += [["", f"bytes, {title}", *over(other, order)] for order, title in (("morton", "Morton"), ("z2-sta", "Z2 STA"))]
with open(sys.argv[1] + "/backends.csv", "w", newline="") as file:
    file.write("# command: scripts/backends.sh SCENES  (tracegen raster SCENE --size 512x512 [--backend osmesa], replay compare lavapipe.textrace OTHER.textrace --mode functional)\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(["capture", "figure", *SCENES.values()])
    table.writerows(rows)
PYTHON
