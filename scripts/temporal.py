"""The table of docs/results/temporal.md from what scripts/temporal.sh measured: temporal.py RESULTS SIZE"""

import csv
import math
import sys
from pathlib import Path

results, size = sys.argv[1:]
RULES = {"none": "every arrival reused", "on-chip": "`--preset on-chip`"}
FIGURES = ["left_reused_pct", "right_reused_pct", "relative_performance", "relative_energy", "dram_mb", "gbuffer_dram_mb", "left_flip_mean", "right_flip_mean"]


def mean(values, geometric):
    if geometric:
        return math.exp(sum(map(math.log, values)) / len(values))
    return sum(values) / len(values)


# By rule, scene and scheme: the rows of all pairs of frames.
found, scenes = {}, []
for path in sorted(Path().glob("*.csv"), key=lambda path: path.stat().st_mtime_ns):
    preset, scene, _ = path.stem.split(",")
    if scene not in scenes:
        scenes.append(scene)
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault((preset, scene, row["scheme"]), []).append(row)
table = []
for preset, rule in RULES.items():
    for scene in [*scenes, "all"]:
        for scheme in ["stereo", "temporal", "both"]:
            rows = [row for (p, s, k), of in found.items() for row in of if (p, k) == (preset, scheme) and scene in (s, "all")]
            figures = {key: mean([float(row[key]) for row in rows], key.startswith("relative")) for key in FIGURES}
            worst = max(float(row[key]) for row in rows for key in ("left_flip_mean", "right_flip_mean"))
            first = scheme == "stereo"
            table.append([
                rule if first and scene == scenes[0] else "", scene if first else "", scheme, f"{figures['left_reused_pct']:.0f}", f"{figures['right_reused_pct']:.0f}",
                f"{figures['relative_performance']:.2f}", f"{figures['relative_energy']:.2f}", f"{figures['dram_mb']:.1f}", f"{figures['gbuffer_dram_mb']:.1f}",
                f"{figures['left_flip_mean']:.4f}", f"{figures['right_flip_mean']:.4f}", f"{worst:.4f}",
            ])
with open(f"{results}/temporal.csv", "w", newline="") as file:
    file.write(f"# command: scripts/temporal.sh SCENES  (tracegen rays SCENE --size {size} --visits --path head --fps 90 --frame K, replay temporal)\n")
    csv.writer(file, lineterminator="\n").writerows([[
        "rule", "scene", "scheme", "left reused %", "right reused %", "performance", "energy", "DRAM MB", "of G-buffers MB", "left FLIP", "right FLIP", "worst FLIP"], *table])
