"""The SGRT paper's figure 3 under every reading, at three sizes."""

import math

from .common import SGRT_SCENES, energy_14_nm, geometric_mean, mean

PAPER_SIZE = "2048x1024"
SIZES = ["512x512", "1024x1024", PAPER_SIZE]
SETS = ["calibration", "test"]
READING = ["scope", "reuse", "rule", "row_test", "gbuffer"]


def by_reading(rows):
    found = {}
    for row in rows:
        found.setdefault(int(row["reading"]), []).append(row)
    return found


def distances(rows):
    """From the paper, of the scenes of each set: root mean square of ln(ours / paper), performance and energy alike."""
    for name in SETS:
        logs = [math.log(float(row[f"relative_{what}"]) / float(row[f"paper_relative_{what}"]))
                for row in rows if row["set"] == name for what in ("performance", "energy")]
        yield math.sqrt(mean(x * x for x in logs))


def every_reading(study, readings):
    table = []
    for number, rows in readings.items():
        energies = [float(row["relative_energy"]) for row in rows]
        table.append([
            number, *(rows[0][key] for key in READING), *(f"{x:.3f}" for x in distances(rows)),
            f"{geometric_mean(float(row['relative_performance']) for row in rows):.2f}", f"{geometric_mean(energies):.2f}", f"{min(energies):.2f}",
            f"{max(energies):.2f}", energy_14_nm(rows), f"{sum(energy < 1 for energy in energies)} of {len(energies)}"])
    study.write(
        "sgrt-all-readings", f"replay readings *.raytrace --calibrate teapot,chess,music-box, {PAPER_SIZE} per eye",
        "reading | measured of | reused | rule | tested against | G-buffer | from the paper: calibration | test scenes | performance | energy | least | most | "
        "energy at 14 nm | scenes that save energy", table)


def figure_3(study, rows, default):
    chosen = [row for row in rows if row["chosen"] == "true"]
    table = []
    for row in sorted(chosen, key=lambda row: (row["set"], SGRT_SCENES.index(row["scene"]))):
        cells = [f"{float(of[start + what]):.2f}" for what in ("relative_performance", "relative_energy")
                 for of, start in ((row, "paper_"), (row, ""), (default[row["scene"]], ""))]
        table.append([row["scene"], row["set"], *cells, energy_14_nm([row]), row["paper_frames_per_second"], f"{float(row['frames_per_second']):.1f}"])
    study.write(
        "sgrt-figure-3", f"replay readings, {PAPER_SIZE} per eye: the reading closest on the calibration scenes, and the default of replay reproject",
        "scene | set | performance: paper | performance: preset | performance: default | energy: paper | energy: preset | energy: default | "
        "energy: preset at 14 nm | frames per second: paper | frames per second: preset", table)


def run(study):
    sizes = []
    for size in SIZES:
        traces = [study.rays(scene, f"--size {size}", name=f"{size}/{scene}") for scene in SGRT_SCENES]
        rows = study.csv("readings", *traces, "--calibrate teapot,chess,music-box")
        default = {row["scene"]: row for row in study.csv("reproject", *traces) if row["run"] == "chosen"}
        study.drop(*traces)
        readings = by_reading(rows)
        fits = {number: list(distances(of)) for number, of in readings.items()}
        best = min(fits, key=lambda number: fits[number][0])
        sizes.append([size, best, *(readings[best][0][key] for key in READING[:3]), *(f"{x:.3f}" for x in fits[best])])
    # The last size is the paper's.
    every_reading(study, readings)
    figure_3(study, rows, default)
    study.write(
        "sgrt-sizes", "replay readings at each size per eye",
        "size per eye | closest reading | measured of | reused | rule | from the paper: calibration | test scenes", sizes)
