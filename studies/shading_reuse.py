"""Shading reuse between the eyes: fragments, error and traffic on seven scenes, and whether `--auto` chooses it."""

import json

SIZES = ["480x540", "960x1080"]
# The default contrast was chosen on the first three.
CHOSEN_ON = ["atrium", "jungle", "plant"]
SCENES = [*CHOSEN_ON, "crytek-sponza", "stk-cocoa-temple", "stk-black-forest", "chess_42k"]
BUDGETS = ["flip=0.01", "flip=0.02"]
OBJECTIVES = ["fragments", "energy"]
NAME = "shading-reuse"
FRAMES = "--path head --frames 2 --repeats 1"


def measured(study, scene, size):
    folder = study.out / f"{scene}-{size}"
    study.tracegen("techniques", study.scene(scene), f"{FRAMES} --size {size} --only {NAME} -o", folder)
    found = study.json("techniques", folder)
    row = next(row for row in found["rows"] if row["technique"] == NAME)
    saved = {row["technique"]: row["saved_pct"] for row in found["orders"]}
    percent = lambda key: f"{100 * row[key]:.1f}"
    return [scene, "yes" if scene in CHOSEN_ON else "no", size, percent("fragments_ratio"), f"{row['flip_mean']:.4f}", f"{row['flip_worst']:.4f}",
            percent("memory_bytes_ratio"), percent("energy_ratio"), percent("processor_time_ratio"), f"{saved['per-eye']:.1f}", f"{saved[NAME]:.1f}"]


def choice(study, scene, objective, budget):
    folder = study.out / f"{scene}-auto-{objective}"
    study.tracegen("techniques", study.scene(scene), f"{FRAMES} --size {SIZES[0]} --only per-eye --auto {budget} --objective {objective} -o", folder)
    chosen = json.loads((folder / "manifest.json").read_text())["auto"]["chosen"]["technique"]
    parts = [part for part in chosen.split("+") if part.startswith(NAME)]
    return [scene, objective, budget.split("=")[1], parts[0] if parts else "no", chosen]


def run(study):
    scenes = study.present(SCENES)
    rows, choices = [], []
    for scene in scenes:
        study.say(scene)
        rows += [measured(study, scene, size) for size in SIZES]
        choices += [choice(study, scene, objective, budget) for objective in OBJECTIVES for budget in BUDGETS]
    study.write(
        "shading-reuse", f"tracegen techniques SCENE {FRAMES} --size SIZE --only {NAME} -o DIR; replay techniques DIR --json",
        "scene | default chosen on it | pixels per eye | fragments % | FLIP, mean | FLIP, worst | bytes % | energy % | processor time % | "
        "Z2 STA saves % | with reuse %", rows)
    study.write(
        "shading-reuse-auto", f"tracegen techniques SCENE {FRAMES} --size {SIZES[0]} --auto flip=BUDGET --objective OBJECTIVE",
        "scene | objective | FLIP allowed | shading reuse | choice", choices)
