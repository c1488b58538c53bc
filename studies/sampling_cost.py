"""Answers from some frames of long paths: what they cost beside a replay of all frames, and how far they are from it."""

import csv
import json
import math
from pathlib import Path

from .common import machine, mean, read_csv

OPTIONS = {
    "--measured": dict(help="folder of the measured paths, which are kept and used again (OUT/sampling-cost)"),
}
# Scene, path, frames, pixels per eye, caches (KiB).
PATHS = [
    ("atrium", "head", 600, "240x270", "16/256"), ("lab", "head", 900, "240x270", "8/64"), ("dabrovic-sponza", "head", 1200, "480x540", "8/64"),
    ("atrium-plain", "head", 1200, "480x540", "8/64"),
    *((scene, "head", 900, "240x270", "8/64") for scene in ("music-box", "chess_42k", "crytek-sponza")),
    *((scene, "walk", 900, "240x270", "8/64") for scene in ("lab", "music-box", "chess_42k", "dabrovic-sponza", "atrium-plain")),
]


def totals(path):
    """Bytes by frame of the baseline and of the order."""
    by_order = {}
    for row in read_csv(path):
        by_order.setdefault(row["order"], {})[int(row["frame"])] = float(row["external_bytes"])
    base, own = by_order["morton"], by_order["z2-sta"]
    return [(base[frame], own[frame]) for frame in sorted(base)]


def measured(study, folder, scene, path, frames, size, caches):
    """Everything about a path, measured unless it is there."""
    done = folder / f"{scene}-{path}-{size}-{frames}.json"
    if done.exists():
        return json.loads(done.read_text())
    words = ["raster", study.scene(scene), "--quiet --no-plain --path", path, "--frames", frames, "--size", size]
    machine_of = ["--caches", caches, "--quiet --csv"]
    keep, values, whole = study.work / "keep", study.work / "values.csv", study.work / "all.textrace"
    sampled = study.replay(
        "sample --within 1points --keep", keep, *machine_of, "--save-values", study.work / "part.csv", "--", study.bin / "tracegen", *words, allowed=(0, 1))
    captured = study.tracegen(*words, "-o", whole)
    replayed = study.replay("sample", keep / "plan.textrace", whole, *machine_of, "--save-values", values, "--draws 1")
    whole.unlink()
    parts = sorted(keep.glob("stage-*.textrace"))
    planned = study.tracegen(*words, "--plan-only", "-o", study.work / "plan.textrace")
    every, count = totals(values), len(totals(study.work / "part.csv"))
    base, own = (sum(pair[at] for pair in every) for at in (0, 1))
    ratio = own / base
    residuals = [a - ratio * b for b, a in every]
    [row] = csv.DictReader(sampled.out.splitlines())
    # Of the frames that were captured anyway; exit code 1 says that an interval is wide.
    of_bytes = study.replay("sample", keep / "plan.textrace", *parts, *machine_of, "--of bytes --within 100%", allowed=(0, 1)).out
    [estimate] = [float(one["value"]) for one in csv.DictReader(of_bytes.splitlines()) if one["order"] == "z2-sta"]
    for file in (*parts, keep / "plan.textrace"):
        file.unlink()
    found = dict(
        deviation=100 * math.sqrt(mean(r * r for r in residuals)) / (base / len(every)), frames=count, stages=len(parts), saving=100 * (1 - ratio),
        error=float(row["value"]) - 100 * (1 - ratio), held=float(row["value_low"]) <= 100 * (1 - ratio) <= float(row["value_high"]),
        bytes_error=100 * (estimate / (own / len(every)) - 1), capture=captured.processor_s, replay=replayed.processor_s,
        plan=planned.processor_s, sample=sampled.processor_s)
    done.write_text(json.dumps(found))
    study.say(done.stem)
    return found


def run(study):
    options, rows = study.options, []
    folder = study.out if not options.measured else Path(options.measured).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    present = study.present(dict.fromkeys(scene for scene, *_ in PATHS))
    for scene, path, frames, size, caches in (of for of in PATHS if of[0] in present):
        one = measured(study, folder, scene, path, frames, size, caches)
        every = one["capture"] + one["replay"]
        rows.append([
            scene, path, size, caches, f"{one['deviation']:.2f}", f"{one['frames']} of {frames}", f"{one['saving']:.2f}", f"{one['error']:.3f}",
            "yes" if one["held"] else "no", f"{one['bytes_error']:.1f}", f"{every:.1f}", f"{one['plan']:.1f}", f"{one['sample']:.1f}",
            f"{every / one['sample']:.1f}"])
    study.write(
        "sampling-long", "replay sample --within 1points; processor seconds of everything, of the plan in the sample, and of the sample",
        "scene | path | pixels per eye | L1/L2 KiB | deviation, points | frames | saving % | error, points | held | bytes error % | everything s | plan s | sample s | times less",
        # Paths are measured at different times, so the load at the end says nothing.
        rows, machine().split(", load")[0])
