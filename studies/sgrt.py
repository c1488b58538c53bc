"""Stereo reprojection on the SGRT model: all scenes, every rule on Crytek Sponza, and the paper's figure 3 under two readings of what is reused."""

from .common import SGRT_SCENES

OPTIONS = {"--size": dict(default="1024x1024", help="pixels per eye of all tables but the paper's figure (1024x1024)")}
# Real scenes, and the scene of the paper that each stands in for.
REAL = {"teapot_16k": "teapot", "chess_42k": "chess", "bmw_55k": "bmw", "stk-black-forest": "", "crytek-sponza": ""}
RULES = "none depth row object opaque silhouette triangle triangles depth+row+object+opaque+triangles".split()
COLUMNS = (
    "scene | checksum | run | rule | reuse | reuse_pct | wrong_object_pct | position_over_2px_pct | flip_mean | psnr_db | relative_performance | "
    "tni_relative_performance | paper_relative_performance | relative_energy | paper_relative_energy | whole_screen_relative_performance | "
    "whole_screen_relative_energy | primary_steps_pct")
# Column of the table of rules: key, decimals, unit.
FIGURES = {
    "G-buffer in DRAM MB": ("gbuffer_dram_bytes", 1, 1e6), "tile buffers MB": ("on_chip_bytes", 0, 1e6), "re-tests M": ("retests", 2, 1e6),
    "reuse %": ("reuse_pct", 1, 1), "wrong object %": ("wrong_object_pct", 3, 1), "FLIP": ("flip_mean", 4, 1),
    "performance": ("relative_performance", 2, 1), "energy": ("relative_energy", 2, 1),
}


def run(study):
    size = study.options.size
    study.scene("crytek-sponza")
    real = study.present(REAL)
    traces = {scene: study.rays(scene, f"--size {size}") for scene in [*SGRT_SCENES, *real]}
    stand_ins = [f"--as {scene}={REAL[scene]}" for scene in real if REAL[scene]]
    rows = study.csv("reproject", *traces.values(), *stand_ins)
    study.write(
        "reprojection", f"tracegen rays SCENE --size {size}, replay reproject *.raytrace --as LABEL=SCENE --csv", COLUMNS,
        [[row[column] for column in COLUMNS.split(" | ")] for row in rows])

    table = []
    for rule in RULES:
        row = study.csv("reproject", traces["crytek-sponza"], "--rule", rule)[0]
        cells = [f"{float(row[key]) / unit:.{digits}f}" for key, digits, unit in FIGURES.values()]
        table.append(["default" if "+" in rule else f"`{rule}`", *cells])
    study.write(
        "reprojection-rules", f"tracegen rays crytek-sponza/sponza.gltf --size {size}, replay reproject --rule RULE --csv", " | ".join(["rule", *FIGURES]), table)

    small = [study.rays(scene, "--size 512x512", name=f"small/{scene}") for scene in SGRT_SCENES]
    readings = []
    for reuse in ("primary", "shadow"):
        rows = study.csv("reproject", *small, "--rule none --reuse", reuse)
        readings.append([row for row in rows if row["run"] == "chosen"])
    table = []
    for primary, shadow in zip(*readings):
        cells = [f"{float(row[start + what]):.2f}" for what in ("relative_performance", "relative_energy")
                 for row, start in ((primary, "paper_"), (primary, ""), (shadow, ""))]
        table.append([primary["scene"], *cells])
    study.write(
        "sgrt-readings", "tracegen rays SCENE --size 512x512, replay reproject *.raytrace --rule none --reuse primary|shadow --csv",
        "scene | performance: paper | performance: primary hits reused | performance: and shadow outcomes | "
        "energy: paper | energy: primary hits reused | energy: and shadow outcomes", table)
