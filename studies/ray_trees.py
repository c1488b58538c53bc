"""What rays read from trees of each kind and layout."""

OPTIONS = {"--size": dict(default="512x512", help="pixels per eye (512x512)")}
SCENES = ["chess", "music-box", "meadow", "crytek-sponza"]
TREES = ["bvh2", "bvh4", "bvh8", "cwbvh8"]
LAYOUTS = {"depth first": "", "treelets of 4 KB": "--treelets 4096"}


def run(study):
    size = study.options.size
    study.scene("crytek-sponza")
    table = []
    for scene in SCENES:
        first = None
        for tree, layout in ((tree, layout) for tree in TREES for layout in LAYOUTS):
            trace = study.rays(scene, f"--size {size} --visits --bvh {tree}", LAYOUTS[layout], name=f"{scene}-{tree}-{layout}")
            nodes = study.json("info", trace)["hierarchy"]
            found = study.json("reproject --timing cycle", trace)["result"]
            study.drop(trace)
            work, cycles = found["reference_work"], found["cycles"]["reference"]
            rays, node_bytes = work["rays"], nodes["bytes_per_node"]
            dram_bytes, time = found["reference_dram"]["hierarchy_bytes"], cycles["cycles"]
            name = "" if first else scene
            first = first or (dram_bytes, time)
            table.append([
                name, tree, layout, node_bytes, f"{nodes['nodes'] * node_bytes / 1e6:.2f}", f"{work['steps'] / rays:.2f}",
                f"{work['steps'] / rays * node_bytes:.0f}", f"{work['triangle_tests'] / rays:.2f}",
                *(f"{cycles[f'{cache}_hit_pct']:.1f}" for cache in ("node_l1", "triangle_l1", "l2")),
                f"{dram_bytes / rays:.1f}", f"{dram_bytes / first[0]:.2f}", f"{time / 1e6:.2f}", f"{first[1] / time:.2f}"])
    study.write(
        "rays-trees", f"tracegen rays SCENE --size {size} --visits --bvh TREE [--treelets 4096], replay reproject --timing cycle --json",
        "scene | tree | layout | bytes per node | nodes, MB | steps per ray | node bytes per ray | tests per ray | node L1 hits % | triangle L1 hits % | "
        "L2 hits % | DRAM bytes per ray | DRAM bytes, relative | unit cycles M | performance, relative", table)
