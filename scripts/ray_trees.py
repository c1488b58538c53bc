"""The table of trees in docs/results/ray-trees.md from what scripts/ray-trees.sh measured: ray_trees.py RESULTS SIZE"""

import csv
import json
import sys
from pathlib import Path

results, size = sys.argv[1:]
LINE_BYTES = 64


def read(name):
    return json.loads(Path(name).read_text())


table, base, named = [], {}, set()
for path in sorted(Path().glob("*,info.json"), key=lambda path: path.stat().st_mtime_ns):
    scene, tree, _ = path.name.split(",")
    tree, *treelets = tree.split(" --treelets ")
    info, report = read(path), read(path.name.replace(",info.json", ".json"))
    hierarchy, run = info["hierarchy"], report["result"]
    work, cycles = run["reference_work"], run["cycles"]["reference"]
    rays = work["rays"]
    dram_bytes, time = run["reference_dram"]["hierarchy_bytes"], cycles["cycles"]
    first = base.setdefault(scene, (dram_bytes, time))
    table.append([
        "" if scene in named else scene, tree, "treelets of 4 KB" if treelets else "depth first", hierarchy["bytes_per_node"],
        f"{hierarchy['nodes'] * hierarchy['bytes_per_node'] / 1e6:.2f}", f"{work['steps'] / rays:.2f}",
        f"{work['steps'] / rays * hierarchy['bytes_per_node']:.0f}", f"{work['triangle_tests'] / rays:.2f}",
        f"{cycles['node_l1_hit_pct']:.1f}", f"{cycles['triangle_l1_hit_pct']:.1f}", f"{cycles['l2_hit_pct']:.1f}",
        f"{dram_bytes / rays:.1f}", f"{dram_bytes / first[0]:.2f}", f"{time / 1e6:.2f}", f"{first[1] / time:.2f}",
    ])
    named.add(scene)
with open(f"{results}/rays-trees.csv", "w", newline="") as file:
    file.write(f"# command: scripts/ray-trees.sh SCENES  (tracegen rays SCENE --size {size} --visits --bvh TREE [--treelets 4096], replay reproject --timing cycle --json)\n")
    csv.writer(file, lineterminator="\n").writerows([[
        "scene", "tree", "layout", "bytes per node", "nodes, MB", "steps per ray", "node bytes per ray", "tests per ray", "node L1 hits %", "triangle L1 hits %",
        "L2 hits %", "DRAM bytes per ray", "DRAM bytes, relative", "unit cycles M", "performance, relative"], *table])
