"""Trees of instances in the ray tracer: hits against the flattened scene, memory of a forest, and speed beside Embree's instancing.

`speed` needs the Python package embreex, whose library it calls directly: leave the machine to it.
"""

import importlib.util
import json
from pathlib import Path

from .common import Absent, bench, execute, machine

OPTIONS = {
    "part": dict(choices=["hits", "memory", "speed"]),
    "--rounds": dict(type=int, default=8, help="rounds of `speed` (8)"),
}
COUNTS = "steps above, instances, steps below, tests"


def said(study, *more):
    done = execute(bench("rays", "instances"), study.options.part, *more)
    return [json.loads(line) for line in done.out.splitlines()]


def hits(study):
    heading = "instances | rays | hits | other hit, distance or vertices | of them not at an edge"
    names = {"Exact": "permuted, mirrored, scaled by powers of two", "Affine": "any matrix", "Far": "any matrix, 100 km away"}
    rows = [[names[row["places"]], *(f"{row[key]:,}" for key in ("rays", "hits", "different", "unexplained"))] for row in said(study)]
    study.write("rays-instances-hits", "", heading, rows, part="hits")


def memory(study):
    heading = "tree | instances | triangles of the mesh | MB | flattened MB | flattened / instances | MB in the tracer | flattened MB in the tracer | ratio"
    mb = lambda bytes: f"{bytes / 1e6:,.2f}"
    pairs = (("flattened_bytes", "bytes"), ("flattened_host_bytes", "host_bytes"))
    rows = []
    for row in said(study):
        sizes = [cell for flat, own in pairs for cell in (mb(row[own]), mb(row[flat]), f"{row[flat] / row[own]:,.0f}")]
        rows.append([row["tree"], f"{row['instances']:,}", f"{row['triangles']:,}", *sizes])
    note = "flattened: 10 trees' share of a forest of 20, times the number of instances"
    study.write("rays-instances-memory", "", heading, rows, note, part="memory")


def speed(study):
    package = importlib.util.find_spec("embreex")
    if not package:
        raise Absent("the Python package embreex")
    library = next((Path(package.origin).parents[1] / "embreex.libs").glob("libembree4*"))
    heading = "rays | Embree | Embree, high quality | BVH8 | BVH2 | BVH8 / Embree | BVH2 / Embree | " + " | ".join(
        f"{tree} {count}" for tree in ("BVH8", "BVH2") for count in COUNTS.split(", ")
    )
    rows = []
    for row in said(study, "--embree", library, "--rounds", study.options.rounds):
        rates = [row[key] for key in ("embree", "embree_high", "bvh8", "bvh2")]
        ratios = [row[key] / row["embree"] for key in ("bvh8", "bvh2")]
        counts = row["bvh8_counts"] + row["bvh2_counts"]
        rows.append([row["stream"], *(f"{n:.2f}" for n in rates + ratios), *(f"{n:.1f}" for n in counts)])
    study.write("rays-instances-speed", f"--rounds {study.options.rounds}", heading, rows, machine(), part="speed")


def run(study):
    return globals()[study.options.part](study)
