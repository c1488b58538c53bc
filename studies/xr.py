"""Captures of unmodified OpenXR programs: eyes, fragments against occlusion queries, and the same bytes in two runs.

hello_xr is in Debian's package libopenxr-utils. The Python programs in apps/xr need packages from PyPI: pyopenxr, PyOpenGL, glfw, panda3d and panda3d-openxr;
`--python` names an interpreter that has them. `--bevy` names the example 3d_scene of the crate bevy_mod_openxr 0.6, built with Bevy's features bevy_pbr,
bevy_winit, x11, zstd_rust and tonemapping_luts; its lines for hand gizmos and pipelined rendering need more of Bevy and are left out. A program that is absent is
skipped with a line.
"""

import re
import sys
from pathlib import Path

from .common import ROOT, Absent, Failed, needs

OPTIONS = {"--python": dict(default=sys.executable, help="the Python interpreter of the programs in apps/xr"),
           "--bevy": dict(default="3d_scene", help="the example 3d_scene of bevy_mod_openxr")}
FRAME = 3
COLUMNS = "program | graphics | pixels per eye | eyes by | draws | textures | fragments | draws equal to their query | draws that differ | not compared | two runs"


def programs(python, bevy):
    """Name, graphics, what must be there, options of `tracegen xr`, command."""
    for graphics in ("Vulkan", "Vulkan2", "OpenGL"):
        yield "hello_xr", graphics, ["hello_xr"], "", f"hello_xr -g {graphics}"
    yield "pyopenxr: texel by pixel", "OpenGL", [python], "", f"{python} {ROOT / 'apps/xr/texels.py'}"
    yield "panda3d-openxr: panda", "OpenGL", [python], "--head 0,0,0", f"{python} {ROOT / 'apps/xr/panda.py'}"
    yield "Bevy: 3d_scene", "Vulkan2", [bevy], "", bevy


def number(pattern, text):
    """The numbers of a line that the capture prints."""
    found = re.search(pattern, text)
    if not found:
        raise Failed(f"expected a line like {pattern}, found\n{text}")
    return found.groups()


def row(study, name, graphics, options, command):
    """Two captures of a program."""
    traces, said = [], ""
    for run in range(2):
        trace = study.work / f"{run}.textrace"
        said = study.tracegen(f"xr --frames {FRAME} --check {options} -o", trace, f"-- {command}").err
        traces.append(trace.read_bytes())
    size, eyes, draws, textures = number(r"frame of (\d+x\d+) px per eye by (.*): (\d+) draws, (\d+) textures", said)
    [fragments] = number(r"(\d+) fragments", said)
    equal, different = number(r"occlusion queries: (\d+) draws equal, (\d+) different", said)
    apart = sum(map(int, re.findall(r"not compared: .* \((\d+) draws\)", said)))
    same = "the same bytes" if traces[0] == traces[1] else "differ"
    study.say(f"{name}, {graphics}")
    return [name, graphics, size, eyes, draws, textures, fragments, equal, different, apart, same]


def run(study):
    rows = []
    for name, graphics, needed, options, command in programs(Path(study.options.python), study.options.bevy):
        try:
            needs(*map(str, needed))
            rows.append(row(study, name, graphics, options, command))
        except (Absent, Failed) as error:
            print(f"skipped: {name}, {graphics}: {error}", file=sys.stderr)
    study.write("xr-programs", f"tracegen xr --frames {FRAME} --check -- PROGRAM", COLUMNS, rows)
