"""Shading reuse between the eyes: fragments, error and traffic on six scenes, and whether `--auto` chooses it."""

import json

OPTIONS = {"--only": dict(default=None, help="scenes, with commas between them (all)")}
SIZE, LARGER = "480x540", "960x1080"
# A search renders some 40 combinations.
SEARCHED = "240x270"
# The default contrast was chosen on the first three.
CHOSEN_ON = ["atrium", "jungle", "plant"]
SCENES = [*CHOSEN_ON, "crytek-sponza", "stk-cocoa-temple", "stk-black-forest"]
# Measured at the larger size as well.
ALSO_LARGER = ["atrium", "crytek-sponza"]
BUDGETS = ["0.01", "0.02"]
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


def choice(study, scene, budget):
    folder = study.out / f"{scene}-auto"
    study.tracegen("techniques", study.scene(scene), f"{FRAMES} --size {SEARCHED} --only per-eye --auto flip={budget} --objective fragments -o", folder)
    chosen = json.loads((folder / "manifest.json").read_text())["auto"]["chosen"]["technique"]
    parts = [part for part in chosen.split("+") if part.startswith(NAME)]
    return [scene, budget, parts[0] if parts else "no", chosen]


def run(study):
    only = study.options.only.split(",") if study.options.only else SCENES
    rows, choices = [], []
    for scene in study.present(only):
        study.say(scene)
        rows += [measured(study, scene, size) for size in ([SIZE, LARGER] if scene in ALSO_LARGER else [SIZE])]
        choices += [choice(study, scene, budget) for budget in BUDGETS]
    study.write(
        "shading-reuse", f"tracegen techniques SCENE {FRAMES} --size SIZE --only {NAME} -o DIR; replay techniques DIR --json",
        "scene | default chosen on it | pixels per eye | fragments % | FLIP, mean | FLIP, worst | bytes % | energy % | processor time % | "
        "Z2 STA saves % | with reuse %", rows)
    study.write(
        "shading-reuse-auto", f"tracegen techniques SCENE {FRAMES} --size {SEARCHED} --auto flip=BUDGET --objective fragments",
        "scene | FLIP allowed | shading reuse | choice", choices)
