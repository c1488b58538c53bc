"""Compile times of fragment shaders with and without the recording code.

Renders pages that use many kinds of shaders of three.js, Babylon.js, PixiJS and PlayCanvas, and two Debian games on zink, and keeps the shaders that
they hand to Vulkan; about ten minutes. Needs Chromium and npm; for the games xvfb, openarena and supertux, which are skipped where they are absent.
"""

import csv
import hashlib
import shutil
import sys

from .common import CARGO, ROOT, Absent, Failed, execute, machine, needs

OPTIONS = {"--turns": dict(type=int, default=1, help="measurements of each shader, of which the least counts (1)")}
LIBRARIES = "three@0.187.0 @babylonjs/core@9.34.0 pixi.js@8.22.0 playcanvas@2.23.3"
COMMANDS = {
    "openarena": "/usr/games/openarena +set r_fullscreen 0 +set r_mode -1 +set r_customwidth 320 +set r_customheight 240 "
                 "+set s_initsound 0 +set com_maxfps 30 +set timedemo 1 +map oa_dm1 +wait 150 +quit",
    "supertux": "/usr/games/supertux2 --window --geometry 320x240 --disable-sound --renderer opengl33",
}


def page(study, name, modules):
    site = study.out / "site"
    study.tracegen("page --frames 8 --list", site / f"shaders/{name}.html", "--root", site, "--modules", modules)


def game(study, name, modules):
    needs(COMMANDS[name].split()[0], "xvfb-run")
    home = study.out / "home"
    home.mkdir(exist_ok=True)
    tracegen = [study.bin / "tracegen", "app --gl --eyes mono --list --frames 30 --timeout 300 --modules", modules]
    execute("xvfb-run -a", *tracegen, "--", COMMANDS[name], HOME=str(home))


PROGRAMS = {
    "three": ("three.js", page), "babylon": ("Babylon.js", page), "pixi": ("PixiJS", page), "playcanvas": ("PlayCanvas", page),
    "openarena": ("OpenArena (zink)", game), "supertux": ("SuperTux (zink)", game),
}


def collect(study, name, keep):
    """The folder of a program's shaders. They are kept while the program makes its pipelines, so one that ends early still gives some."""
    modules = study.out / "modules" / name
    modules.mkdir(parents=True, exist_ok=True)
    try:
        keep(study, name, modules)
    except Absent as error:
        print(f"SKIPPED: {name}: {error} is absent", file=sys.stderr)
    except Failed:
        print(f"{name}: the program did not end; its shaders so far are measured", file=sys.stderr)
    return modules


def measure(study, folder, seen):
    """The rows of a folder, without shaders that were seen in another pipeline."""
    modules = sorted(folder.glob("*-program.spv"))
    if not modules:
        return
    for module in modules:
        digest = hashlib.sha256(module.read_bytes()).digest()
        if digest in seen:
            module.with_name(module.name.replace("-program", "-recording")).unlink(missing_ok=True)
        seen.add(digest)
    done = execute(study.bin / "compile_times", "--turns", study.options.turns, folder, MESA_SHADER_CACHE_DISABLE="true")
    for number, row in enumerate(csv.DictReader(done.out.splitlines())):
        ratio = float(row["recorded ms"]) / float(row["plain ms"])
        yield [number, *(row[key] for key in ("words", "recording words", "samples", "plain ms", "recorded ms")), f"{ratio:.2f}"]


def run(study):
    execute(ROOT / "scripts/install-deps.sh", "apps")
    execute(f"{CARGO} build --release --locked -p parallax-tests --bin compile_times", folder=ROOT)
    site = study.out / "site"
    shutil.copytree(ROOT / "apps/pages", site, dirs_exist_ok=True)
    execute("npm install --no-save --no-audit --no-fund --ignore-scripts --loglevel error", LIBRARIES, folder=site)
    seen = set()
    rows = [[title, *row] for name, (title, keep) in PROGRAMS.items() for row in measure(study, collect(study, name, keep), seen)]
    study.write(
        "compile-times", "",
        "program | shader | words | recording words | texture reads | plain ms | recorded ms | recorded over plain", rows,
        machine(), f"times: least processor time of {study.options.turns} turns, caches off")
