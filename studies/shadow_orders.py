"""What Z2 STA saves on shadow maps and on other textures: scenes with four cascades as the DK2 shows them."""

from .common import saved

SCENES = ["crytek-sponza", "dabrovic-sponza", "stk-black-forest", "jungle"]
LINE_BYTES = 16


def by_kind(result):
    """Bytes of shadow maps, and of other textures."""
    parts = [(part["name"] == "shadow cascades", LINE_BYTES * part["l2"]["line_misses"]) for part in result["by_texture"]]
    return [sum(count for is_map, count in parts if is_map == wanted) for wanted in (True, False)]


def run(study):
    rows = []
    for scene in study.present(SCENES):
        trace = study.raster(scene, "--hmd dk2 --shadows")
        (maps, others), (maps_sta, others_sta) = map(by_kind, study.pair(trace))
        assert maps > 0, scene
        rows.append([
            scene, f"{(maps + others) / 1e6:.3f}", f"{100 * maps / (maps + others):.1f}", saved(maps_sta, maps), saved(others_sta, others),
            saved(maps_sta + others_sta, maps + others)])
    study.write(
        "shadow-orders", "tracegen raster SCENE --hmd dk2 --shadows --no-plain, replay run TRACE --order ORDER --json: by_texture",
        "scene | Morton: MB per frame | shadow maps, % of it | Z2 STA saves on shadow maps, % | on other textures, % | on both, %", rows)
