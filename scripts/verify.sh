#!/bin/sh
# Verifies captures of generated scenes and of those in a folder: `scripts/verify.sh SCENES`
#   results/verify-means.csv   the mean nearest to its bound, and the coordinates that nothing explains
#   results/verify-scenes.csv  differences between capture and reference, and what they change in a replay
set -eu
scenes=${1:?the folder with the real scenes}
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bin=${CARGO_TARGET_DIR:-target}/release
means=$work/means.csv whole=$work/scenes.csv
{
    echo "# command: scripts/verify.sh SCENES  (tracegen verify SCENE --size SIZE --json of each row)"
    echo "scene,pixels of both eyes,coordinates,unexplained,\"largest mean, part of its bound\",\"that bound, texels\""
} >"$means"
{
    echo "# command: scripts/verify.sh SCENES  (tracegen verify SCENE --trace FILE --write-reference FILE --json, replay run of both; 2x512x512)"
    printf '%s' "scene,\"fragments in both\",\"only reference, only capture\",IoU,\"at edges, depth ties, unexplained\","
    printf '%s' "\"coordinates, texels: mean, 99 %\",\"beyond 1/64 texel: single precision, saturated, unexplained\","
    printf '%s' "\"same formula: LOD mean, max\",\"same formula: footprints that differ\",\"specification: levels, footprints that differ\","
    echo "\"external bytes, capture over reference: Morton, Z2 STA\""
} >"$whole"

row() {
    name=$1 file=$2 size=$3
    "$bin/tracegen" verify "$file" --size "$size" --json 2>/dev/null | python3 -c '
import json, sys
uv = json.load(sys.stdin)["uv_error_texels"]
share = lambda mean: abs(mean["mean_texels"]) / mean["bound_texels"]
worst = max(uv["largest_means"], key=share)
unexplained = next(c["count"] for c in uv["causes"] if c["cause"] == "unexplained")
bound = worst["bound_texels"]
print(*sys.argv[1:], uv["coordinates"], unexplained, f"{100 * share(worst):.1f} %", f"{bound:.4f}", sep=",")
' "$name" "2x$size" >>"$means"
}

bytes() {
    for trace in capture reference; do
        for order in morton z2-sta; do
            "$bin/replay" run "$work/$trace.textrace" --order $order --mode functional --json >"$work/$trace-$order.json"
        done
    done
}

whole() {
    name=$1 file=$2
    "$bin/tracegen" raster "$file" --no-plain --size 512x512 -o "$work/capture.textrace" >/dev/null 2>&1
    "$bin/tracegen" verify "$file" --trace "$work/capture.textrace" --write-reference "$work/reference.textrace" --json \
        >"$work/verify.json" 2>/dev/null
    bytes
    python3 - "$name" "$work" >>"$whole" <<'PYTHON'
import csv, json, sys
name, work = sys.argv[1:]
found = json.load(open(work + "/verify.json"))
cover, uv = found["coverage"], found["uv_error_texels"]
kind = {d["class"]: d["only_reference"] + d["only_capture"] for d in cover["differences"]}
cause = {c["cause"]: c["count"] for c in uv["causes"]}
same, spec = found["capture_precision"], found["specification"]
change = []
for order in ("morton", "z2-sta"):
    counted = [json.load(open(f"{work}/{trace}-{order}.json"))["result"]["external_bytes"] for trace in ("capture", "reference")]
    change.append(f"{100 * (counted[0] / counted[1] - 1):+.3f} %")
csv.writer(sys.stdout, lineterminator="\n").writerow([
    name, f"{cover['both']:,}", f"{cover['only_reference']:,}; {cover['only_capture']:,}", f"{100 * cover['iou']:.4f} %",
    f"{kind['edge']:,}; {kind['depth-tie']:,}; {kind['unexplained']:,}",
    f"{uv['mean']:.4f}; {uv['p99']:.4f}",
    f"{cause['single-precision']:,}; {cause['saturated']:,}; {cause['unexplained']:,}",
    f"{same['lod_error_mean']:.5f}; {same['lod_error_max']:.4f}", f"{100 * same['footprints_differ_share']:.3f} %",
    f"{100 * spec['levels_differ_share']:.2f} %; {100 * spec['footprints_differ_share']:.2f} %",
    "; ".join(change)])
PYTHON
}

whole crytek-sponza "$scenes/crytek-sponza/sponza.gltf"
whole stk-cocoa-temple "$scenes/stk-cocoa-temple/stk-cocoa-temple.gltf"
whole atrium atrium
whole jungle jungle
for line in \
    atrium-shadows:128x144 jungle:512x512 plant:256x256 \
    crytek-sponza/sponza.gltf:256x256 crytek-sponza/sponza.gltf:333x217 \
    stk-cocoa-temple/stk-cocoa-temple.gltf:256x256 stk-cocoa-temple/stk-cocoa-temple.gltf:333x217 \
    stk-cocoa-temple/stk-cocoa-temple.gltf:512x512 \
    stk-black-forest/stk-black-forest.gltf:256x256 stk-black-forest/stk-black-forest.gltf:512x512 \
    dabrovic-sponza/sponza.gltf:256x256 chess-openchessset/chess_42k.gltf:256x256 bmw27/bmw_55k.gltf:256x256; do
    scene=${line%%:*} size=${line##*:}
    case $scene in */*) row "${scene%%/*}" "$scenes/$scene" "$size" ;; *) row "$scene" "$scene" "$size" ;; esac
done
cp "$means" results/verify-means.csv
cp "$whole" results/verify-scenes.csv
