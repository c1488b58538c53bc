"""Tables of docs/results/sgrt-timing.md from what scripts/sgrt-timing.sh measured: sgrt_timing.py RESULTS SCENES_BEYOND SCENE..."""

import csv
import json
import sys
from pathlib import Path

results, beyond, scenes = sys.argv[1], sys.argv[2].split(), sys.argv[3:]


def read(name):
    with open(name) as file:
        return json.load(file)


def write(name, command, heading, table):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write(f"# command: scripts/sgrt-timing.sh SCENES  ({command})\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


def millions(count):
    return f"{count / 1e6:.3f}"


def one(value):
    return f"{value:.1f}"


default = {scene: read(f"default,{scene}.json") for scene in scenes}
table = []
for scene, report in default.items():
    for eye in ("left", "right"):
        t = report["result"]["cycles"][eye]
        idle = t["idle"]
        table.append([scene, eye, millions(t["rays_left"]), millions(t["cycles"]), millions(t["closed_form_cycles"]), one(t["closed_form_error_pct"]),
                      t["closed_form_bottleneck"], one(t["traversal_utilisation_pct"]), one(t["intersection_utilisation_pct"]),
                      *(one(idle[cause]) for cause in ("no_ray", "mshr", "dram", "l2", "latency")), f"{t['mean_ray_cycles']:.0f}",
                      *(one(t[f"{cache}_hit_pct"]) for cache in ("node_l1", "triangle_l1", "l2"))])
write("sgrt-timing", "tracegen rays SCENE --size 512x512 --visits, replay reproject --timing cycle --json",
      ["scene", "eye", "rays M", "unit cycles M", "closed form M", "off by %", "its bottleneck", "traversal used %", "intersection used %",
       "idle %: no ray", "MSHRs full", "DRAM", "L2", "pipeline latency", "cycles per ray", "node L1 hits %", "triangle L1 hits %", "L2 hits %"], table)

table = []
for scene, report in default.items():
    for rule, outcome in (("none", report["plain"]), ("default", report["result"])):
        cycles = outcome["cycles"]
        closed = [cycles[f"closed_form_relative_{what}"] for what in ("performance", "energy")]
        timed = [outcome[f"relative_{what}"] for what in ("performance", "energy")]
        frames = [cycles[run]["closed_form_error_pct"] for run in ("reference", "reprojected")]
        table.append([scene, rule, *(f"{value:.3f}" for pair in zip(closed, timed) for value in pair), *map(one, frames)])
write("sgrt-timing-performance", "replay reproject --timing cycle --json",
      ["scene", "rule", "performance: closed form", "performance: cycle level", "energy: closed form", "energy: cycle level", "closed form off by %: both eyes in full",
       "closed form off by %: with reprojection"], table)

table = []
for name in ["default", *Path("variants").read_text().splitlines()]:
    reports = {scene: default[scene] if name == "default" else read(f"variant,{name},{scene}.json") for scene in beyond}
    pairs = [report["result"]["cycles"][eye] for report in reports.values() for eye in ("left", "right")]
    table.append([name, *(one(pair["closed_form_error_pct"]) for pair in pairs)])
write("sgrt-timing-causes", "replay reproject --timing cycle --config FILE --json",
      ["machine: closed form off by %", *(f"{scene}, {eye}" for scene in beyond for eye in ("left", "right"))], table)

table = []
for line in Path("times").read_text().splitlines():
    scene, seconds = line.split()
    seconds = float(seconds)
    runs, plain = default[scene]["result"]["cycles"], default[scene]["plain"]["cycles"]
    # The reference and each eye alone once; per rule, reprojection with both kinds of G-buffer.
    simulated = [runs["reference"], runs["left"], runs["right"], *[runs["reprojected"]] * 2, *[plain["reprojected"]] * 2]
    rays, requests = (sum(run[key] for run in simulated) for key in ("rays_left", "requests"))
    table.append([scene, millions(rays), one(requests / rays), f"{seconds:.1f}", f"{rays / seconds / 1e6:.2f}", f"{seconds / rays * 1e6:.2f}"])
write("sgrt-timing-speed", "replay reproject --timing cycle --threads 1 --json, the whole command",
      ["scene", "rays simulated M", "requests per ray", "processor seconds", "M rays per second", "seconds per million rays"], table)

# Published rates (docs/models/sgrt.md) beside ours: RayCore's 239 Mray/s and 1 W of 6 units at 28 nm (Nah et al. 2014), GR6500's 300 Mray/s and
# 24 G node tests per second at 600 MHz (Imagination). A step of ours tests two boxes.
table = [["RayCore, 28 nm", "6", "239", "-", f"{1e9 / 239e6:.2f}"], ["PowerVR GR6500", "-", "300", "80", "-"]]
for scene, report in default.items():
    run, model = report["result"], report["config"]["model"]["tni"]
    rays = run["reference_work"]["rays"]
    seconds = run["cycles"]["reference"]["cycles"] / (model["clock_mhz"] * 1e6)
    energy = run["reference_energy"]["tni_pj"] + run["reference_energy"]["caches_pj"]
    table.append([f"ours, 45 nm: {scene}", model["units"], f"{rays / seconds / 1e6:.0f}", f"{2 * run['reference_work']['steps'] / rays:.0f}", f"{energy / rays / 1e3:.2f}"])
write("sgrt-published-units", "replay reproject --timing cycle --json",
      ["unit", "units", "Mray/s", "box tests per ray", "nJ per ray, units and their caches"], table)
