"""Stereo reprojection on the SGRT model: all scenes, the choice of the defaults, every rule on Crytek Sponza, and the paper's figure 3 under two readings."""

from .common import SGRT_SCENES, geometric_mean

OPTIONS = {"--size": dict(default="1024x1024", help="pixels per eye of all tables but the paper's figure (1024x1024)")}
# Real scenes, and the scene of the paper that each stands in for.
REAL = {"teapot_16k": "teapot", "chess_42k": "chess", "bmw_55k": "bmw", "stk-black-forest": "", "crytek-sponza": "", "dabrovic-sponza": "", "stk-cocoa-temple": ""}
STRICT = "depth+row+object+opaque+triangles"
RULES = ["none", "depth", "row", "object", "opaque", "silhouette", "triangle", "triangles", STRICT]
# What leads from plain reuse and the paper's storage to the defaults.
IN_DRAM = "--preset sgrt-paper"
# Machines that differ from the defaults: 64 bits of a 1 MB SRAM at 100 pJ, and rows that do not fit on chip.
LARGE_SRAM, NO_SRAM = "energy.sram_pj_per_byte = 12.5", 'gbuffer.rows = "dram"'
STEPS = {
    "every primary hit, rows in DRAM": f"{IN_DRAM} --reuse primary",
    "strict rule, primary hits, rows in DRAM": f"{IN_DRAM} --reuse primary --rule {STRICT}",
    "strict rule, primary hits, packed rows on chip": f"--reuse primary --rule {STRICT}",
    "strict rule and shadow-edge, shadow outcomes, rows in DRAM": f"{IN_DRAM} --reuse shadow --rule {STRICT}+shadow-edge",
    "strict rule and shadow-edge, shadow outcomes, packed rows on chip": f"--rule {STRICT}+shadow-edge",
    "the defaults": "",
    "the defaults, SRAM at 12.5 pJ per byte": LARGE_SRAM,
    "the defaults, packed rows in DRAM": NO_SRAM,
}
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


def defaults(study, sets):
    """The steps towards the defaults: scenes that the rules were designed on, and others."""
    table = []
    for step, flags in STEPS.items():
        flags = study.config(flags) if flags in (LARGE_SRAM, NO_SRAM) else [flags]
        for name, traces in sets.items():
            rows = [row for row in study.csv("reproject", *traces, *flags) if row["run"] == "chosen"]
            worst = max(rows, key=lambda row: float(row["flip_mean"]))
            energies = {row["scene"].rsplit("/")[-1].split(".")[0]: float(row["relative_energy"]) for row in rows}
            table.append([
                step, name, f"{float(worst['flip_mean']):.4f}", sum(float(row["flip_mean"]) < 0.01 for row in rows), len(rows),
                f"{geometric_mean(float(row['relative_performance']) for row in rows):.3f}", f"{geometric_mean(energies.values()):.3f}",
                f"{max(energies.values()):.2f} ({max(energies, key=energies.get)})", f"{float(rows[0]['detection_sram_kib']):.0f}"])
    return table


def run(study):
    size = study.options.size
    study.scene("crytek-sponza")
    real = study.present(REAL)
    traces = {scene: study.rays(scene, f"--size {size}") for scene in [*SGRT_SCENES, *real, "jungle"]}
    stand_ins = [f"--as {scene}={REAL[scene]}" for scene in real if REAL[scene]]
    rows = study.csv("reproject", *traces.values(), *stand_ins)
    study.write(
        "reprojection", f"tracegen rays SCENE --size {size}, replay reproject *.raytrace --as LABEL=SCENE --csv", COLUMNS,
        [[row[column] for column in COLUMNS.split(" | ")] for row in rows])
    sets = {"design": [traces[scene] for scene in SGRT_SCENES], "held out": [traces[scene] for scene in [*real, "jungle"]]}
    study.write(
        "reprojection-defaults", f"tracegen rays SCENE --size {size}, replay reproject [--preset sgrt-paper] [--rule RULE] [--reuse LEVEL] --csv",
        "detection | scenes | worst FLIP | scenes below 0.01 | of | performance | energy | worst energy | row buffers KiB", defaults(study, sets))

    table = []
    for rule in RULES:
        row = study.csv("reproject", traces["crytek-sponza"], IN_DRAM, "--reuse primary --rule", rule)[0]
        table.append([f"`{rule}`", *(f"{float(row[key]) / unit:.{digits}f}" for key, digits, unit in FIGURES.values())])
    study.write(
        "reprojection-rules", f"tracegen rays crytek-sponza/sponza.gltf --size {size}, replay reproject --preset sgrt-paper --reuse primary --rule RULE --csv",
        " | ".join(["rule", *FIGURES]), table)

    small = [study.rays(scene, "--size 512x512", name=f"small/{scene}") for scene in SGRT_SCENES]
    readings = []
    for reuse in ("primary", "shadow"):
        rows = study.csv("reproject", *small, IN_DRAM, "--reuse", reuse)
        readings.append([row for row in rows if row["run"] == "chosen"])
    table = []
    for primary, shadow in zip(*readings):
        cells = [f"{float(row[start + what]):.2f}" for what in ("relative_performance", "relative_energy")
                 for row, start in ((primary, "paper_"), (primary, ""), (shadow, ""))]
        table.append([primary["scene"], *cells])
    study.write(
        "sgrt-readings", "tracegen rays SCENE --size 512x512, replay reproject *.raytrace --preset sgrt-paper --reuse primary|shadow --csv",
        "scene | performance: paper | performance: primary hits reused | performance: and shadow outcomes | "
        "energy: paper | energy: primary hits reused | energy: and shadow outcomes", table)
