"""The table of docs/results/ray-workloads.md from what scripts/ray-workloads.sh measured: ray_workloads.py RESULTS SIZE"""

import csv
import json
import sys
from pathlib import Path

results, size = sys.argv[1:]
RUNS = ["primary", "shadow", "color", "on-chip"]


def read(name):
    return json.loads(Path(name).read_text())


table, named = [], set()
for path in sorted(Path().glob("*,info.json"), key=lambda path: path.stat().st_mtime_ns):
    scene, workload, _ = path.name.split(",")
    eyes = read(path)["totals"].values()
    rays = {}
    for eye in eyes:
        for kind, count in eye["rays"].items():
            rays[kind] = rays.get(kind, 0) + count
    samples, total = sum(eye["samples"] for eye in eyes), sum(rays.values())
    row = ["" if scene in named else scene, workload, f"{total / samples:.2f}"]
    row += [f"{100 * rays.get(kind, 0) / total:.0f}" for kind in ("shadow", "ambient-occlusion", "diffuse")]
    row.append(f"{100 * (rays['reflection'] + rays['refraction']) / total:.0f}")
    row.append(f"{sum(eye['steps'] for eye in eyes) / total:.1f}")
    for run in RUNS:
        result = read(f"{scene},{workload},{run}.json")["result"]
        row += [f"{result['relative_performance']:.2f}", f"{result['relative_energy']:.2f}", f"{result['flip_mean']:.4f}"]
    table.append(row)
    named.add(scene)
heading = ["scene", "workload", "rays per pixel", "shadow %", "occlusion %", "diffuse %", "mirror and glass %", "steps per ray"]
heading += [f"{run}: {figure}" for run in ["hits", "shadows", "colours", "on-chip"] for figure in ["performance", "energy", "FLIP"]]
with open(f"{results}/ray-workloads.csv", "w", newline="") as file:
    file.write(f"# command: scripts/ray-workloads.sh SCENES  (tracegen rays SCENE --size {size} --visits OPTIONS, replay reproject --rule none --reuse primary|shadow|color, --preset on-chip)\n")
    csv.writer(file, lineterminator="\n").writerows([heading, *table])
