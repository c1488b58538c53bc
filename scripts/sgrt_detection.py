"""Tables of error detection from what scripts/sgrt-detection.sh measured: sgrt_detection.py RESULTS RULE..."""

import csv
import math
import sys

results, rules = sys.argv[1], sys.argv[2:]
DESIGN = ["teapot", "chess", "car", "lab", "music-box", "meadow"]
# Goal: FLIP below.
FLIP = 0.01


def rows(name):
    with open(name, newline="") as file:
        return [row for row in csv.DictReader(file) if row["run"] == "chosen"]


def write(name, heading, table):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write("# command: scripts/sgrt-detection.sh SCENES  (replay reproject, 2048x1024 per eye)\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def at_14_nm(of):
    """Geometric means of the bounds of relative energies on a 14 nm chip."""
    return "-".join(f"{mean([float(r[f'relative_energy_{end}']) for r in of]):.2f}" for end in ("least", "most"))


def scene(row):
    return row["scene"].rsplit("/")[-1]


def measured(row):
    """FLIP, energy and performance."""
    return tuple(float(row[key]) for key in ("flip_mean", "relative_energy", "relative_performance"))


cases = [("plain reuse, rows in DRAM", rows("plain.csv")), ("default of replay reproject", rows("default.csv"))]
cases += [(f"on chip: `{rule}`", rows(f"on-chip,{rule}.csv")) for rule in rules]
plain = {scene(r): float(r["relative_performance"]) for r in cases[0][1]}


def sets(of):
    return [(name, [r for r in of if (scene(r) in DESIGN) == (name == "design")]) for name in ("design", "held out")]


def write_tables():
    summary, single = [], []
    for name, found in cases:
        for label, of in sets(found):
            flips = {scene(r): measured(r)[0] for r in of}
            worst = max(flips, key=flips.get)
            faster = mean([measured(r)[2] / plain[scene(r)] for r in of])
            summary.append([name, label, f"{flips[worst]:.4f} ({worst})", sum(f < FLIP for f in flips.values()), len(flips),
                            f"{mean([measured(r)[2] for r in of]):.3f}", f"{100 * (faster - 1):+.1f}", f"{mean([measured(r)[1] for r in of]):.3f}",
                            f"{max(measured(r)[1] for r in of):.2f}", at_14_nm(of), f"{float(of[0]['detection_sram_kib']):.0f}"])
            for row in of:
                flip, energy, performance = measured(row)
                single.append([name, label, scene(row), f"{flip:.5f}", f"{energy:.3f}", f"{performance:.3f}", f"{float(row['detection_sram_kib']):.0f}"])
    write("sgrt-detection", ["detection", "scenes", "worst FLIP", "scenes below 0.01", "of", "performance", "against plain reuse %", "energy", "worst energy",
                             "energy at 14 nm", "row buffers KiB"], summary)
    write("sgrt-detection-scenes", ["detection", "set", "scene", "FLIP", "energy", "performance", "row buffers KiB"], single)


write_tables()
