#!/bin/sh
# Holds the choices of `--auto` against the full table of techniques: three scenes, two densities of pixels, four objectives.
# Writes results/auto-choices.csv. Rerun after an interruption, it goes on where it was.
#   BUDGETS="flip=0.05"   OBJECTIVES="fragments bytes energy time"   VIEWS="480x540:100 768x864:67" (pixels an eye and degrees)
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/auto
bin=${CARGO_TARGET_DIR:-target}/release
budgets=${BUDGETS:-flip=0.05}
objectives=${OBJECTIVES:-fragments bytes energy time}
views=${VIEWS:-480x540:100 768x864:67}
mkdir -p "$out"
csv=results/auto-choices.csv
{
    echo "# command: scripts/auto.sh  (tracegen techniques SCENE --path head --path-frames 12 --frames 2 --repeats N --size SIZE --hfov DEG --auto BUDGET --objective OBJECTIVE, then replay techniques --json)"
    echo "scene,pixels per degree,objective,budget,choice,\"cost, of the baseline's\",\"error of the worst picture, FLIP\",rows of the table,dominated"
} >"$csv.part"
for scene in plant atrium jungle; do
    for view in $views; do
        size=${view%%:*} hfov=${view##*:}
        for budget in $budgets; do
            for objective in $objectives; do
                # Counts repeat exactly. Times need eight measurements for a claim: two frames, four repeats.
                folder=$out/$scene-$size repeats=1
                [ "$objective" != time ] || folder=$folder-time repeats=4
                "$bin/tracegen" techniques "$scene" --path head --path-frames 12 --frames 2 --repeats "$repeats" --size "$size" --hfov "$hfov" \
                    --auto "$budget" --objective "$objective" -o "$folder" >"$folder.log" 2>&1 ||
                    { cat "$folder.log" >&2; exit 1; }
                "$bin/replay" techniques "$folder" --json >"$folder.json"
                python3 - "$folder" "$scene" "$objective" "$budget" >>"$csv.part" <<'PYTHON'
import json, sys
folder, scene, objective, budget = sys.argv[1:]
manifest = json.load(open(folder + "/manifest.json"))
rows = json.load(open(folder + ".json"))["rows"]
chosen, auto = rows[-1], manifest["auto"]
assert chosen["technique"].startswith("auto-"), chosen["technique"]
key = {"time": "frame_time_ratio", "fragments": "fragments_ratio", "bytes": "memory_bytes_ratio", "energy": "energy_ratio"}
dominated = chosen["dominated"] if objective == "time" else objective in chosen["dominated_in"].split()
print(scene, f"{manifest['pixels_per_degree']:.1f}", objective, budget, auto["chosen"]["technique"],
      f"{chosen[key[objective]]:.3f}", f"{chosen['flip_worst']:.4f}", len(rows) - 1, "yes" if dominated else "no", sep=",")
PYTHON
            done
        done
    done
done
mv "$csv.part" "$csv"

# Tables of the last view, in docs/results/techniques.md: each scene's techniques, what orders save with them, published figures.
view=${views##* }
python3 - "$out" "${view%%:*}" <<'PYTHON'
import csv, json, sys
from collections import defaultdict

out, size = sys.argv[1:]
COMMAND = ("scripts/auto.sh  (tracegen techniques SCENE --path head --path-frames 12 --frames 2 --repeats 1 "
           f"--size {size} --hfov 67 -o DIR; replay techniques DIR --json)")
SCENES = ["plant", "atrium", "jungle"]


def write(name, heading, rows):
    with open(f"results/{name}.csv", "w", newline="") as file:
        file.write(f"# command: {COMMAND}\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *rows])


gains, published = defaultdict(dict), []
for scene in SCENES:
    found = json.load(open(f"{out}/{scene}-{size}.json"))
    table = []
    for row in found["rows"]:
        if row["technique"].startswith("auto-"):
            continue
        time = " to ".join(f"{row[f'frame_time_ratio_{q}']:.2f}" for q in ("q1", "q3"))
        table.append([
            row["technique"], f"{row['frame_time_ratio']:.2f} ({time})", *(f"{row[key]:.2f}" for key in (
                "cull_tests_ratio", "draws_ratio", "fragments_ratio", "memory_bytes_ratio", "energy_ratio")),
            row["false_negatives"], f"{row['flip_mean']:.4f}", f"{row['flip_worst']:.4f}", f"{row['external_mb_per_frame']:.3f}",
            row["dominated_in"] or "-"])
    write(f"techniques-{scene}", [
        "technique", "time (quartiles)", "tests", "draws", "fragments", "bytes", "energy", "draws missed", "FLIP, mean", "FLIP, worst",
        "texture MB per frame", "dominated in"], table)
    for row in found["orders"]:
        if not row["technique"].startswith("auto-"):
            gains[row["technique"]][scene] = [f"{row['saved_pct']:.1f}", f"{row['shared_pct']:.1f}", f"{row['headroom_pct']:.1f}"]
    published += [[row["technique"], row["quantity"], scene, row["published_pct"], f"{row['ours_pct']:.1f}", f"{row['flip_mean']:.4f}", row["source"]]
                  for row in found["published"]]
write("techniques-orders", ["technique", *(f"{scene}: {what}" for scene in SCENES for what in ("saved", "shared", "above bound"))],
      [[name, *(cell for scene in SCENES for cell in by_scene[scene])] for name, by_scene in gains.items()])
published.sort(key=lambda row: (row[0], row[1], SCENES.index(row[2])))
write("techniques-published", ["technique", "saves", "scene", "published %", "ours %", "FLIP, mean", "source"], published)
PYTHON
