"""Run time against error, from capture to technique: OUT/accuracy/accuracy.html, and tables of times and of reuse rules."""

import csv
from pathlib import Path

from .common import read_csv

OPTIONS = {
    "--size": dict(default="480x540", help="pixels per eye (480x540)"),
    "--techniques": dict(type=Path, help="folder of `tracegen techniques` (default: a small run of its own)"),
}
# Study and choice in times.csv, what the table calls it, and what its time is divided by.
TIMES = [
    ("capture", "llvmpipe", "capture by llvmpipe", "reference in double precision"),
    ("capture", "softpipe", "capture by softpipe", "reference in double precision"),
    ("encoding", "delta", "delta encoding", "raw records"),
    ("encoding", "planes", "plane encoding", "raw records"),
    ("mode", "functional", "functional replay", "timed replay"),
    ("model", "first miss", "first-miss model", "timed replay"),
    ("lod", "fast logarithm, per quad", "fast logarithm, a level per quad", "exact logarithm, a level per lane"),
    ("sets", "1/4 of the sets", "a quarter of the sets", "all sets"),
    ("tiles", "1/4 of the tiles", "a quarter of the tiles", "all tiles"),
    ("frames", "1/4 of the frames, cold", "a quarter of 16 frames, each from empty caches", "all frames"),
    ("frames", "1/4 of the frames, warmed", "a quarter of 16 frames, each after the one before it", "all frames"),
]
RULES = ["none", "depth=0.02+row=0.02+object+opaque+gap+triangles+shadow-edge", "depth=0.02+object+opaque+silhouette+triangle"]
RAY_SCENES = ["chess", "music-box"]


def inputs(study, folder):
    """Makes the inputs of `replay accuracy`, notes the times of captures in a file, and returns the arguments."""
    seconds, capture = [], f"raster -q --size {study.options.size} --no-plain"

    def timed(name, *words, **more):
        done = study.tracegen(*words, **more)
        seconds.append([name, done.wall_s])
        return done

    for scene in ("atrium", "jungle"):
        study.say(f"capture {scene}, and make the reference in double precision")
        trace, truth = folder / f"{scene}.textrace", folder / f"{scene}-reference.textrace"
        timed(scene, capture, f"{scene} -o", trace)
        timed(f"{scene}-reference", f"verify -q {scene} --trace", trace, "--write-reference", truth)
        yield from [trace, "--truth", truth]
    study.say("capture atrium through softpipe")
    trace = folder / "atrium-softpipe.textrace"
    done = timed("atrium-softpipe", capture, "atrium --backend osmesa -o", trace, allowed=(0, 1, 2), GALLIUM_DRIVER="softpipe")
    if done.code:
        seconds.pop()
        study.say("no OSMesa here: the row of softpipe is left out")
    else:
        yield from ["--capture", trace]
    study.say("capture 16 frames of a head in the atrium")
    frames = folder / "frames.textrace"
    study.tracegen("raster -q atrium --size 240x270 --path head --frames 16 --no-plain -o", frames)
    yield frames
    for scene in RAY_SCENES:
        study.say(f"trace rays of {scene}")
        trace = folder / f"{scene}.raytrace"
        study.tracegen(f"rays -q {scene} --size 384x384 -o", trace)
        yield from ["--rays", trace]
    study.say("precision of the ray traversal")
    study.tracegen("precision -q -o", folder / "precision.json")
    yield from ["--traversal", folder / "precision.json"]
    techniques = study.options.techniques
    if not techniques:
        study.say("rendering techniques on the plant, a small run")
        techniques = folder / "techniques"
        study.tracegen("techniques -q plant --size 240x270 --path head --frames 1 --repeats 3 --trace-frames 1 -o", techniques)
    yield from ["--techniques", techniques]
    with open(folder / "seconds.csv", "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([["trace", "seconds"], *seconds])


def run(study):
    folder = study.out / "captures"
    folder.mkdir(parents=True, exist_ok=True)
    arguments = list(inputs(study, folder))
    study.say("measure")
    done = study.replay("accuracy -q", *arguments, "--seconds", folder / "seconds.csv", "-o", study.out)
    (study.out / "accuracy.txt").write_text(done.out)
    times = {(row["study"], row["choice"], row["scene"]): float(row["time_ratio"]) for row in read_csv(study.out / "times.csv")}
    cell = lambda *key: f"{times[key]:.2f}" if key in times else "-"
    study.write(
        "accuracy-times", "", "choice | time over that of | atrium | jungle | 16 frames of atrium",
        [[title, over, *(cell(of, choice, scene) for scene in ("atrium", "jungle", "frames"))] for of, choice, title, over in TIMES])
    figures = {(row["choice"], row["scene"], row["figure"]): float(row["value"]) for row in read_csv(study.out / "choices.csv") if row["study"] == "rules"}
    study.write(
        "accuracy-rays", "", "rule | scene | time over both eyes in full | FLIP, mean | right pixels reused %",
        [[rule, scene, f"{times['rules', rule, scene]:.3f}", f"{figures[rule, scene, 'flip_mean']:.4f}", f"{figures[rule, scene, 'reused_pct']:.1f}"]
         for rule in RULES for scene in RAY_SCENES])
    study.say(f"done: {study.out / 'accuracy.html'}")
