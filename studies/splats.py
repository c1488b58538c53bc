"""Captures of unmodified viewers of Gaussian splats in stereo: reads of their vertex shaders, and fragments against occlusion queries.

Installs Chromium and npm from Debian, and the viewers of apps/package-lock.json from npm. The splats are generated (apps/pages/splats.js).
"""

import json

from .apps import found, install
from .common import Failed

OPTIONS = {"--splats": dict(type=int, default=20000, help="splats of the generated room (20000)")}
WEBXR = "--iwer node_modules/iwer/build/iwer.min.js --eyes halves"
# Value of `viewer` in the page's query, package, more options of `tracegen page`.
VIEWERS = [
    ("spark", "@sparkjsdev/spark", WEBXR),
    ("gaussian-splats-3d", "@mkkellogg/gaussian-splats-3d", WEBXR),
    ("babylon", "@babylonjs/core", ""),
]
COLUMNS = ("viewer | version | pixels per eye | draws of both eyes | vertices | of them per draw | reads per vertex | vertex reads | lines of the left eye | fragments | "
           "fragments per pixel | draws equal to their query | draws that differ")


def run(study):
    site = study.out / "site"
    site.mkdir(exist_ok=True)
    install(site)
    packages = json.loads((site / "package-lock.json").read_text())["packages"]
    rows = []
    for viewer, package, more in VIEWERS:
        study.say(viewer)
        trace = study.work / f"{viewer}.textrace"
        query = f"?viewer={viewer}&splats={study.options.splats}"
        said = study.tracegen("page --check --settle 5 --frames 30", site / "splats.html", "--query", query, more, "-o", trace, allowed=(0, 1), folder=site).err
        equal, different = found(r"occlusion queries: (\d+) draws equal, (\d+) different", said)
        width, height = map(int, found(r"of (\d+)x(\d+) px per eye", said))
        fragments = int(found(r"(\d+) fragments", said)[0])
        if "not in the trace: reads by vertex shaders" in said:
            raise Failed(f"expected that all vertex reads are recorded, found\n{said}")
        eyes = study.json("info", trace)["vertex_reads"]
        draws, vertices, reads = (sum(eye[key] for eye in eyes) for key in ("draws", "vertices", "reads"))
        rows.append([viewer, packages[f"node_modules/{package}"]["version"], f"{width}x{height}", draws, vertices, f"{vertices / draws:.0f}",
                     f"{reads / vertices:.1f}", reads, eyes[0]["lines"], fragments, f"{fragments / (2 * width * height):.1f}", equal, different])
    study.write("splats", f"tracegen page --check --frames 30 splats.html; {study.options.splats} splats", COLUMNS, rows)
