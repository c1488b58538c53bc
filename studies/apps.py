"""Captures of unmodified programs: records against occlusion queries, pictures, times and memory with the layer, and what tile orders save.

Installs Chromium and npm from Debian, and the libraries of apps/package-lock.json from npm; about ten minutes. OpenArena needs xvfb and apitrace,
SuperTuxKart needs xvfb; a game that is absent is skipped with a line.
"""

import hashlib
import re
import shutil
import statistics
import sys
import tempfile

from .common import ROOT, Absent, Failed, execute, machine, needs

OPTIONS = {
    "--two-pages": dict(action="store_true", help="only capture and replay a page of three.js and one of Babylon.js; no table"),
    "--turns": dict(type=int, default=3, help="measurements of each time (3)"),
}
FIRST, COUNT = 10, 6
# Name, page, query, more options of `tracegen page`.
PAGES = [
    ("three.js StereoEffect", "three.html", "?mode=stereo", ""),
    ("three.js with shadows", "three.html", "?mode=stereo&shadows=1", ""),
    # Chromium's own drawing is at times more than half of a frame, so the rule is named.
    ("three.js in WebXR", "three.html", "?mode=xr", "--iwer node_modules/iwer/build/iwer.min.js --eyes halves"),
    ("Babylon.js VR camera", "babylon.html", "?mode=vr", ""),
    ("Babylon.js VR camera, lens pass", "babylon.html", "?mode=lens", ""),
]
TWO_PAGES = [("three-stereo", "three.html", "?mode=stereo"), ("babylon-vr", "babylon.html", "?mode=vr")]
# A game of OpenGL in anaglyph stereo. `apitrace` keeps its calls, so that every replay renders the same frames.
GAME = "OpenArena (OpenGL, apitrace)"
GAME_PROGRAM = "/usr/games/openarena"
GAME_SETTINGS = (
    "+set r_fullscreen 0 +set r_mode -1 +set r_customwidth 640 +set r_customheight 480 +set s_initsound 0 "
    "+set r_anaglyphMode 1 +set com_maxfps 30 +set timedemo 1 +map oa_dm1 +wait 150 +quit"
)
ZINK = {"GALLIUM_DRIVER": "zink", "MESA_LOADER_DRIVER_OVERRIDE": "zink", "LIBGL_ALWAYS_SOFTWARE": "1"}
# A native Vulkan program with its levels of detail, effects and menus. It has no stereo mode, and does not repeat its frames.
KART = "SuperTuxKart (Vulkan, one eye)"
KART_PROGRAM = "/usr/games/supertuxkart"
KART_SETTINGS = "--render-driver=vulkan --windowed --screensize=640x480 -N --track=cocoa_temple --numkarts=2 --no-sound --profile-time=600"
KART_FIRST = 100
SCREEN = "xvfb-run -a"
COLUMNS = (
    "program | eyes by | pixels per eye | draws | draws equal to their query | draws that differ | draws not compared | fragments | "
    "plain ms per earlier frame | with the layer, not recorded | plain ms per frame | recorded | recorded over plain | not recorded over plain | "
    "pictures | plain peak MB | recorded peak MB | texture MB, Morton | Z2 LRTA saves % | Z2 STA saves % | left out")


def install(site):
    """The pages and their libraries, in a folder."""
    execute(ROOT / "scripts/install-deps.sh", "apps")
    for source in ("pages", "package.json", "package-lock.json"):
        source = ROOT / "apps" / source
        if source.is_dir():
            shutil.copytree(source, site, dirs_exist_ok=True)
        else:
            shutil.copy(source, site)
    lock, installed = site / "package-lock.json", site / "node_modules/.installed"
    if not installed.exists() or installed.read_bytes() != lock.read_bytes():
        execute("npm ci --no-audit --no-fund --ignore-scripts --loglevel error", folder=site)
        shutil.copy(lock, installed)


def found(pattern, text):
    match = re.search(pattern, text)
    if not match:
        raise Failed(f"expected {pattern!r} in\n{text}")
    return match.groups()


def frame_range(first, count=COUNT):
    return f"--frames {first}..{first + count}"


def note_times(text):
    """Milliseconds of a frame before the recorded ones, and of one of these."""
    return [float(time) for time in found(r"milliseconds per frame: ([\d.]+) before, ([\d.]+) captured", text)]


def measure(turns, plain_frames, capture):
    """Medians over turns: ms of the plain frames before the recorded ones, and of the same frames without records; ms of the
    recorded frames plain and recorded; peak MB plain and recorded.

    `plain_frames` returns both milliseconds and the peak memory, `capture` what `execute` does.
    """
    rows = []
    for _ in range(turns):
        plain_before, plain, plain_peak = plain_frames()
        done = capture()
        before, recorded = note_times(done.err)
        rows.append([plain_before, before, plain, recorded, plain_peak, done.peak_mb])
    # A time that cannot be had is None in every turn.
    return [None if None in column else statistics.median(column) for column in zip(*rows)]


class Programs:
    """Measures each program and returns its row."""

    def __init__(self, study, site):
        self.study, self.site, self.turns = study, site, study.options.turns
        self.timed = study.out / "timed.textrace"

    def page(self, name, page, query, more):
        # The browser's files are named from the folder of the pages.
        capture = lambda *words, **also: self.study.tracegen("page", self.site / page, "--query", query, more, *words, folder=self.site, **also)
        window = [frame_range(FIRST), "-o", self.timed]

        def plain_frames():
            done = capture(*window, "--plain")
            return *note_times(done.err), done.peak_mb

        measured = measure(self.turns, plain_frames, lambda: capture(*window))
        picture, digests = self.study.out / "picture.png", []
        trace = self.trace(name)
        # Exit code 1 if a draw differs, which the table then shows.
        for kind, output, allowed in (("--plain", self.timed, (0,)), ("--plain", self.timed, (0,)), ("--check", trace, (0, 1))):
            done = capture("--image", picture, kind, "-o", output, allowed=allowed)
            digests.append(hashlib.sha256(picture.read_bytes()).digest())
        picture.unlink()
        *plain, captured = digests
        same = "equal" if captured in plain else "different"
        return self.row(name, trace, done.err, measured, same if plain[0] == plain[1] else f"{same}; two plain runs differ")

    def game(self):
        needs("xvfb-run", "apitrace", GAME_PROGRAM)
        calls = self.study.out / "openarena.trace"
        if not calls.exists():
            new = calls.with_suffix(".trace.new")
            execute(SCREEN, "apitrace trace -o", new, GAME_PROGRAM, GAME_SETTINGS)
            new.replace(calls)
        frames = len(re.findall("SwapBuffers", execute("apitrace dump --calls=frame --color=never", calls).out))
        first = frames - 2 * COUNT
        capture = lambda *words, **also: execute(SCREEN, self.study.bin / "tracegen", "app", *words, **also)

        def plain_frames():
            done = execute(SCREEN, "glretrace --pframe-times", calls, **ZINK)
            ends = [int(end) / 1e6 for end in re.findall(r"^rendering_finished (\d+)", done.out, re.M)]
            times = [b - a for a, b in zip(ends, ends[1:])]
            # tracegen, too, takes the second half of the frames before.
            return statistics.median(times[first // 2 : first]), statistics.median(times[first : first + COUNT]), done.peak_mb

        window = [frame_range(first), "-o", self.timed]
        measured = measure(self.turns, plain_frames, lambda: capture(*window, "--apitrace", calls))
        hashes = ["glretrace -b -s - --snapshot-format=MD5", calls]
        texts = [execute(SCREEN, *hashes, **ZINK).out, capture("--gl --to-end", *window, "--", *hashes).out]
        pairs = list(zip(*(re.findall("^[0-9A-F]{32}$", text, re.M) for text in texts)))
        trace = self.trace(GAME)
        said = capture(f"--check --frames {first} -o", trace, "--apitrace", calls, allowed=(0, 1)).err
        return self.row(GAME, trace, said, measured, f"{sum(a == b for a, b in pairs)} of {len(pairs)} equal")

    def kart(self):
        needs("xvfb-run", KART_PROGRAM)
        with tempfile.TemporaryDirectory() as home:
            environment = {"HOME": home, "XDG_CONFIG_HOME": home, "XDG_RUNTIME_DIR": home}
            capture = lambda *words, **also: execute(
                SCREEN, self.study.bin / "tracegen", "app --eyes mono", *words, "--", KART_PROGRAM, KART_SETTINGS, **also, **environment)
            # Without the layer there is no time per frame. The largest memory without records is that of a run that lists a frame.
            peak = capture("--list", frame_range(KART_FIRST, 1)).peak_mb
            measured = measure(self.turns, lambda: (None, None, peak), lambda: capture(frame_range(KART_FIRST), "-o", self.timed))
            trace = self.trace(KART)
            said = capture("--check", frame_range(KART_FIRST, 1), "-o", trace, allowed=(0, 1)).err
        return self.row(KART, trace, said, measured, "not compared")

    def trace(self, name):
        return self.study.out / f"{re.sub('[^a-z0-9]+', '-', name.lower()).strip('-')}.textrace"

    def row(self, name, trace, said, measured, pictures):
        equal, different = found(r"occlusion queries: (\d+) draws equal, (\d+) different", said)
        apart = re.findall(r"not compared: (.*) \((\d+) draws\)", said)
        width, height, rule, draws = found(r"of (\d+)x(\d+) px per eye by (.*): (\d+) draws", said)
        fragments = found(r"quads, (\d+) fragments", said)[0]
        left_out = re.findall(r"not in the trace, or less exactly: (.*)", said)
        morton, *others = (self.study.result(trace, order)["external_bytes"] for order in ("morton", "z2-lrta", "z2-sta"))
        plain_before, before, plain, recorded, plain_peak, peak = measured
        over_plain = [f"{time / of:.2f}" if of else "-" for time, of in ((recorded, plain), (before, plain_before))]
        return [
            name, rule, f"{width}x{height}", draws, equal, different, "; ".join(f"{count}: {why}" for why, count in apart) or "0",
            fragments, *(f"{time:.1f}" if time else "-" for time in (plain_before, before, plain, recorded)), *over_plain,
            pictures, f"{plain_peak:.0f}", f"{peak:.0f}", f"{morton / 1e6:.2f}", *(f"{100 * (1 - other / morton):.1f}" for other in others),
            "; ".join(left_out) or "nothing",
        ]


def capture_two_pages(study, site):
    for name, page, query in TWO_PAGES:
        study.say(f"capture {name}")
        trace, picture = (study.out / f"{name}.{ending}" for ending in ("textrace", "png"))
        done = study.tracegen("page", site / page, "--query", query, "--check", "--image", picture, "-o", trace)
        print(done.out + done.err, end="")
        print(study.replay("validate", trace).out, end="")
        for order in ("morton", "z2-sta"):
            print(study.replay("run --order", order, trace).out, end="", flush=True)
    study.say(f"the traces and pictures are in {study.out}")


def run(study):
    site = study.out / "site"
    site.mkdir(exist_ok=True)
    install(site)
    if study.options.two_pages:
        capture_two_pages(study, site)
        return
    programs, rows = Programs(study, site), []
    for page in PAGES:
        study.say(f"measure {page[0]}")
        rows.append(programs.page(*page))
    for name, measure_game in ((GAME, programs.game), (KART, programs.kart)):
        study.say(f"measure {name}")
        try:
            rows.append(measure_game())
        except Absent as error:
            print(f"SKIPPED: {name}: {error} is absent", file=sys.stderr)
    programs.timed.unlink()
    version = execute("chromium --version").out.strip().splitlines()[0]
    study.write(
        "applications", "", COLUMNS, rows, machine(), f"programs: {version}; versions of the libraries in apps/package-lock.json",
        f"times: medians of {study.options.turns} turns of {COUNT} frames, and of frames before them; frame {FIRST} is in the trace")
