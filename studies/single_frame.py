"""Time against error: one frame at 1920x2160 per eye in full, and cheaper ways to its savings. Paths are those of `sampling-cost`."""

import json
import math

from .common import FAINT, INK, machine, read_csv, svg_text, write_svg
from .sizes import CAMERAS, HASHED, HASHED_ORDERS, L2_KIB, MAIN, one, organised, saving, stored

WHOLE_PX = (1920, 2160)
PARTS = {"1/2": 2, "1/3": 3}
# Presets with an L1 and an L2, on which predictions from half of the width are checked.
MACHINES = ["adreno-740", "mali-g710", "apple-m2", "xclipse-920"]
WAYS = {"functional": "all pixels, functional replay", "1/2": "half of the width, predicted", "1/3": "a third of the width, predicted", "frames": "a sample of a path's frames"}
COLOURS = dict(zip(WAYS, ("#0072b2", "#b34a00", "#8a3d6b", "#00704f")))
# The chart: its corner, its size, and its ends in the share of the time and in points.
LEFT, TOP, WIDTH, HEIGHT = 70, 50, 560, 330
TIMES, POINTS = (0.04, 1.6), (0.01, 20)


def capture(study, camera, size):
    """A capture without the caches of earlier captures, and its processor time."""
    label, _, scene, name = camera
    width, height = size
    trace = study.work / f"{label}-{width}.textrace"
    done = study.tracegen("raster", study.scene(scene), "--camera", name, "--hmd", MAIN, "--size", f"{width}x{height}", "--no-plain --quiet -o", trace)
    return trace, done.processor_s


def replayed(study, trace, mode):
    """Savings of each order and L2, and the processor time of their replay."""
    caches = ",".join(f"8/{kib}" for kib in L2_KIB)
    done = study.replay("orders", trace, *organised(study, HASHED), "--mode", mode, "--json --quiet --orders", ",".join(HASHED_ORDERS), "--caches", caches)
    bytes_of = {}
    for row in json.loads(done.out)["rows"]:
        bytes_of.setdefault(f"{row['l2_kib']:.0f}", {})[row["order"]] = row["external_bytes"]
    return {f"{kib} {order}": saving(of, order) for kib, of in bytes_of.items() for order in HASHED_ORDERS[1:]}, done.processor_s


def measured(study, camera):
    """Processor times, and the savings that each way finds."""
    # The first capture fills the cache of textures, which every later capture of a scene uses.
    capture(study, camera, WHOLE_PX)[0].unlink()
    whole, capture_s = capture(study, camera, WHOLE_PX)
    truth, timed_s = replayed(study, whole, "timed")
    functional, functional_s = replayed(study, whole, "functional")
    whole.unlink()
    least, load_s = capture(study, camera, (64, 72))
    least.unlink()
    parts = {}
    for name, part in PARTS.items():
        trace, part_s = capture(study, camera, [side // part for side in WHOLE_PX])
        caches = ",".join(f"8/{kib}" for kib in L2_KIB)
        done = study.replay("predict", trace, "--json --quiet --to", "x".join(map(str, WHOLE_PX)), "--orders", ",".join(HASHED_ORDERS[1:]), "--caches", caches)
        trace.unlink()
        cells = {f"{row['caches'].split('/')[1]} {row['order']}": [row["stretched_pct"], row["answer"].startswith("inside")] for row in json.loads(done.out)["rows"]}
        parts[name] = {"capture_s": part_s, "predict_s": done.processor_s, "cells": cells}
    return {"capture_s": capture_s, "timed_s": timed_s, "functional_s": functional_s, "load_s": load_s, "truth": truth, "functional": functional, "parts": parts}


def on_machines(study, camera):
    """Errors of predictions on present machines, points, and whether each is inside a knee."""
    whole, _ = capture(study, camera, WHOLE_PX)
    half, _ = capture(study, camera, [side // 2 for side in WHOLE_PX])
    orders, found = HASHED_ORDERS, {}
    for name in MACHINES:
        rows = study.json("predict", half, "--preset", name, "--to", "x".join(map(str, WHOLE_PX)), "--orders", ",".join(orders[1:]))["rows"]
        of = study.json("orders", whole, "--preset", name, "--caches", rows[0]["caches"], "--mode functional --orders", ",".join(orders))["rows"]
        true = {row["order"]: row["external_bytes"] for row in of}
        found[name] = [[row["stretched_pct"] - saving(true, row["order"]), row["answer"].startswith("inside")] for row in rows]
    for trace in (whole, half):
        trace.unlink()
    return found


def place(time, points):
    """A point of the chart, both axes logarithmic."""
    at = lambda value, ends: math.log(min(max(value, ends[0]), ends[1]) / ends[0]) / math.log(ends[1] / ends[0])
    return LEFT + WIDTH * at(time, TIMES), TOP + HEIGHT * (1 - at(points, POINTS))


def draw(study, found):
    """Each scene or path as a dot, the median of each way as a ring, and the frontier through the medians that no other beats."""
    parts = [svg_text(LEFT, 24, "Error of the saving against processor time", 15, weight="600")]
    for time in (0.05, 0.1, 0.2, 0.5, 1):
        x, y = place(time, POINTS[0])
        parts += [f'<line x1="{x:.1f}" y1="{TOP}" x2="{x:.1f}" y2="{y:.1f}" stroke="#e3e6ea"/>', svg_text(round(x, 1), y + 18, f"{time:g}", 12, FAINT, "middle")]
    for points in (0.01, 0.1, 1, 10):
        x, y = place(TIMES[0], points)
        parts += [f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{LEFT + WIDTH}" y2="{y:.1f}" stroke="#e3e6ea"/>', svg_text(x - 8, round(y + 4, 1), f"{points:g}", 12, FAINT, "end")]
    parts.append(svg_text(LEFT + WIDTH / 2, TOP + HEIGHT + 40, "processor time over that of capturing and replaying everything", 12, FAINT, "middle"))
    parts.append(svg_text(-TOP - HEIGHT / 2, 20, "largest error, points (0.01 or less at the bottom)", 12, FAINT, "middle", more=' transform="rotate(-90)"'))
    x, y = place(1, 0)
    parts += [f'<rect x="{x - 6:.1f}" y="{y - 6:.1f}" width="12" height="12" fill="{INK}"/>', svg_text(round(x, 1), y - 14, "everything, timed", 12, anchor="middle")]
    medians = {}
    for number, (way, title) in enumerate(WAYS.items()):
        for time, points in found[way]:
            x, y = place(time, points)
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{COLOURS[way]}" fill-opacity="0.55"/>')
        middle = [sorted(values)[len(values) // 2] for values in zip(*found[way])]
        medians[way] = middle
        y = TOP + HEIGHT + 66 + 20 * (number // 2)
        x = LEFT + 290 * (number % 2)
        parts += [f'<circle cx="{x + 5}" cy="{y - 4}" r="5" fill="{COLOURS[way]}"/>', svg_text(x + 18, y, title, 13)]
    best = [way for way in medians if not any(other != way and all(a <= b for a, b in zip(medians[other], medians[way])) for other in medians)]
    line = " ".join("{:.1f},{:.1f}".format(*place(*medians[way])) for way in sorted(best, key=lambda way: medians[way]))
    parts.append(f'<polyline points="{line}" fill="none" stroke="{INK}" stroke-width="1.4" stroke-dasharray="5 4"/>')
    for way, middle in medians.items():
        x, y = place(*middle)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="8" fill="none" stroke="{COLOURS[way]}" stroke-width="3"/>')
    write_svg(study.picture("time-and-error"), LEFT + WIDTH + 30, TOP + HEIGHT + 110, parts)
    return medians, best


def run(study):
    rows, found, cells = [], {way: [] for way in WAYS}, {name: [] for name in PARTS}
    for camera in CAMERAS:
        of = stored(study, f"{camera[0]}-single", lambda: measured(study, camera))
        everything = of["capture_s"] + of["timed_s"]
        error = max(abs(of["functional"][cell] - true) for cell, true in of["truth"].items())
        ratio = (of["capture_s"] + of["functional_s"]) / everything
        found["functional"].append((ratio, error))
        rows.append([camera[0], "functional", f"{of['load_s']:.1f}", f"{of['capture_s']:.1f}", f"{of['functional_s']:.1f}", f"{everything:.1f}", f"{ratio:.2f}", "", one(error), ""])
        for name, part in of["parts"].items():
            # A prediction is functional, so it is compared with the functional replay.
            errors = [(abs(value - of["functional"][cell]), is_knee) for cell, (value, is_knee) in part["cells"].items()]
            inside, outside = ([error for error, is_knee in errors if is_knee == wanted] for wanted in (True, False))
            ratio = (part["capture_s"] + part["predict_s"]) / everything
            cells[name].append((ratio, ratio * everything / (of["capture_s"] + of["functional_s"]), inside, outside))
            found[name].append((ratio, max(outside, default=0)))
            rows.append([
                camera[0], name, f"{of['load_s']:.1f}", f"{part['capture_s']:.1f}", f"{part['predict_s']:.1f}", f"{everything:.1f}", f"{ratio:.2f}",
                len(inside), one(max(outside, default=None)), one(max(inside, default=None))])
    detail = f"one frame of {'x'.join(map(str, WHOLE_PX))} per eye on {MAIN}; L2 of {', '.join(map(str, L2_KIB))} KiB, two orders"
    study.write("single-frame", f"{detail}; processor times; everything is the capture and the timed replay",
                "scene | way | capture of 64x72 s | capture s | replay or prediction s | everything s | time over everything | inside a knee, of 6 | largest error outside knees, points | largest error inside, points", rows, machine())
    summary = []
    for name, of in cells.items():
        timed, functional = ([row[at] for row in of] for at in (0, 1))
        inside, outside = ([error for row in of for error in row[at]] for at in (2, 3))
        summary.append([
            name, len(of), sum(ratio <= 1 / 3 for ratio in timed), f"{min(timed):.2f} to {max(timed):.2f}",
            sum(ratio <= 1 / 3 for ratio in functional), f"{min(functional):.2f} to {max(functional):.2f}", len(outside) + len(inside), len(inside),
            sum(error <= 5 for error in outside + inside), one(max(outside)), one(max(inside))])
    study.write("single-frame-summary", detail,
                "capture, of the width | scenes | at most a third of the time | time over everything | at most a third with functional replay | time over capture and functional replay | cells | inside a knee | within 5 points | largest error outside knees, points | largest error inside, points", summary)
    for path in read_csv(study.results / "sampling-long.csv"):
        found["frames"].append((1 / float(path["times less"]), abs(float(path["error, points"]))))
    of_machines = [stored(study, f"{camera[0]}-machines", lambda: on_machines(study, camera)) for camera in CAMERAS]
    rows = []
    for name in MACHINES:
        inside, outside = ([abs(error) for of in of_machines for error, is_knee in of[name] if is_knee == wanted] for wanted in (True, False))
        rows.append([name, len(of_machines), len(inside) + len(outside), len(inside), one(max(outside, default=None)), one(max(inside, default=None))])
    study.write("single-frame-machines", f"one frame of {'x'.join(map(str, WHOLE_PX))} per eye on {MAIN}, from captures at half of the width; two orders",
                "machine | scenes | cells | inside a knee | largest error outside knees, points | largest error inside, points", rows)
    medians, best = draw(study, found)
    study.write("time-and-error", "medians of results/single-frame.csv and results/sampling-long.csv", "way | scenes or paths | time over everything | largest error, points | on the frontier",
                [[WAYS[way], len(found[way]), f"{time:.2f}", f"{points:.2f}", "yes" if way in best else "no"] for way, (time, points) in medians.items()])
