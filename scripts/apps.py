"""Measures captures of unmodified programs: `apps.py BIN OUT TABLE.csv`, called by apps.sh.

For each program: draws whose records equal the driver's occlusion query, whether pictures are the same with and without
the layer, times of frames with and without the layer (in turns, medians), peak memory, and what the Z2 orders save against
Morton order in the trace.
"""

import csv
import json
import os
import hashlib
import platform
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

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
# A game of OpenGL in anaglyph stereo. `apitrace` keeps its calls, so that every replay renders the same frames.
GAME = "OpenArena (OpenGL, apitrace)"
GAME_PROGRAM = "/usr/games/openarena"
GAME_SETTINGS = (
    "+set r_fullscreen 0 +set r_mode -1 +set r_customwidth 640 +set r_customheight 480 +set s_initsound 0 "
    "+set r_anaglyphMode 1 +set com_maxfps 30 +set timedemo 1 +map oa_dm1 +wait 150 +quit"
).split()
ZINK = {"GALLIUM_DRIVER": "zink", "MESA_LOADER_DRIVER_OVERRIDE": "zink", "LIBGL_ALWAYS_SOFTWARE": "1"}
# A native Vulkan program with its levels of detail, effects and menus. It has no stereo mode, and does not repeat its frames.
KART = "SuperTuxKart (Vulkan, one eye)"
KART_PROGRAM = "/usr/games/supertuxkart"
KART_SETTINGS = (
    "--render-driver=vulkan --windowed --screensize=640x480 -N --track=cocoa_temple --numkarts=2 --no-sound --profile-time=600"
).split()
KART_FIRST = 100
COLUMNS = [
    "program", "eyes by", "pixels per eye", "draws", "draws equal to their query", "draws that differ", "draws not compared",
    "fragments", "plain ms per earlier frame", "with the layer, not recorded", "plain ms per frame", "recorded", "recorded over plain",
    "not recorded over plain", "pictures", "plain peak MB", "recorded peak MB", "texture MB, Morton", "Z2 LRTA saves %",
    "Z2 STA saves %", "left out",
]


def run(command, allowed=(0,), environment=None):
    """Output, standard error, and the peak memory in MB of the largest process."""
    streams = [tempfile.TemporaryFile(mode="w+") for _ in range(2)]
    started = subprocess.Popen(command, stdout=streams[0], stderr=streams[1], env={**os.environ, **(environment or {})})
    _, status, usage = os.wait4(started.pid, 0)
    started.returncode = os.waitstatus_to_exitcode(status)
    texts = []
    for stream in streams:
        stream.seek(0)
        texts.append(stream.read())
        stream.close()
    if started.returncode not in allowed:
        sys.exit(f"{' '.join(command)}: exit code {started.returncode}\n{texts[1]}")
    return texts[0], texts[1], usage.ru_maxrss / 1e3


def found(pattern, text):
    match = re.search(pattern, text)
    if not match:
        sys.exit(f"apps.py: expected {pattern!r} in\n{text}")
    return match.groups()


def note_times(text):
    """Milliseconds of a frame before the recorded ones, and of one of these."""
    return [float(time) for time in found(r"milliseconds per frame: ([\d.]+) before, ([\d.]+) captured", text)]


def measure(plain_frames, capture):
    """Medians over turns: ms of the plain frames before the recorded ones, and of the same frames without records; ms of the
    recorded frames plain and recorded; peak MB plain and recorded.

    `plain_frames` returns both milliseconds and the peak memory, `capture` what `run` does.
    """
    turns = []
    for _ in range(TURNS):
        plain_before, plain, plain_peak = plain_frames()
        _, said, peak = capture()
        before, recorded = note_times(said)
        turns.append([plain_before, before, plain, recorded, plain_peak, peak])
    return [statistics.median(column) for column in zip(*turns)]


def digest(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def describe_page(name, page, query, more):
    base = [f"{BIN}/tracegen", "page", f"{SITE}/{page}", "--query", query, *more]
    window = ["--frames", f"{FIRST}..{FIRST + COUNT}", "-o", f"{OUT}/timed.textrace"]

    def plain_frames():
        _, said, peak = run([*base, *window, "--plain"])
        return *note_times(said), peak

    measured = measure(plain_frames, lambda: run([*base, *window]))
    plain = []
    for number in range(2):
        picture = f"{OUT}/plain-{number}.png"
        run([*base, "--plain", "--image", picture, "-o", f"{OUT}/timed.textrace"])
        plain.append(digest(picture))
        os.remove(picture)
    trace, picture = trace_of(name), f"{OUT}/captured.png"
    # Exit code 1 if a draw differs, which the table then shows.
    _, said, _ = run([*base, "--check", "--image", picture, "-o", trace], allowed=(0, 1))
    same = "equal" if digest(picture) in plain else "different"
    pictures = same if plain[0] == plain[1] else f"{same}; two plain runs differ"
    return row(name, trace, said, measured, pictures)


def frame_times(text):
    """Milliseconds between the ends of a replay's frames, from glretrace's profile."""
    ends = [int(end) / 1e6 for end in re.findall(r"^rendering_finished (\d+)", text, re.M)]
    return [b - a for a, b in zip(ends, ends[1:])]


def describe_game():
    calls = f"{OUT}/openarena.trace"
    screen = ["xvfb-run", "-a"]
    missing = [program for program in ("xvfb-run", "apitrace", GAME_PROGRAM) if not shutil.which(program)]
    if missing:
        print(f"SKIPPED: {GAME}: {', '.join(missing)} is absent", file=sys.stderr)
        return None
    if not os.path.exists(calls):
        run([*screen, "apitrace", "trace", "-o", calls + ".new", GAME_PROGRAM, *GAME_SETTINGS])
        os.replace(calls + ".new", calls)
    listed, _, _ = run(["apitrace", "dump", "--calls=frame", "--color=never", calls])
    frames = len(re.findall("SwapBuffers", listed))
    first = frames - 2 * COUNT
    replay = ["glretrace", calls]
    base = [*screen, f"{BIN}/tracegen", "app"]

    def plain_frames():
        profile, _, peak = run([*screen, "glretrace", "--pframe-times", calls], environment=ZINK)
        times = frame_times(profile)
        # tracegen, too, takes the second half of the frames before.
        return statistics.median(times[first // 2 : first]), statistics.median(times[first : first + COUNT]), peak

    window = ["--frames", f"{first}..{first + COUNT}", "-o", f"{OUT}/timed.textrace", "--apitrace", calls]
    measured = measure(plain_frames, lambda: run([*base, *window]))
    hashes = ["-b", "-s", "-", "--snapshot-format=MD5"]
    plain, _, _ = run([*screen, "glretrace", *hashes, calls], environment=ZINK)
    every = ["--gl", "--to-end", "--frames", f"{first}..{first + COUNT}", "-o", f"{OUT}/timed.textrace", "--"]
    captured, _, _ = run([*base, *every, "glretrace", *hashes, calls])
    pairs = list(zip(*(re.findall("^[0-9A-F]{32}$", text, re.M) for text in (plain, captured))))
    pictures = f"{sum(a == b for a, b in pairs)} of {len(pairs)} equal"
    trace = trace_of(GAME)
    one = ["--check", "--frames", str(first), "-o", trace, "--apitrace", calls]
    _, said, _ = run([*base, *one], allowed=(0, 1))
    return row(GAME, trace, said, measured, pictures)


def describe_kart():
    missing = [program for program in ("xvfb-run", KART_PROGRAM) if not shutil.which(program)]
    if missing:
        print(f"SKIPPED: {KART}: {', '.join(missing)} is absent", file=sys.stderr)
        return None
    home = tempfile.mkdtemp()
    os.environ.update({"HOME": home, "XDG_CONFIG_HOME": home, "XDG_RUNTIME_DIR": home})
    base = ["xvfb-run", "-a", f"{BIN}/tracegen", "app", "--eyes", "mono"]
    program = ["--", KART_PROGRAM, *KART_SETTINGS]
    window = [f"{KART_FIRST}..{KART_FIRST + COUNT}", "-o", f"{OUT}/timed.textrace"]
    # Without the layer there is no time per frame. The largest memory without records is that of a run that lists a frame.
    _, _, plain_peak = run([*base, "--list", "--frames", f"{KART_FIRST}..{KART_FIRST + 1}", *program])
    turns = []
    for _ in range(TURNS):
        _, said, peak = run([*base, "--frames", *window, *program])
        before, recorded = note_times(said)
        turns.append([before, recorded, peak])
    before, recorded, peak = (statistics.median(column) for column in zip(*turns))
    measured = [None, before, None, recorded, plain_peak, peak]
    trace = trace_of(KART)
    _, said, _ = run([*base, "--check", "--frames", f"{KART_FIRST}..{KART_FIRST + 1}", "-o", trace, *program], allowed=(0, 1))
    shutil.rmtree(home)
    return row(KART, trace, said, measured, "not compared")


def trace_of(name):
    return f"{OUT}/{re.sub('[^a-z0-9]+', '-', name.lower()).strip('-')}.textrace"


def row(name, trace, said, measured, pictures):
    equal, different = found(r"occlusion queries: (\d+) draws equal, (\d+) different", said)
    apart = re.findall(r"not compared: (.*) \((\d+) draws\)", said)
    width, height, rule, draws = found(r"of (\d+)x(\d+) px per eye by (.*): (\d+) draws", said)
    fragments = found(r"quads, (\d+) fragments", said)[0]
    left_out = re.findall(r"not in the trace, or less exactly: (.*)", said)
    bytes_of = {}
    for order in ORDERS:
        text, _, _ = run([f"{BIN}/replay", "run", trace, "--order", order, "--json"])
        bytes_of[order] = json.loads(text)["result"]["external_bytes"]
    saved = [100 * (1 - bytes_of[order] / bytes_of["morton"]) for order in ORDERS[1:]]
    plain_before, before, plain, recorded, plain_peak, peak = measured
    pairs = [(recorded, plain), (before, plain_before)]
    over_plain = [f"{time / of:.2f}" if of else "-" for time, of in pairs]
    return [
        name, rule, f"{width}x{height}", draws, equal, different, "; ".join(f"{n}: {why}" for why, n in apart) or "0",
        fragments, *(f"{time:.1f}" if time else "-" for time in (plain_before, before, plain, recorded)), *over_plain,
        pictures, f"{plain_peak:.0f}", f"{peak:.0f}", f"{bytes_of['morton'] / 1e6:.2f}",
        *(f"{value:.1f}" for value in saved), "; ".join(left_out) or "nothing",
    ]


def version(command):
    text = subprocess.run(command, capture_output=True, text=True).stdout
    return text.strip().splitlines()[0] if text.strip() else "unknown"


def main():
    rows = []
    for page in PAGES:
        print(f"measuring {page[0]}", file=sys.stderr)
        rows.append(describe_page(*page))
    for name, describe in ((GAME, describe_game), (KART, describe_kart)):
        print(f"measuring {name}", file=sys.stderr)
        rows += [described for described in [describe()] if described]
    os.remove(f"{OUT}/timed.textrace")
    with open(TABLE + ".new", "w", newline="") as file:
        file.write("# command: RESULTS=1 scripts/apps.sh\n")
        file.write(f"# machine: {os.cpu_count()} cores, {platform.machine()}, load average {os.getloadavg()[0]:.1f} at the end\n")
        file.write(f"# programs: {version(['chromium', '--version'])}; versions of the libraries in apps/package-lock.json\n")
        file.write(f"# times: medians of {TURNS} turns of {COUNT} frames, and of frames before them; frame {FIRST} is in the trace\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(rows)
    os.replace(TABLE + ".new", TABLE)


main()
