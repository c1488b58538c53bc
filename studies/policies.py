"""What replacement policies do to texture traffic: Crytek Sponza, atrium and jungle as the DK2 shows them."""

from .common import l1_misses, megabytes

POLICIES = ["lru", "fifo", "tree-plru", "random", "srrip", "brrip", "drrip", "ship"]


def run(study):
    rows = []
    for scene, trace in study.dk2():
        for policy in POLICIES:
            results = study.pair(trace, "--mode functional --replacement", policy)
            rows.append([scene, policy, *(cell(result) for result in results for cell in (l1_misses, megabytes))])
    study.write(
        "policies", "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --mode functional --order ORDER --replacement POLICY",
        "scene | policy | Morton: L1 misses % | Morton: MB per frame | Z2 STA: L1 misses % | Z2 STA: MB per frame", rows)
