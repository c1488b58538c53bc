#!/usr/bin/env python3
"""Checks the hits and the work of a scene's rays against Embree 4 in ROBUST mode, a search in f64
and a walk of the trees by FORMAT.md.

    pip install embreex numpy
    cargo bench -p rays --bench rays --bench ray_hits --no-run
    scripts/embree_hits.py RAYS_BENCH RAY_HITS_BENCH SCENE [RAYS]

The executables are those that cargo names. RAYS of each of the four streams are checked, by
default 300,000. The exit code is 1 if a difference has no cause.
"""

import os
import subprocess
import sys
import tempfile

import numpy as np
from embreex import mesh_construction, rtcore_scene

STREAMS = ["primary", "shadow", "mirror", "diffuse"]


def main():
    rays_bench, hits_bench, scene = sys.argv[1:4]
    with tempfile.TemporaryDirectory() as folder:
        command = [rays_bench, scene, "--json", "--rounds", "1", "--size", "1024", "--dump", folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        triangles = np.fromfile(os.path.join(folder, "triangles.f32"), "<f4").reshape(-1, 3, 3)
        embree = rtcore_scene.EmbreeScene(robust=True)
        mesh_construction.TriangleMesh(embree, triangles)
        for name in STREAMS:
            rays = np.fromfile(os.path.join(folder, name + ".f32"), "<f4").reshape(-1, 8)
            lines = [np.ascontiguousarray(rays[:, at : at + 3]) for at in (0, 4)]
            nearest = embree.run(*lines, query="INTERSECT")
            any_hit = nearest
            if name == "shadow":
                any_hit = embree.run(*lines, query="OCCLUDED")
            found = np.stack([nearest, any_hit != -1], axis=1).astype("<i4")
            found.tofile(os.path.join(folder, name + ".embree"))
        print(scene, flush=True)
        sys.exit(subprocess.run([hits_bench, folder, *sys.argv[4:5]]).returncode)


if __name__ == "__main__":
    main()
