"""Answers from some frames of a path: how often their intervals hold, and what they cost, over 12 scenes and 3 paths."""

import json
import math
import random
import shutil
from pathlib import Path

from .common import machine, mean

OPTIONS = {
    "--size": dict(default="960x1080", help="pixels per eye (960x1080)"),
    "--caches": dict(default="8/64,8/128,16/256,16/512", help="L1/L2 KiB of the machines (8/64,8/128,16/256,16/512)"),
    "--frames": dict(type=int, default=60, help="frames of each path (60)"),
    "--draws": dict(type=int, default=400, help="samples of each population (400)"),
    "--within": dict(default="1points", help="largest half width (1points)"),
    "--only": dict(help="scenes, comma-separated (all 12)"),
    "--paths": dict(default="head,cuts,walk", help="paths (head,cuts,walk)"),
    "--populations": dict(help="folder of counts by frame, which are kept and used again (OUT/sampling)"),
}
SCENES = [
    "crytek-sponza", "dabrovic-sponza", "stk-cocoa-temple", "stk-black-forest", "chess_42k", "atrium-plain",
    "atrium", "jungle", "plant", "meadow", "lab", "music-box",
]
ORDERS = "z2-lrta,z2-sta,zig-zag+sta+offset"


def cut_path(path, frames):
    """Poses in the camera's system: four walks that are cut together, each in another direction and with a speed of its own."""
    lines = ["time_s,x_m,y_m,z_m,qx,qy,qz,qw"]
    quarters = [(0, 0.01, 0.2), (70, 0.05, 0.0), (-110, 0.0, 1.5), (180, 0.02, -0.4)]
    for frame in range(frames):
        yaw, step, turn = quarters[4 * frame // frames]
        at = frame - frames * (4 * frame // frames) // 4
        angle = math.radians(yaw + turn * at) / 2
        lines.append(f"{frame / 72:.6f},0,0,{-step * at:.4f},0,{math.sin(angle):.6f},0,{math.cos(angle):.6f}")
    path.write_text("\n".join(lines) + "\n")


def population(study, folder, scene, path):
    """The plan and the counts by frame of a path, which are captured unless they are there."""
    name = f"{scene}-{path}-{study.options.size}-{study.options.frames}"
    plan, values, costs = (folder / f"{name}.{kind}" for kind in ("textrace", "csv", "json"))
    if not costs.exists():
        view = path
        if path == "cuts":
            view = study.work / "cuts.csv"
            cut_path(view, study.options.frames)
        words = ["raster", study.scene(scene), "--quiet", "--path", view, "--frames", study.options.frames, "--size", study.options.size]
        planned = study.tracegen(*words, "--plan-only", "-o", study.work / "plan.textrace")
        whole = study.work / "all.textrace"
        captured = study.tracegen(*words, "--no-plain", "-o", whole)
        replayed = study.replay(
            "sample", study.work / "plan.textrace", whole, "--quiet --orders", ORDERS, "--caches", study.options.caches, "--save-values", values, "--draws 1")
        whole.unlink()
        shutil.copy(study.work / "plan.textrace", plan)
        costs.write_text(json.dumps({key: one.processor_s for key, one in [("plan", planned), ("capture", captured), ("replay", replayed)]}))
        study.say(name)
    return plan, values, json.loads(costs.read_text())


def summary(rows, draws):
    """What the populations of each path have in common."""
    out = []
    for path in [*dict.fromkeys(row[1] for row in rows), "all"]:
        of = [row for row in rows if path in (row[1], "all")]
        # At least a tenth of the samples stopped before the last frame, so that their share means something.
        stopped = [row for row in of if float(row[7]) < 0.9 * draws]
        holds = [float(row[5]) for row in stopped]
        worst = min(stopped, key=lambda row: float(row[5]))
        ratios = [float(row[8]) / max(float(row[9]), 1) for row in of]
        out.append([
            path, len(of), len(stopped), f"{mean(100.0 * (share >= 90.0) for share in holds):.1f}", f"{mean(holds):.1f}",
            f"{worst[5]} ({worst[0]}, {worst[2]}, {worst[3]})", f"{mean(float(row[8]) for row in of):.1f}", f"{mean(ratios):.2f}",
            f"{mean(float(row[10]) for row in stopped):.2f}"])
    return out


def walk_of(random, count, deviation, correlation):
    """Normal values, each correlated with the one before."""
    at, out = random.gauss(0, deviation), []
    for _ in range(count):
        out.append(at)
        at = correlation * at + random.gauss(0, deviation * math.sqrt(1 - correlation**2))
    return out


def made_up(random, frames):
    """Savings by frame that the counts of a plan say nothing about."""
    knee = random.randrange(frames // 4, 3 * frames // 4)
    return {
        "noise, deviation 1 point": [0.3 + v for v in walk_of(random, frames, 0.01, 0)],
        "noise, deviation 3 points": [0.3 + v for v in walk_of(random, frames, 0.03, 0)],
        "slow change, deviation 3 points": [0.3 + v for v in walk_of(random, frames, 0.03, 0.95)],
        "skewed, deviation 3 points": [0.3 - 0.03 * random.expovariate(1) for _ in range(frames)],
        "a jump from 15 to 45 %": [(0.15 if at < knee else 0.45) + v for at, v in enumerate(walk_of(random, frames, 0.01, 0.5))],
        "20 points more in 8 % of the frames": [0.3 + v + 0.2 * (random.random() < 0.08) for v in walk_of(random, frames, 0.005, 0)],
    }


def limits(study):
    """How often intervals hold on made-up paths."""
    options, found = study.options, {}
    plan, values = study.work / "limits.textrace", study.work / "limits.csv"
    study.tracegen("raster teapot --quiet --plan-only --path head --size 64x64 --frames", options.frames, "-o", plan)
    for seed in range(5):
        numbers = random.Random(seed)
        base = [1e6 * (1 + v) for v in walk_of(numbers, options.frames, 0.1, 0.9)]
        for kind, savings in made_up(numbers, options.frames).items():
            lines = ["caches,order,frame,external_bytes,footprints,l1_footprint_misses,l2_line_lookups,l2_line_misses,cycles"]
            for frame, (share, whole) in enumerate(zip(savings, base)):
                lines += [f"16/256,morton,{frame},{whole:.0f},1,0,1,0,0", f"16/256,z2-sta,{frame},{whole * (1 - share):.0f},1,0,1,0,0"]
            values.write_text("\n".join(lines) + "\n")
            [trial] = study.csv("sample", plan, "--values", values, "--draws", options.draws, "--within", options.within)
            found.setdefault(kind, []).append({key: float(trial[key]) for key in ("holds_pct", "mean_frames", "oracle_frames")})
    rows = []
    for kind, trials in found.items():
        holds = [trial["holds_pct"] for trial in trials]
        frames, oracle = (mean(trial[key] for trial in trials) for key in ("mean_frames", "oracle_frames"))
        rows.append([kind, f"{min(holds):.0f} to {max(holds):.0f}", f"{frames:.0f}", f"{oracle:.0f}"])
    study.write(
        "sampling-limits", f"five paths of {options.frames} frames each, made up; {options.draws} samples", "saving by frame | interval holds % | frames | oracle", rows)


def run(study):
    options = study.options
    folder = study.out if not options.populations else Path(options.populations).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    rows, costs = [], []
    scenes, paths = study.present(options.only.split(",") if options.only else SCENES), options.paths.split(",")
    populations = {(scene, path): population(study, folder, scene, path) for path in paths for scene in scenes}
    for (scene, path), (plan, values, cost) in sorted(populations.items(), key=lambda item: (scenes.index(item[0][0]), item[0][1])):
        trials = study.csv(
            "sample", plan, "--values", values, "--orders", ORDERS, "--caches", options.caches, "--draws", options.draws, "--within", options.within)
        for trial in trials:
            figure = {key: float(trial[key]) for key in trial if key not in ("caches", "order", "figure")}
            width = figure["mean_half"] / figure["known_half"] if figure["known_half"] else 1.0
            rows.append([
                scene, path, trial["order"], trial["caches"], f"{figure['truth']:.2f}", f"{figure['holds_pct']:.1f}", f"{figure['kept_pct']:.1f}",
                f"{figure['of_everything']:.0f}", f"{figure['mean_frames']:.1f}", f"{figure['oracle_frames']:.0f}", f"{width:.2f}"])
        costs.append([scene, path, *(f"{cost[key]:.1f}" for key in ("plan", "capture", "replay"))])
    detail = f"replay sample PLAN --values COUNTS --draws {options.draws} --within {options.within}; {options.frames} frames at {options.size}"
    study.write(
        "sampling", detail,
        "scene | path | order | L1/L2 KiB | saving % | interval holds % | as narrow as promised % | drew all frames | frames | oracle | width ratio", rows)
    study.write(
        "sampling-summary", detail,
        "path | populations | stopped | held in 90 % or more, % | holds in the mean % | worst % | frames | over the oracle | width over known", summary(rows, options.draws))
    limits(study)
    study.write("sampling-cost", "processor seconds of a path of all frames", "scene | path | plan s | capture s | replay s", costs, machine())
