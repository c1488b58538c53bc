"""The choices of `--auto` against the full table of techniques, and that table: three scenes, two densities of pixels, four objectives."""

import json

# The share of the baseline's cost, by objective.
COSTS = {"fragments": "fragments_ratio", "bytes": "memory_bytes_ratio", "energy": "energy_ratio", "time": "frame_time_ratio"}
OPTIONS = {
    "--budgets": dict(nargs="+", default=["flip=0.05"], help="budgets of image error (flip=0.05)"),
    "--objectives": dict(nargs="+", default=list(COSTS), choices=COSTS, help="what to reduce (all four)"),
    "--views": dict(nargs="+", default=["480x540:100", "768x864:67"], help="pixels per eye and degrees; the last one is that of the table of techniques"),
}
SCENES = ["plant", "atrium", "jungle"]
COMMAND = "tracegen techniques SCENE --path head --path-frames 12 --frames 2 --repeats"


def measure(study, scene, view, budget, objective):
    """The folder's manifest, and what `replay techniques` finds in it."""
    size, degrees = view.split(":")
    folder, repeats = study.out / f"{scene}-{size}", 1
    # Counts repeat exactly. Times need eight measurements for a claim: two frames, four repeats.
    if objective == "time":
        folder, repeats = study.out / f"{scene}-{size}-time", 4
    # Goes on where an interrupted run was.
    study.tracegen(
        f"techniques {scene} --path head --path-frames 12 --frames 2 --repeats {repeats} --size {size} --hfov {degrees}",
        f"--auto {budget} --objective {objective} -o", folder)
    return json.loads((folder / "manifest.json").read_text()), study.json("techniques", folder)


def is_auto(row):
    return row["technique"].startswith("auto-")


def choice(scene, budget, objective, manifest, rows):
    chosen = rows[-1]
    assert is_auto(chosen), chosen["technique"]
    dominated = chosen["dominated"] if objective == "time" else objective in chosen["dominated_in"].split()
    return [scene, f"{manifest['pixels_per_degree']:.1f}", objective, budget, manifest["auto"]["chosen"]["technique"], f"{chosen[COSTS[objective]]:.3f}",
            f"{chosen['flip_worst']:.4f}", len(rows) - 1, "yes" if dominated else "no"]


def technique(row):
    quartiles = " to ".join(f"{row[f'frame_time_ratio_{quartile}']:.2f}" for quartile in ("q1", "q3"))
    ratios = [f"{row[f'{key}_ratio']:.2f}" for key in ("cull_tests", "draws", "fragments", "memory_bytes", "energy")]
    return [row["technique"], f"{row['frame_time_ratio']:.2f} ({quartiles})", *ratios, row["false_negatives"], f"{row['flip_mean']:.4f}",
            f"{row['flip_worst']:.4f}", f"{row['external_mb_per_frame']:.3f}", row["dominated_in"] or "-"]


def write_techniques(study, found):
    """Tables of one view: each scene's techniques, what orders save with them, published figures."""
    size, degrees = study.options.views[-1].split(":")
    detail = f"{COMMAND} 1 --size {size} --hfov {degrees} -o DIR; replay techniques DIR --json"
    gains, published = {}, []
    for scene in SCENES:
        study.write(
            f"techniques-{scene}", detail,
            "technique | time (quartiles) | tests | draws | fragments | bytes | energy | draws missed | FLIP, mean | FLIP, worst | texture MB per frame | "
            "dominated in", [technique(row) for row in found[scene]["rows"] if not is_auto(row)])
        for row in found[scene]["orders"]:
            if not is_auto(row):
                gains.setdefault(row["technique"], []).extend(f"{row[key]:.1f}" for key in ("saved_pct", "shared_pct", "headroom_pct"))
        published += [
            [row["technique"], row["quantity"], scene, row["published_pct"], f"{row['ours_pct']:.1f}", f"{row['flip_mean']:.4f}", row["source"]]
            for row in found[scene]["published"]]
    study.write(
        "techniques-orders", detail,
        "technique | plant: saved | plant: shared | plant: above bound | atrium: saved | atrium: shared | atrium: above bound | "
        "jungle: saved | jungle: shared | jungle: above bound", [[name, *cells] for name, cells in gains.items()])
    published.sort(key=lambda row: (row[0], row[1], SCENES.index(row[2])))
    study.write("techniques-published", detail, "technique | saves | scene | published % | ours % | FLIP, mean | source", published)


def run(study):
    options, rows, last = study.options, [], {}
    for scene in SCENES:
        for view in options.views:
            for budget in options.budgets:
                for objective in options.objectives:
                    manifest, found = measure(study, scene, view, budget, objective)
                    rows.append(choice(scene, budget, objective, manifest, found["rows"]))
                    if objective != "time":
                        last[scene] = found
    study.write(
        "auto-choices", f"{COMMAND} N --size SIZE --hfov DEG --auto BUDGET --objective OBJECTIVE, then replay techniques --json",
        "scene | pixels per degree | objective | budget | choice | cost, of the baseline's | error of the worst picture, FLIP | rows of the table | dominated",
        rows)
    if last:
        write_techniques(study, last)
