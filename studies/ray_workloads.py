"""Ray workloads beyond Whitted's, and what reprojection saves of each."""

from collections import Counter

OPTIONS = {"--size": dict(default="512x512", help="pixels per eye (512x512)")}
SCENES = ["chess", "music-box", "crytek-sponza", "stk-black-forest"]
WORKLOADS = {
    "Whitted": "",
    "soft shadows": "--light-radius 0.1 --sun-radius 0.5",
    "4 occlusion rays": "--ambient-occlusion 4",
    "16 occlusion rays": "--ambient-occlusion 16",
    "1 bounce": "--bounces 1",
    "4 bounces": "--bounces 4",
    "coloured shadows": "--coloured-shadows",
    "normal maps": "--normal-maps",
}
RUNS = {
    "hits": "--preset sgrt-paper --reuse primary", "shadows": "--preset sgrt-paper --reuse shadow", "colours": "--preset sgrt-paper", "default": "",
}


def shares(eyes):
    """Rays per pixel, shares of their kinds, steps per ray."""
    rays = sum((Counter(eye["rays"]) for eye in eyes), Counter())
    total = sum(rays.values())
    kinds = [rays[kind] for kind in ("shadow", "ambient-occlusion", "diffuse")] + [rays["reflection"] + rays["refraction"]]
    return [f"{total / sum(eye['samples'] for eye in eyes):.2f}", *(f"{100 * count / total:.0f}" for count in kinds),
            f"{sum(eye['steps'] for eye in eyes) / total:.1f}"]


def run(study):
    size = study.options.size
    for scene in SCENES:
        study.scene(scene)
    table = []
    for scene in SCENES:
        for workload, flags in WORKLOADS.items():
            trace = study.rays(scene, f"--size {size} --visits", flags, name=f"{scene}-{workload}")
            row = ["" if flags else scene, workload, *shares(study.json("info", trace)["totals"].values())]
            for reuse in RUNS.values():
                found = study.json("reproject", trace, reuse)["result"]
                row += [f"{found['relative_performance']:.2f}", f"{found['relative_energy']:.2f}", f"{found['flip_mean']:.4f}"]
            study.drop(trace)
            table.append(row)
    study.write(
        "ray-workloads",
        f"tracegen rays SCENE --size {size} --visits OPTIONS, replay reproject [--preset sgrt-paper --reuse primary|shadow|color]",
        " | ".join([
            "scene | workload | rays per pixel | shadow % | occlusion % | diffuse % | mirror and glass % | steps per ray",
            *(f"{name}: performance | {name}: energy | {name}: FLIP" for name in RUNS)]), table)
