#!/usr/bin/env python3
"""Compares the counting traversal with Embree 4 in ROBUST mode on the same triangles and rays.

    pip install embreex numpy
    cargo bench -p rays --bench rays --no-run
    scripts/embree_compare.py BENCH SCENE [ROUNDS]

BENCH is the executable that cargo names. Both programs take turns, ROUNDS times; figures are the
best of one thread's wall time, in million single rays a second: leave the machine to them.
"""

import json
import os
import subprocess
import sys
import tempfile
import time

import embreex
import numpy as np
from embreex import mesh_construction, rtcore_scene

STREAMS = ["primary", "shadow", "mirror", "diffuse"]


def ours(bench, scene, folder=None):
    command = [bench, scene, "--json", "--rounds", "1", "--size", "1024"] + (["--dump", folder] if folder else [])
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return {row["stream"]: row for row in map(json.loads, out.splitlines())}


def main():
    bench, scene = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    best = {name: {"bvh2": 0.0, "bvh8": 0.0, "embree": 0.0} for name in STREAMS}
    with tempfile.TemporaryDirectory() as folder:
        ours(bench, scene, folder)
        triangles = np.fromfile(os.path.join(folder, "triangles.f32"), "<f4").reshape(-1, 3, 3)
        rays = {
            name: np.fromfile(os.path.join(folder, name + ".f32"), "<f4").reshape(-1, 8)
            for name in STREAMS
        }
    embree = rtcore_scene.EmbreeScene(robust=True)
    mesh_construction.TriangleMesh(embree, triangles)
    split = {
        name: (np.ascontiguousarray(r[:, 0:3]), np.ascontiguousarray(r[:, 4:7]))
        for name, r in rays.items()
    }
    embree.run(*split["primary"])  # commits the scene
    for _ in range(rounds):
        for name, row in ours(bench, scene).items():
            for tree in ("bvh2", "bvh8"):
                best[name][tree] = max(best[name][tree], row[tree])
        for name in STREAMS:
            origins, directions = split[name]
            query = "OCCLUDED" if name == "shadow" else "INTERSECT"
            start = time.perf_counter()
            embree.run(origins, directions, query=query)
            rate = len(origins) / (time.perf_counter() - start) / 1e6
            best[name]["embree"] = max(best[name]["embree"], rate)
    print(f"{scene}: {len(triangles)} triangles, embreex {embreex.__version__}, ROBUST")
    print(f"{'stream':8} {'embree':>7} {'bvh8':>7} {'bvh2':>7}  bvh8/embree  bvh2/embree")
    for name in STREAMS:
        b = best[name]
        print(
            f"{name:8} {b['embree']:7.2f} {b['bvh8']:7.2f} {b['bvh2']:7.2f}"
            f"  {b['bvh8'] / b['embree']:11.2f}  {b['bvh2'] / b['embree']:11.2f}"
        )


if __name__ == "__main__":
    main()
