"""Tables of docs/results/sgrt-timing.md from what scripts/sgrt-timing.sh measured: sgrt_timing.py RESULTS SCENE..."""

import csv
import json
import sys
from pathlib import Path

results, scenes = sys.argv[1], sys.argv[2:]


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
      ["scene", "rule", "performance: closed form", "cycle level", "energy: closed form", "cycle level", "closed form off by %: both eyes in full",
       "with reprojection"], table)

table = []
for name in ["default", *Path("variants").read_text().splitlines()]:
    reports = default if name == "default" else {scene: read(f"variant,{name},{scene}.json") for scene in scenes}
    pairs = [(report["plain"]["cycles"][eye], f"{scene}, {eye}") for scene, report in reports.items() for eye in ("left", "right")]
    errors = [(pair["closed_form_error_pct"], label) for pair, label in pairs]
    worst = max(errors, key=lambda pair: abs(pair[0]))
    mean = lambda value: sum(map(value, (pair for pair, _ in pairs))) / len(pairs)
    table.append([name, one(sum(error for error, _ in errors) / len(errors)), f"{worst[0]:.1f} ({worst[1]})", sum(abs(error) > 10 for error, _ in errors),
                  len(errors), one(mean(lambda p: p["traversal_utilisation_pct"])), one(mean(lambda p: p["idle"]["no_ray"])),
                  millions(sum(pair["cycles"] for pair, _ in pairs)), millions(sum(pair["requests"] for pair, _ in pairs))])
write("sgrt-timing-causes", "replay reproject --rule none --timing cycle --config FILE --json",
      ["machine", "closed form off by %, mean", "worst pair", "pairs beyond 10 %", "of", "traversal used %", "idle %: no ray", "unit cycles of all pairs M",
       "requests M"], table)

table = []
for line in Path("times").read_text().splitlines():
    scene, milliseconds = line.split()
    runs, plain = default[scene]["result"]["cycles"], default[scene]["plain"]["cycles"]
    # The reference and each eye alone once; per rule, reprojection with both kinds of G-buffer.
    simulated = [runs["reference"], runs["left"], runs["right"], *[runs["reprojected"]] * 2, *[plain["reprojected"]] * 2]
    rays, requests = (sum(run[key] for run in simulated) for key in ("rays_left", "requests"))
    seconds = int(milliseconds) / 1e3
    table.append([scene, millions(rays), one(requests / rays), f"{seconds:.1f}", f"{rays / seconds / 1e6:.2f}", f"{seconds / rays * 1e6:.2f}"])
write("sgrt-timing-speed", "replay reproject --timing cycle --threads 1 --json, the whole command",
      ["scene", "rays simulated M", "requests per ray", "seconds", "M rays per second", "seconds per million rays"], table)
