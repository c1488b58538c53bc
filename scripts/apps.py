"""Measures captures of unmodified programs: `apps.py BIN OUT TABLE.csv`, called by apps.sh.

For each program: draws whose records equal the driver's occlusion query, times of frames with and without the layer (in
turns, medians), and what the Z2 orders save against Morton order in the trace.
"""

import csv
import json
import os
import platform
import re
import shutil
import statistics
import subprocess
import sys
import time

TURNS = int(os.environ.get("TURNS", "3"))
FIRST, COUNT = 10, 6
BIN, OUT, TABLE = sys.argv[1:]
SITE = f"{OUT}/site"
IWER = ["--iwer", f"{SITE}/node_modules/iwer/build/iwer.min.js"]
# Name, page, query, more options of `tracegen page`.
PAGES = [
    ("three.js StereoEffect", "three.html", "?mode=stereo", []),
    ("three.js with shadows", "three.html", "?mode=stereo&shadows=1", []),
    ("three.js in WebXR", "three.html", "?mode=xr", IWER),
    ("Babylon.js VR camera", "babylon.html", "?mode=vr", []),
    ("Babylon.js VR camera, lens pass", "babylon.html", "?mode=lens", []),
]
# Name, arguments of `tracegen app`, the program with its arguments; `{frames}` is the number of frames.
PROGRAMS = [
    ("vkcube", ["--eyes", "mono"], ["xvfb-run", "-a", "vkcube", "--c", "{frames}", "--width", "640", "--height", "640"]),
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


def seconds(command):
    start = time.monotonic()
    run(command)
    return time.monotonic() - start


def measure_program(options, command):
    """Whole runs of `frames` frames, less runs of a few, so that the start does not count."""
    few, many = 10, 10 + 10 * COUNT

    def of(frames, recorded):
        program = [part.format(frames=frames) for part in command]
        if recorded is None:
            return seconds(program)
        window = f"5..{5 + max(recorded, 1)}" if recorded else "0..1"
        capture = [f"{BIN}/tracegen", "app", *options, "--to-end", "--frames", window, "-o", f"{OUT}/timed.textrace", "--"]
        return seconds([*capture, *program])

    plain, idle, record = [], [], []
    for _ in range(TURNS):
        plain.append((of(many, None) - of(few, None)) / (many - few))
        idle.append((of(many, 0) - of(few, 0)) / (many - few))
        record.append((of(many, COUNT + 1) - of(many, 1)) / COUNT)
    plain, idle, record = (1000 * statistics.median(times) for times in (plain, idle, record))
    return [plain, idle, record + idle]


def describe(name, capture, times):
    trace = f"{OUT}/{re.sub('[^a-z0-9]+', '-', name.lower())}.textrace"
    said = run([*capture(trace)], allowed=(0, 1)).stderr
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
    rows, driver = [], "unknown"
    for name, page, query, more in PAGES:
        print(f"measuring {name}", file=sys.stderr)
        options = [f"{SITE}/{page}", "--query", query, *more]
        capture = lambda trace: [f"{BIN}/tracegen", "page", *options, "--check", "-o", trace]  # noqa: E731
        rows.append(describe(name, capture, measure_page(page, query, more)))
    for name, options, command in PROGRAMS:
        if not all(shutil.which(part) for part in (command[0], command[2])):
            print(f"{name} is left out: it is not installed", file=sys.stderr)
            continue
        print(f"measuring {name}", file=sys.stderr)
        program = [part.format(frames=FIRST + 10) for part in command]
        capture = lambda trace: [f"{BIN}/tracegen", "app", *options, "--check", "-o", trace, "--", *program]  # noqa: E731
        rows.append(describe(name, capture, measure_program(options, command)))
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
