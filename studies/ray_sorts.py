"""Sorted rays: DRAM bytes of the hierarchy, and cycles, with the rays of a tile or of a pair of tiles in several orders."""

from concurrent.futures import ThreadPoolExecutor

from .common import mean
from .ray_orders import SCENES

OPTIONS = {"--size": dict(default="96x96", help="pixels per eye (96x96)")}
SORTS = ["none", "generation", "direction", "origin", "treelet"]
# In the cycle-level model.
TIMED = SORTS[1:-1]
# The capture of the last one.
TREELETS = "--treelets 4096"
KINDS = {"all": "primary,shadow,reflection,refraction,ambient-occlusion,diffuse", "diffuse": "diffuse"}
# Each eye's tile by itself, and both as one batch.
ORDERS = ["z2-lrta", "z2-sta"]
L2_KIB = [16, 64, 256]


def percent(value):
    """Without a negative zero."""
    return f"{round(value, 1) + 0:.1f}"


def of_scene(study, scene):
    """Bytes and cycles of both eyes in full, by kind of ray, L2, order and sort."""
    captured = {}
    for layout in ("", TREELETS):
        captured[layout] = study.work / f"{scene}{layout and '-treelets'}.raytrace"
        study.tracegen("rays", study.scene(scene), "--all-columns --bounces 2 --quiet --size", study.options.size, layout, "-o", captured[layout])
    # Queues at treelets are compared with unsorted rays in the same layout.
    runs = [*((sort, sort, "") for sort in SORTS[:-1]), ("none in treelets", "none", TREELETS), ("treelet", "treelet", TREELETS)]
    found = {}
    for kib in L2_KIB:
        config = study.work / f"{scene}-{kib}.toml"
        config.write_text(f"[cache]\nnode_l1_bytes = 4096\ntriangle_l1_bytes = 4096\nl2_bytes = {kib << 10}\n")
        for kind, names in KINDS.items():
            for order in ORDERS:
                for run, sort, layout in runs:
                    words = ["reproject --rule none --order", order, "--sort-rays", sort, "--rays", names, "--config", config, captured[layout]]
                    result = study.json(*words)["result"]
                    is_timed = (kind, kib, layout) == ("all", 64, "")
                    cycles = study.json(*words, "--timing cycle")["result"]["reference_tni_cycles"] if is_timed else None
                    found[kind, kib, order, run] = result["reference_dram"]["hierarchy_bytes"], cycles
    for trace in captured.values():
        trace.unlink()
    return found


def run(study):
    scenes = study.present(SCENES)
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(scenes, pool.map(lambda scene: of_scene(study, scene), scenes)))
    rows, all_scenes = [], []
    for kind in KINDS:
        for kib in L2_KIB:
            for order in ORDERS:
                by_sort, cycles = {}, {}
                for sort in SORTS[1:]:
                    base = "none in treelets" if sort == "treelet" else "none"
                    pairs = [(values[kind, kib, order, sort], values[kind, kib, order, base]) for values in found.values()]
                    by_sort[sort] = [100 * (own[0] / none[0] - 1) for own, none in pairs]
                    if sort in TIMED:
                        cycles[sort] = [100 * (own[1] / none[1] - 1) for own, none in pairs if none[1]]
                rows.append([kind, kib, order, len(scenes), *(
                    cell for values in by_sort.values() for cell in (percent(mean(values)), f"{percent(min(values))} to {percent(max(values))}")),
                    *(percent(mean(values)) if values else "-" for values in cycles.values())])
                for scene, more in zip(scenes, zip(*by_sort.values())):
                    base = found[scene][kind, kib, order, "none"][0]
                    all_scenes.append([scene, kind, kib, order, f"{base / 1e6:.3f}", *map(percent, more)])
    detail = f"--size {study.options.size}"
    heads = " | ".join(f"{sort}: more bytes % | {sort}: range" for sort in SORTS[1:])
    study.write("ray-sorts-summary", detail, f"rays | L2 KiB | order | scenes | {heads} | " + " | ".join(f"{sort}: more cycles %" for sort in TIMED), rows)
    study.write("ray-sorts", detail, "scene | rays | L2 KiB | order | MB unsorted | " + " | ".join(f"{sort}: more bytes %" for sort in SORTS[1:]), all_scenes)
