"""Shadow maps in smaller formats: traffic, what Z2 STA saves of it, and the error of the pictures."""

import csv

from .common import saved
from .shadow_orders import SCENES, by_kind

CAPTURE = "--shadows --size 480x540"
# Blocks of BC4 in the order in which shadow maps have their texels.
ORDER = "--block-order morton"
LINEAR = "--shadow-map-order linear"
ERRORS = ["flip_mean", "changed_pct", "edge_mean_px", "edge_p99_px", "edge_worst_px"]


def run(study):
    rows = []
    for scene in study.present(SCENES):
        study.say(scene)
        measured = study.tracegen("shadows", study.scene(scene), CAPTURE, "--quiet").out
        base = None
        for error in csv.DictReader(measured.splitlines()):
            name = error["format"]
            trace = study.raster(scene, CAPTURE, f"--shadow-format {name}", name=f"{scene}-{name}")
            (maps, others), (maps_sta, others_sta) = map(by_kind, study.pair(trace, ORDER))
            rows_of_texels = [sum(by_kind(result)) for result in study.pair(trace, LINEAR)]
            study.drop(trace)
            base = base or maps + others
            rows.append([
                scene, name, error["map_mb"], f"{(maps + others) / 1e6:.3f}", saved(maps + others, base), f"{100 * maps / (maps + others):.1f}",
                f"{(maps_sta + others_sta) / 1e6:.3f}", saved(maps_sta, maps), saved(maps_sta + others_sta, maps + others),
                saved(rows_of_texels[1], rows_of_texels[0]), *(error[key] for key in ERRORS)])
    study.write(
        "shadow-formats",
        f"tracegen raster SCENE {CAPTURE} --no-plain --shadow-format FORMAT, replay run TRACE --order ORDER {ORDER} or {LINEAR} --json: by_texture; tracegen shadows SCENE {CAPTURE}",
        "scene | format | maps, MB | Morton: MB per frame | less than r32f, % | shadow maps, % of it | Z2 STA: MB per frame | Z2 STA saves on shadow maps, % | on both, % | on both with linear maps, % | "
        "FLIP, mean | pixels changed, % | px from an edge, mean | 99 % | worst", rows)
