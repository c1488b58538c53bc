"""What the studies share: programs and what they print, scenes and captures, results files, means, parts of pictures."""

import csv
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CARGO = os.environ.get("CARGO", "cargo")
# The real scenes (docs/use/real-scenes.md). Every other name is a built-in scene.
REAL_SCENES = {
    "crytek-sponza": "crytek-sponza/sponza.gltf",
    "dabrovic-sponza": "dabrovic-sponza/sponza.gltf",
    "stk-cocoa-temple": "stk-cocoa-temple/stk-cocoa-temple.gltf",
    "stk-black-forest": "stk-black-forest/stk-black-forest.gltf",
    "chess_42k": "chess-openchessset/chess_42k.gltf",
    "bmw_55k": "bmw27/bmw_55k.gltf",
    "teapot_16k": "utah-teapot/teapot_16k.gltf",
}
# The built-in scenes that stand in for those of the SGRT paper. The rules of error detection were designed on them.
SGRT_SCENES = ["teapot", "chess", "car", "lab", "music-box", "meadow"]
PAIR = ["morton", "z2-sta"]


class Absent(Exception):
    """A scene or a program that the study needs and that this machine lacks."""


class Failed(Exception):
    """A program or an input that is not as expected."""


@dataclass
class Execution:
    """What a program printed, and what it took."""

    out: str
    err: str
    code: int
    wall_s: float
    user_s: float
    system_s: float
    peak_mb: float

    @property
    def processor_s(self):
        return self.user_s + self.system_s


def execute(*parts, allowed=(0,), folder=None, stdin=os.devnull, **environment):
    """Runs a program to its end, without the cache of captures: its time is measured. A string may hold several words; a path is
    one. An exit code that is not allowed is an error."""
    command = []
    for part in parts:
        command += [str(part)] if isinstance(part, Path) else str(part).split()
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err, open(stdin) as given:
        start = time.monotonic()
        started = subprocess.Popen(command, stdin=given, stdout=out, stderr=err, cwd=folder, env={"PARALLAX_CAPTURE_CACHE_SIZE": "0", **os.environ, **environment})
        _, status, usage = os.wait4(started.pid, 0)
        wall_s = time.monotonic() - start
        started.returncode = os.waitstatus_to_exitcode(status)
        for stream in (out, err):
            stream.seek(0)
        done = Execution(out.read(), err.read(), started.returncode, wall_s, usage.ru_utime, usage.ru_stime, usage.ru_maxrss / 1e3)
    if done.code not in allowed:
        raise Failed(f"{' '.join(command)}: exit code {done.code}\n{done.err}")
    return done


def needs(*programs):
    """Programs that must be there."""
    for program in programs:
        if not shutil.which(program):
            raise Absent(program)


def bench(package, name):
    """The executable of a benchmark, which Cargo builds if it is not up to date."""
    said = execute(f"{CARGO} bench --locked -p {package} --bench {name} --no-run --message-format json", folder=ROOT)
    for message in map(json.loads, said.out.splitlines()):
        if message.get("executable") and message["target"]["name"] == name:
            return message["executable"]
    raise Failed(f"cargo names no executable of the benchmark {name}")


def read_table(path):
    """The heading and the rows of a CSV file, without its comments."""
    with open(path, newline="") as file:
        return list(csv.reader(line for line in file if not line.startswith("#")))


def read_csv(path):
    """The rows of a CSV file as dictionaries."""
    heading, *rows = read_table(path)
    return [dict(zip(heading, row)) for row in rows]


class Study:
    """One run of a study: where things are, the programs, and what it writes."""

    def __init__(self, name, options, work):
        self.name, self.options = name, options
        self.results = options.results.resolve()
        self.scenes = (options.scenes or options.out / "scenes").resolve()
        self.bin = (options.bin or Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release").resolve()
        self.work = work
        self.traces = (options.traces / name if options.traces else work / "traces").resolve()
        self.start = time.monotonic()
        for folder in (self.results, self.traces):
            folder.mkdir(parents=True, exist_ok=True)

    @property
    def out(self):
        """The study's folder for outputs that aren't results files."""
        folder = (self.options.out / self.name).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def say(self, text):
        print(f"[{time.monotonic() - self.start:3.0f}s] {text}", file=sys.stderr, flush=True)

    # Programs.

    def tracegen(self, *words, **more):
        return execute(self.bin / "tracegen", *words, **more)

    def replay(self, *words, **more):
        return execute(self.bin / "replay", *words, **more)

    def json(self, *words):
        return json.loads(self.replay(*words, "--json --quiet").out)

    def csv(self, *words):
        return list(csv.DictReader(self.replay(*words, "--csv --quiet").out.splitlines()))

    def result(self, trace, order, *options):
        """What `replay run` counts."""
        return self.json("run --order", order, trace, *options)["result"]

    def pair(self, trace, *options):
        """The same in Morton order and in Z2 STA."""
        return [self.result(trace, order, *options) for order in PAIR]

    def config(self, *lines):
        """The flag of a configuration with these lines of TOML."""
        path = self.work / "machine.toml"
        path.write_text("".join(f"{line}\n" for line in lines))
        return ["--config", path]

    # Scenes and captures.

    def scene(self, name):
        """The scene's file, or its name if it is built in."""
        if name not in REAL_SCENES:
            return name
        path = self.scenes / REAL_SCENES[name]
        if not path.is_file():
            raise Absent(f"{path} (docs/use/real-scenes.md)")
        return path

    def present(self, names):
        """The scenes without those whose file is absent, each of which gets a line."""
        found = []
        for name in names:
            try:
                self.scene(name)
                found.append(name)
            except Absent as error:
                print(f"skipped: {error} is absent", file=sys.stderr)
        return found

    def raster(self, scene, *options, name=None, **environment):
        """The texture trace of a scene."""
        return self._capture(f"{name or scene}.textrace", "raster --no-plain", self.scene(scene), *options, **environment)

    def rays(self, scene, *options, name=None):
        """The ray trace of a scene."""
        return self._capture(f"{name or scene}.raytrace", "rays", self.scene(scene), *options)

    def _capture(self, file, *words, **environment):
        path = self.traces / file
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            self.tracegen(*words, "--quiet -o", path, **environment)
        return path

    def drop(self, *traces):
        """Removes traces that are no longer needed, unless the user keeps them."""
        if not self.options.traces:
            for trace in traces:
                trace.unlink()

    def dk2(self):
        """Crytek Sponza and two built-in scenes as the DK2 shows them: name and trace of each."""
        for scene in ("crytek-sponza", "atrium", "jungle"):
            yield scene, self.raster(scene, "--hmd dk2")

    # What a study writes.

    def write(self, name, detail, heading, rows, *notes, part=""):
        """Writes a results file. Its comments name the study's command, the commands that this ran, and notes. Headings are separated by ` | `."""
        command = f"command: python3 -m studies {self.name}{part and ' ' + part}"
        path = self.results / f"{name}.csv"
        with open(path.with_suffix(".csv.part"), "w", newline="") as file:
            for line in [f"{command}  ({detail})" if detail else command, *notes]:
                file.write(f"# {line}\n")
            csv.writer(file, lineterminator="\n").writerows([heading.split(" | "), *rows])
        os.replace(file.name, path)

    def picture(self, name):
        """Where a picture of the documents goes: beside the results files if these go elsewhere."""
        return (ROOT / "docs/images" if self.results == ROOT / "results" else self.results) / f"{name}.svg"


def machine():
    """The note about the machine that times were measured on."""
    return f"machine: {os.cpu_count()} cores, {platform.machine()}, load average {os.getloadavg()[0]:.1f} at the end"


# Figures.


def megabytes(result):
    return f"{result['external_bytes'] / 1e6:.3f}"


def million_cycles(result):
    return f"{result['cycles'] / 1e6:.2f}"


def l1_misses(result):
    return f"{100 * result['l1']['footprint_miss_rate']:.2f}"


def saved(own, base, digits=1):
    """How much less than the base, percent."""
    return f"{100 * (1 - own / base):.{digits}f}"


def mean(values):
    values = list(values)
    return sum(values) / len(values)


def geometric_mean(values):
    return math.exp(mean(math.log(value) for value in values))


def energy_14_nm(rows):
    """Geometric means of the bounds of relative energies on a 14 nm chip."""
    return "-".join(f"{geometric_mean(float(row[f'relative_energy_{end}']) for row in rows):.2f}" for end in ("least", "most"))


# Pictures.

INK, FAINT = "#1d2229", "#5b636d"


def svg_text(x, y, words, size, fill=INK, anchor="start", weight="normal", more=""):
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{fill}" font-weight="{weight}" text-anchor="{anchor}"{more}>{words}</text>'


def write_svg(path, width, height, parts):
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="system-ui, -apple-system, \'Segoe UI\', \'Helvetica Neue\', Arial, sans-serif">',
        f'<rect width="{width}" height="{height}" rx="8" fill="#ffffff"/>', *parts, "</svg>\n",
    ]
    path.write_text("\n".join(lines))
