"""What tile orders save below an L3: Crytek Sponza, atrium and jungle as the DK2 shows them."""

from .common import megabytes, million_cycles, saved

SIZES = ["none", "256 KiB", "512 KiB", "1 MiB", "2 MiB", "4 MiB"]


def run(study):
    rows = []
    for scene, trace in study.dk2():
        for size in SIZES:
            level = [] if size == "none" else ["--l3", size.replace(" ", "")]
            morton, sta = study.pair(trace, *level)
            row = [scene, size]
            for cell, key in ((megabytes, "external_bytes"), (million_cycles, "cycles")):
                row += [cell(morton), cell(sta), saved(sta[key], morton[key])]
            rows.append(row)
    study.write(
        "levels", "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --order ORDER --l3 SIZE",
        "scene | L3 | Morton: MB per frame | Z2 STA: MB per frame | saved % | Morton: million cycles | Z2 STA: million cycles | cycles saved %", rows)
