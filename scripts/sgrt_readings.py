"""Tables of docs/results/sgrt-readings.md from what scripts/sgrt-readings.sh measured: sgrt_readings.py RESULTS"""

import csv
import math
import sys

results = sys.argv[1]
PAPER_SIZE = "2048x1024"
DESIGN = ["teapot", "chess", "car", "lab", "music-box", "meadow"]


def rows(name):
    with open(name, newline="") as file:
        return list(csv.DictReader(file))


def write(name, command, heading, table):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write(f"# command: scripts/sgrt-readings.sh SCENES  ({command})\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def rms(of):
    """Root mean square of ln(ours / paper), performance and energy alike."""
    logs = [math.log(float(r[f"relative_{what}"]) / float(r[f"paper_relative_{what}"])) for r in of for what in ("performance", "energy")]
    return math.sqrt(sum(x * x for x in logs) / len(logs))


def at_14_nm(of):
    """Geometric means of the bounds of relative energies on a 14 nm chip."""
    return "-".join(f"{mean([float(r[f'relative_energy_{end}']) for r in of]):.2f}" for end in ("least", "most"))


def by_reading(size):
    found = {}
    for row in rows(f"readings,{size}.csv"):
        found.setdefault(int(row["reading"]), []).append(row)
    return found


table = []
for number, of in by_reading(PAPER_SIZE).items():
    first = of[0]
    sets = [[r for r in of if r["set"] == name] for name in ("calibration", "test")]
    energies = [float(r["relative_energy"]) for r in of]
    table.append([number, first["scope"], first["reuse"], first["rule"], first["row_test"], first["gbuffer"], *(f"{rms(s):.3f}" for s in sets),
                  f"{mean([float(r['relative_performance']) for r in of]):.2f}", f"{mean(energies):.2f}", f"{min(energies):.2f}",
                  f"{max(energies):.2f}", at_14_nm(of), f"{sum(e < 1 for e in energies)} of {len(energies)}"])
write("sgrt-all-readings", f"replay readings *.raytrace --calibrate teapot,chess,music-box, {PAPER_SIZE} per eye",
      ["reading", "measured of", "reused", "rule", "tested against", "G-buffer", "from the paper: calibration", "test scenes", "performance",
       "energy", "least", "most", "energy at 14 nm", "scenes that save energy"], table)

chosen = [r for r in rows(f"readings,{PAPER_SIZE}.csv") if r["chosen"] == "true"]
default = {r["scene"]: r for r in rows(f"readings,{PAPER_SIZE}.csv")
           if (r["scope"], r["reuse"], r["rule"], r["row_test"], r["gbuffer"]) == ("whole frame", "primary", "default", "arrivals", "tile")}
table = []
for row in sorted(chosen, key=lambda r: (r["set"], DESIGN.index(r["scene"]))):
    two = lambda r, key: f"{float(r[key]):.2f}"
    other = default[row["scene"]]
    table.append([row["scene"], row["set"], two(row, "paper_relative_performance"), two(row, "relative_performance"), two(other, "relative_performance"),
                  two(row, "paper_relative_energy"), two(row, "relative_energy"), two(other, "relative_energy"),
                  at_14_nm([row]), row["paper_frames_per_second"], f"{float(row['frames_per_second']):.1f}"])
write("sgrt-figure-3", f"replay readings, {PAPER_SIZE} per eye: the reading closest on the calibration scenes, and the default of replay reproject",
      ["scene", "set", "performance: paper", "performance: preset", "performance: default", "energy: paper", "energy: preset", "energy: default", "energy: preset at 14 nm",
       "frames per second: paper", "frames per second: preset"], table)

table = []
for size in ("512x512", "1024x1024", PAPER_SIZE):
    of = by_reading(size)
    fits = {n: [rms([r for r in rs if r["set"] == name]) for name in ("calibration", "test")] for n, rs in of.items()}
    best = min(fits, key=lambda n: fits[n][0])
    first = of[best][0]
    table.append([size, best, first["scope"], first["reuse"], first["rule"], *(f"{x:.3f}" for x in fits[best])])
write("sgrt-sizes", "replay readings at each size per eye", ["size per eye", "closest reading", "measured of", "reused", "rule",
      "from the paper: calibration", "test scenes"], table)
