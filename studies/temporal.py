"""Reuse of the previous frame beside reuse between the eyes: pairs of frames of a head that looks around, 90 frames per second."""

from .common import geometric_mean, mean

OPTIONS = {"--size": dict(default="512x512", help="pixels per eye (512x512)")}
SCENES = ["teapot", "chess", "music-box", "meadow", "crytek-sponza", "stk-black-forest"]
# First frames of the pairs: slow, and at the fastest turn of the first seconds.
PLACES = [10, 60, 110]
RULES = {"every arrival reused": "--preset sgrt-paper --reuse shadow", "default": ""}
# Figures of a row, their decimals, and how they are averaged.
FIGURES = {
    "left_reused_pct": (0, mean), "right_reused_pct": (0, mean), "relative_performance": (2, geometric_mean), "relative_energy": (2, geometric_mean),
    "dram_mb": (1, mean), "gbuffer_dram_mb": (1, mean), "left_flip_mean": (4, mean), "right_flip_mean": (4, mean),
}


def measure(study, size):
    """Rows of all pairs of frames, by rule and scene."""
    found = {(rule, scene): [] for rule in RULES for scene in SCENES}
    for scene in SCENES:
        for place in PLACES:
            frames = [
                study.rays(scene, f"--size {size} --visits --path head --fps 90 --frame {frame}", name=f"{scene}-{frame}") for frame in (place, place + 1)]
            for rule, flags in RULES.items():
                found[rule, scene] += study.csv("temporal", *frames, flags)
            study.drop(*frames)
    return found


def run(study):
    for scene in SCENES:
        study.scene(scene)
    size = study.options.size
    found = measure(study, size)
    table = []
    for rule in RULES:
        for scene in [*SCENES, "all"]:
            every = [row for (r, s), rows in found.items() for row in rows if r == rule and scene in (s, "all")]
            for scheme in ("stereo", "temporal", "both"):
                rows = [row for row in every if row["scheme"] == scheme]
                figures = [f"{average(float(row[key]) for row in rows):.{digits}f}" for key, (digits, average) in FIGURES.items()]
                worst = max(float(row[f"{eye}_flip_mean"]) for row in rows for eye in ("left", "right"))
                table.append([rule, scene, scheme, *figures, f"{worst:.4f}"])
    study.write(
        "temporal", f"tracegen rays SCENE --size {size} --visits --path head --fps 90 --frame K, replay temporal",
        "rule | scene | scheme | left reused % | right reused % | performance | energy | DRAM MB | of G-buffers MB | left FLIP | right FLIP | worst FLIP", table)
    study.write("temporal-summary", "", SUMMARY, summary(table), f"{len(SCENES)} scenes: geometric mean over all pairs of frames, least and most of a scene")


SUMMARY = "rule | scheme | performance | performance, least to most | energy | energy, least to most | worst FLIP"


def summary(table):
    """Of each rule and scheme: means, and the spread over the scenes."""
    rows = []
    for rule in RULES:
        for scheme in ("stereo", "temporal", "both"):
            of = {row[1]: row for row in table if (row[0], row[2]) == (rule, scheme)}
            mean_of = of.pop("all")
            cells = [cell for at in (5, 6) for cell in (mean_of[at], " to ".join(pick((row[at] for row in of.values()), key=float) for pick in (min, max)))]
            rows.append([rule, scheme, *cells, mean_of[-1]])
    return rows
