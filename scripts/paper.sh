#!/bin/sh
# Measures the tables of docs/results/z2-comparison.md that compare savings with the paper's: `scripts/paper.sh SCENES`
#   results/paper-savings.csv   every scene, cache configuration and order
#   results/paper-means.csv     its means over cache configurations
#   results/paper-preset.csv    Crytek Sponza as the paper counts
#   results/open-choices.csv    Crytek Sponza: where textures begin, and the bias of the level of detail
set -eu
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf
capture() {
    name=$1 scene=$2
    case $scene in *.gltf) present "${scene#"$scenes/"}" || return 0 ;; esac
    shift 2
    "$bin/tracegen" raster "$scene" --no-plain --quiet "$@" -o "$name.textrace"
}
capture crytek-sponza "$scenes/crytek-sponza/sponza.gltf"
capture atrium atrium
capture dabrovic-sponza "$scenes/dabrovic-sponza/sponza.gltf"
capture atrium-plain atrium-plain
capture dabrovic-sponza-shadows "$scenes/dabrovic-sponza/sponza.gltf" --shadows
capture atrium-shadows atrium-shadows
capture cocoa-temple "$scenes/stk-cocoa-temple/stk-cocoa-temple.gltf"
capture jungle jungle
mkdir dk2
capture dk2/crytek-sponza "$scenes/crytek-sponza/sponza.gltf" --hmd dk2
"$bin/replay" paper ./*.textrace --csv morton.csv >/dev/null 2>&1
set -- atrium-shadows.textrace jungle.textrace
[ ! -f dabrovic-sponza-shadows.textrace ] || set -- dabrovic-sponza-shadows.textrace "$@"
"$bin/replay" paper "$@" --shadow-map-order linear --csv linear.csv >/dev/null 2>&1
"$bin/replay" paper dk2/crytek-sponza.textrace --preset z2-paper --base-align 64KiB --csv preset.csv >/dev/null 2>&1
for choice in "64 0" "64KiB 0" "64KiB -1" "64KiB -2"; do
    set -- $choice
    for order in morton z2-lrta z2-sta; do
        "$bin/replay" run dk2/crytek-sponza.textrace --mode functional --base-align "$1" "--lod-bias=$2" --order $order --json \
            2>/dev/null >"choice,$1,$2,$order.json"
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys
from pathlib import Path

results = Path(sys.argv[1])
CAPTURES = "tracegen raster SCENE -o SCENE.textrace"


def rows(name):
    with open(name, newline="") as file:
        return list(csv.DictReader(file))


def write(name, commands, heading, table):
    with open(results / name, "w", newline="") as file:
        for command in commands:
            file.write(f"# command: {command}\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


# In the order of the document: name of the trace, title, scene of the paper.
ROWS = [
    ("crytek-sponza", "Crytek Sponza", "the same"),
    ("atrium", "atrium", "Crytek Sponza"),
    ("dabrovic-sponza", "Dabrovic Sponza", "L-Bench, no shadows"),
    ("atrium-plain", "atrium-plain", "L-Bench, no shadows"),
    ("dabrovic-sponza-shadows", "Dabrovic Sponza, shadows", "L-Bench, shadows"),
    ("atrium-shadows", "atrium-shadows", "L-Bench, shadows"),
    ("cocoa-temple", "cocoa temple", "T-Rex"),
    ("jungle", "jungle", "T-Rex"),
]
by_layout = {"morton": rows("morton.csv"), "linear": rows("linear.csv")}
points, means = [], []
for trace, title, stands_for in ROWS:
    for layout, table in by_layout.items():
        own = [row for row in table if row["trace"] == trace]
        if not own:
            continue
        for row in own:
            points.append([
                trace, layout, row["l1_kib"], row["l2_kib"], row["order"],
                *(f"{float(row[key]):.3f}" for key in ("l1_footprint_miss_pct", "l2_line_miss_pct", "tmu_util_pct")), row["external_bytes"],
                f"{float(row['reduction_pct']):.3f}",
                *(row[f"paper_{key}"] for key in ("l1_footprint_miss_pct", "l2_line_miss_pct", "tmu_util_pct")),
                f"{float(row['paper_reduction_pct']):.2f}" if row["paper_reduction_pct"] else "",
            ])
        cells = []
        for key, digits in (("reduction_pct", 1), ("tmu_ratio", 2)):
            for order in ("z2-lrta", "z2-sta"):
                of = [row for row in own if row["order"] == order]
                mean = lambda name: sum(float(row[name]) for row in of) / len(of)
                cells.append(f"{mean(key):.{digits}f} ({mean('paper_' + key):.{digits}f})")
        means.append([title if layout == "morton" else "the same, linear maps", stands_for, *cells])
commands = [
    f"scripts/paper.sh SCENES  ({CAPTURES}, --shadows for two Dabrovic rows)",
    "replay paper *.textrace --csv FILE",
    "replay paper dabrovic-sponza-shadows.textrace atrium-shadows.textrace jungle.textrace --shadow-map-order linear --csv FILE",
]
write("paper-savings.csv", commands, [
    "scene", "shadow_map_order", "l1_kib", "l2_kib", "order", "l1_footprint_miss_pct", "l2_line_miss_pct", "tmu_util_pct", "external_bytes", "saved_pct",
    "paper_l1_footprint_miss_pct", "paper_l2_line_miss_pct", "paper_tmu_util_pct", "paper_saved_pct"], points)
write("paper-means.csv", commands,
      ["scene", "stands for", "LRTA saved %", "STA saved %", "LRTA TMU", "STA TMU"], means)

names = {"morton": "Morton", "z2-lrta": "LRTA", "z2-sta": "STA"}
table = []
for row in rows("preset.csv"):
    rates = lambda start, digits: " / ".join(
        f"{float(row[start + key]):.{digits}f}" for key in ("l1_footprint_miss_pct", "l2_line_miss_pct", "tmu_util_pct"))
    saved = [row[key] for key in ("paper_reduction_pct", "z2_paper_product_reduction_pct", "z2_paper_reduction_pct", "reduction_pct")]
    saved = [f"{float(value):.1f}" if row["order"] != "morton" else "" for value in saved]
    table.append([f"{row['l1_kib']}/{row['l2_kib']} {names[row['order']]}", rates("paper_", 1), rates("z2_paper_", 1), *saved])
write("paper-preset.csv", [
    "scripts/paper.sh SCENES  (tracegen raster crytek-sponza/sponza.gltf --hmd dk2 -o crytek-sponza.textrace)",
    "replay paper crytek-sponza.textrace --preset z2-paper --base-align 64KiB --csv FILE",
], ["caches, order", "paper", "preset", "paper saved", "preset saved, L1 x L2", "bytes saved, preset", "bytes saved, default model"], table)

table = []
for align, bias in (("64", "0"), ("64KiB", "0"), ("64KiB", "-1"), ("64KiB", "-2")):
    found = {order: json.load(open(f"choice,{align},{bias},{order}.json"))["result"] for order in names}
    saved = [100 * (1 - found[order]["external_bytes"] / found["morton"]["external_bytes"]) for order in ("z2-lrta", "z2-sta")]
    l1 = [100 * found[order]["l1"]["footprint_miss_rate"] for order in ("morton", "z2-sta")]
    table.append(["64 bytes" if align == "64" else "64 KiB", bias, *(f"{rate:.2f}" for rate in l1),
                  f"{100 * found['morton']['l2']['line_miss_rate']:.1f}", *(f"{value:.1f}" for value in saved)])
paper = {row["order"]: row for row in rows("preset.csv") if (row["l1_kib"], row["l2_kib"]) == ("8", "128")}
table.append(["paper", "", f"{float(paper['morton']['paper_l1_footprint_miss_pct']):.2f}", f"{float(paper['z2-sta']['paper_l1_footprint_miss_pct']):.2f}",
              f"{float(paper['morton']['paper_l2_line_miss_pct']):.1f}",
              *(f"{float(paper[order]['paper_reduction_pct']):.1f}" for order in ("z2-lrta", "z2-sta"))])
write("open-choices.csv", [
    "scripts/paper.sh SCENES  (tracegen raster crytek-sponza/sponza.gltf --hmd dk2 -o crytek-sponza.textrace)",
    "replay run crytek-sponza.textrace --mode functional --base-align BYTES --lod-bias BIAS --order ORDER --json",
], ["textures begin at", "LOD bias", "L1 miss %, Morton", "L1 miss %, STA", "L2 miss %, Morton", "LRTA saved %", "STA saved %"], table)
PYTHON
