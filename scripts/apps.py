"""Measures captures of unmodified programs: `apps.py BIN OUT TABLE.csv`, called by apps.sh.

For each program: draws whose records equal the driver's occlusion query, times of frames with and without the layer (in
turns, medians), and what the Z2 orders save against Morton order in the trace.
"""

import csv
import json
import os
import platform
import re
import statistics
import subprocess
import sys

TURNS = int(os.environ.get("TURNS", "3"))
FIRST, COUNT = 10, 6
BIN, OUT, TABLE = sys.argv[1:]
SITE = f"{OUT}/site"
IWER = ["--iwer", f"{SITE}/node_modules/iwer/build/iwer.min.js"]
# Name, page, query, more options of `tracegen page`.
PAGES = [
    ("three.js StereoEffect", "three.html", "?mode=stereo", []),
    ("three.js with shadows", "three.html", "?mode=stereo&shadows=1", []),
    # Chromium's own drawing is at times more than half of a frame, so the rule is named.
    ("three.js in WebXR", "three.html", "?mode=xr", [*IWER, "--eyes", "halves"]),
    ("Babylon.js VR camera", "babylon.html", "?mode=vr", []),
    ("Babylon.js VR camera, lens pass", "babylon.html", "?mode=lens", []),
]
ORDERS = ["morton", "z2-lrta", "z2-sta"]
COLUMNS = [
    "program", "eyes by", "pixels per eye", "draws", "draws equal to their query", "draws that differ", "draws not compared",
    "fragments", "plain ms per frame", "with the layer, not recorded", "recorded", "recorded over plain",
    "not recorded over plain", "texture MB, Morton", "Z2 LRTA saves %", "Z2 STA saves %", "left out",
]


def run(command, allowed=(0,)):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in allowed:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
    return done


def found(pattern, text):
    match = re.search(pattern, text)
    if not match:
        sys.exit(f"apps.py: expected {pattern!r} in\n{text}")
    return match.groups()


def page_times(options):
    """Milliseconds of a frame before the recorded ones, and of one of these."""
    text = run([f"{BIN}/tracegen", "page", *options]).stderr
    before, captured = found(r"milliseconds per frame: ([\d.]+) before, ([\d.]+) captured", text)
    return float(before), float(captured)


def measure_page(page, query, more):
    base = [f"{SITE}/{page}", "--query", query, *more]
    window = ["--frames", f"{FIRST}..{FIRST + COUNT}", "-o", f"{OUT}/timed.textrace"]
    plain, idle, recorded = [], [], []
    for _ in range(TURNS):
        plain.append(page_times([*base, *window, "--plain"])[1])
        before, captured = page_times([*base, *window])
        idle.append(before)
        recorded.append(captured)
    return [statistics.median(times) for times in (plain, idle, recorded)]


def describe(name, options, times):
    trace = f"{OUT}/{re.sub('[^a-z0-9]+', '-', name.lower())}.textrace"
    # Exit code 1 where a draw differs, which the table then tells.
    said = run([f"{BIN}/tracegen", "page", *options, "--check", "-o", trace], allowed=(0, 1)).stderr
    equal, different = found(r"occlusion queries: (\d+) draws equal, (\d+) different", said)
    apart = re.findall(r"not compared: (.*) \((\d+) draws\)", said)
    width, height, rule, draws = found(r"of (\d+)x(\d+) px per eye by (.*): (\d+) draws", said)
    fragments = found(r"quads, (\d+) fragments", said)[0]
    left_out = re.findall(r"not in the trace, or less exactly: (.*)", said)
    bytes_of = {}
    for order in ORDERS:
        text = run([f"{BIN}/replay", "run", trace, "--order", order, "--json"]).stdout
        bytes_of[order] = json.loads(text)["result"]["external_bytes"]
    saved = [100 * (1 - bytes_of[order] / bytes_of["morton"]) for order in ORDERS[1:]]
    plain, idle, recorded = times
    return [
        name, rule, f"{width}x{height}", draws, equal, different, "; ".join(f"{n}: {why}" for why, n in apart) or "0",
        fragments, f"{plain:.1f}", f"{idle:.1f}", f"{recorded:.1f}", f"{recorded / plain:.2f}", f"{idle / plain:.2f}",
        f"{bytes_of['morton'] / 1e6:.2f}", *(f"{value:.1f}" for value in saved), "; ".join(left_out) or "nothing",
    ]


def version(command):
    text = subprocess.run(command, capture_output=True, text=True).stdout
    return text.strip().splitlines()[0] if text.strip() else "unknown"


def main():
    rows = []
    for name, page, query, more in PAGES:
        print(f"measuring {name}", file=sys.stderr)
        options = [f"{SITE}/{page}", "--query", query, *more]
        rows.append(describe(name, options, measure_page(page, query, more)))
    os.remove(f"{OUT}/timed.textrace")
    with open(TABLE + ".new", "w", newline="") as file:
        file.write("# command: RESULTS=1 scripts/apps.sh\n")
        file.write(f"# machine: {os.cpu_count()} cores, {platform.machine()}, load average {os.getloadavg()[0]:.1f} at the end\n")
        file.write(f"# programs: {version(['chromium', '--version'])}; versions of the libraries in apps/package-lock.json\n")
        file.write(f"# times: medians of {TURNS} turns of {COUNT} frames; frame {FIRST} is in the trace\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(rows)
    os.replace(TABLE + ".new", TABLE)


main()
