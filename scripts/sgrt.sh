#!/bin/sh
# Stereo reprojection on the SGRT model: `scripts/sgrt.sh SCENES` writes results/reprojection.csv, results/reprojection-rules.csv and
# results/sgrt-readings.csv (the paper's figure 3 under two readings of what is reused).
#   SIZE=WxH   pixels per eye of the first two (1024x1024)
set -eu
size=${SIZE:-1024x1024}
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf
built_in="teapot chess car lab music-box meadow"
rules="none depth row object opaque silhouette triangle triangles depth+row+object+opaque+triangles"
files="utah-teapot/teapot_16k chess-openchessset/chess_42k bmw27/bmw_55k stk-black-forest/stk-black-forest crytek-sponza/sponza"
set --
for scene in $built_in; do
    "$bin/tracegen" rays "$scene" --size "$size" --quiet -o "$scene.raytrace"
    set -- "$@" "$scene.raytrace"
done
stand_ins=""
for file in $files; do
    present "$file.gltf" || continue
    name=$(basename "$file")
    [ "$name" != sponza ] || name=crytek-sponza
    "$bin/tracegen" rays "$scenes/$file.gltf" --size "$size" --quiet -o "$name.raytrace"
    set -- "$@" "$name.raytrace"
    case $name in
    *_*k) stand_ins="$stand_ins --as $name=${name%_*}" ;;
    esac
done
# shellcheck disable=SC2086 # options, split on purpose
"$bin/replay" reproject "$@" $stand_ins --csv --quiet >all.csv
for rule in $rules; do
    "$bin/replay" reproject crytek-sponza.raytrace --rule "$rule" --csv --quiet >"rule,$rule.csv"
done
mkdir small
set --
for scene in $built_in; do
    "$bin/tracegen" rays "$scene" --size 512x512 --quiet -o "small/$scene.raytrace"
    set -- "$@" "small/$scene.raytrace"
done
for reuse in primary shadow; do
    "$bin/replay" reproject "$@" --rule none --reuse $reuse --csv --quiet >"readings,$reuse.csv"
done
python3 - "$results" "$size" $rules <<'PYTHON'
import csv, json, sys

results, size, rules = sys.argv[1], sys.argv[2], sys.argv[3:]


def rows(name):
    with open(name, newline="") as file:
        return list(csv.DictReader(file))


def write(name, command, heading, table):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write(f"# command: scripts/sgrt.sh SCENES  ({command})\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


columns = ["scene", "checksum", "run", "rule", "reuse", "reuse_pct", "wrong_object_pct", "position_over_2px_pct", "flip_mean", "psnr_db",
           "relative_performance", "tni_relative_performance", "paper_relative_performance", "relative_energy", "paper_relative_energy",
           "whole_screen_relative_performance", "whole_screen_relative_energy", "primary_steps_pct"]
write("reprojection", f"tracegen rays SCENE --size {size}, replay reproject *.raytrace --as LABEL=SCENE --csv", columns,
      [[row[column] for column in columns] for row in rows("all.csv")])

table = []
for rule in rules:
    chosen = rows(f"rule,{rule}.csv")[0]
    of = lambda key, digits, scale=1: f"{float(chosen[key]) / scale:.{digits}f}"
    table.append(["default" if "+" in rule else f"`{rule}`", of("gbuffer_dram_bytes", 1, 1e6), of("on_chip_bytes", 0, 1e6), of("retests", 2, 1e6),
                  of("reuse_pct", 1), of("wrong_object_pct", 3), of("flip_mean", 4), of("relative_performance", 2), of("relative_energy", 2)])
write("reprojection-rules", f"tracegen rays crytek-sponza/sponza.gltf --size {size}, replay reproject --rule RULE --csv",
      ["rule", "G-buffer in DRAM MB", "tile buffers MB", "re-tests M", "reuse %", "wrong object %", "FLIP", "performance", "energy"], table)

readings = {reuse: [row for row in rows(f"readings,{reuse}.csv") if row["run"] == "chosen"] for reuse in ("primary", "shadow")}
table = []
for primary, shadow in zip(*readings.values()):
    cells = [f"{float(row[f'{start}relative_{what}']):.2f}" for what in ("performance", "energy")
             for row, start in ((primary, "paper_"), (primary, ""), (shadow, ""))]
    table.append([primary["scene"], *cells])
write("sgrt-readings", "tracegen rays SCENE --size 512x512, replay reproject *.raytrace --rule none --reuse primary|shadow --csv", [
    "scene", *(f"{what}: {which}" for what in ("performance", "energy") for which in ("paper", "primary hits reused", "and shadow outcomes"))], table)
PYTHON
