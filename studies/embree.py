"""The counting traversal against Embree 4 in ROBUST mode on the same triangles and rays: `speed`, or `hits` and work. Prints; writes no table.

Needs the Python packages embreex and numpy. `speed`: both programs take turns; figures are the best of one thread's wall time, in million single
rays a second: leave the machine to them. `hits` also compares with a search in f64 and with a walk of the trees by FORMAT.md; exit code 1 if a
difference has no cause.
"""

import json
import time
from pathlib import Path

import embreex
import numpy as np
from embreex import mesh_construction, rtcore_scene

from .common import bench, execute

OPTIONS = {
    "part": dict(choices=["speed", "hits"]),
    "scene": dict(type=Path, help="a built-in scene or a file"),
    "--rounds": dict(type=int, default=5, help="rounds of `speed` (5)"),
    "--rays": dict(type=int, default=300_000, help="rays of each stream that `hits` checks (300000)"),
}
STREAMS = ["primary", "shadow", "mirror", "diffuse"]


def ours(program, scene, *more):
    """A row for each stream."""
    said = execute(program, scene, "--json --rounds 1 --size 1024", *more).out
    return {row["stream"]: row for row in map(json.loads, said.splitlines())}


def dumped(folder):
    """Embree with the triangles of a folder, and origins and directions of each stream."""
    load = lambda name: np.fromfile(folder / f"{name}.f32", "<f4")
    embree = rtcore_scene.EmbreeScene(robust=True)
    triangles = load("triangles").reshape(-1, 3, 3)
    mesh_construction.TriangleMesh(embree, triangles)
    rays = {name: load(name).reshape(-1, 8) for name in STREAMS}
    return embree, len(triangles), {name: [np.ascontiguousarray(of[:, at : at + 3]) for at in (0, 4)] for name, of in rays.items()}


def speed(study, program, scene):
    embree, triangles, rays = dumped(study.work)
    embree.run(*rays["primary"])  # commits the scene
    best = {name: dict.fromkeys(("bvh2", "bvh8", "embree"), 0.0) for name in STREAMS}
    for _ in range(study.options.rounds):
        for name, row in ours(program, scene).items():
            for tree in ("bvh2", "bvh8"):
                best[name][tree] = max(best[name][tree], row[tree])
        for name, (origins, directions) in rays.items():
            start = time.perf_counter()
            embree.run(origins, directions, query="OCCLUDED" if name == "shadow" else "INTERSECT")
            best[name]["embree"] = max(best[name]["embree"], len(origins) / (time.perf_counter() - start) / 1e6)
    print(f"{scene}: {triangles} triangles, embreex {embreex.__version__}, ROBUST")
    print(f"{'stream':8} {'embree':>7} {'bvh8':>7} {'bvh2':>7}  bvh8/embree  bvh2/embree")
    for name, of in best.items():
        print(f"{name:8} {of['embree']:7.2f} {of['bvh8']:7.2f} {of['bvh2']:7.2f}  {of['bvh8'] / of['embree']:11.2f}  {of['bvh2'] / of['embree']:11.2f}")


def hits(study, scene):
    embree, _, rays = dumped(study.work)
    for name, lines in rays.items():
        nearest = embree.run(*lines, query="INTERSECT")
        any_hit = embree.run(*lines, query="OCCLUDED") if name == "shadow" else nearest
        np.stack([nearest, any_hit != -1], axis=1).astype("<i4").tofile(study.work / f"{name}.embree")
    done = execute(bench("rays", "ray_hits"), study.work, study.options.rays, allowed=(0, 1))
    print(f"{scene}\n{done.out}{done.err}", end="")
    return done.code


def run(study):
    scene, program = study.options.scene, bench("rays", "rays")
    ours(program, scene, "--dump", study.work)
    return speed(study, program, scene) if study.options.part == "speed" else hits(study, scene)
