"""Refit and rebuild of the hierarchy of scenes that move: steps, hierarchy DRAM bytes and update bytes over the frames after a build.

Needs `npm`: two scenes are files of packages that scene_files.csv pins. About ten minutes.
"""

import re
from concurrent.futures import ThreadPoolExecutor

from .common import ROOT, Absent, read_csv
from .scene_files import archive, unpack

OPTIONS = {
    "--size": dict(default="512x512", help="pixels per eye (512x512)"),
    "--frames": dict(default="1,8,16,30,60,120", help="frames at 72 frames per second; of the plant, every other one (1,8,16,30,60,120)"),
}
SCENES = {
    "plant": ["plant"],
    "plant, instances": ["plant", "--instances"],
    "soldier": ["threebox-plugin", "package/examples/models/Soldier.glb", "--animation Run"],
    "avatar": ["janusweb", "package/media/assets/janus-avatar-animations.glb", "--animation jump --eye 0,100,140 --target 0,85,0 --ipd 6400"],
}
TREES = ["bvh2", "cwbvh8"]
METHODS = ["refit", "rebuild"]


def scene(study, name):
    """The words of the scene's capture."""
    first, *more = SCENES[name]
    package = next((row for row in read_csv(ROOT / "studies/scene_files.csv") if row["package"] == first), None)
    if not package:
        return SCENES[name]
    folder = study.out.parent / "scene-files"
    (folder / "downloads").mkdir(parents=True, exist_ok=True)
    try:
        path = archive(package, folder / "downloads")
    except OSError as error:
        raise Absent(str(error)) from error
    return [unpack(path, folder / "files" / f"{first}-{package['version']}") / more[0], *more[1:]]


def measured(study, name, tree, frame, method):
    """Counts of both eyes in full, and the bytes of the update."""
    trace = study.work / f"{re.sub(r'[^a-z0-9]+', '-', name)}-{tree}-{frame}-{method}.raytrace"
    study.tracegen("rays", *scene(study, name), "--visits --quiet --size", study.options.size, "--bvh", tree, "--frame", frame, "--bvh-update", method, "-o", trace)
    found = study.json("reproject --rule none", trace)
    update = study.json("info", trace)["hierarchy"]["update"]
    trace.unlink()
    work, bytes = found["result"]["reference_work"], found["result"]["reference_dram"]["hierarchy_bytes"]
    builders = [found["hierarchy_update"], found["hierarchy_update"].get("ploc")]
    return {
        "steps": work["steps"] / work["rays"],
        "rays": bytes,
        "triangles": update["triangles_written"],
        "updates": [of["read_bytes"] + of["written_bytes"] for of in builders if of],
    }


def pays(frames, excess, rebuild):
    """The frame up to which the rays of refitted trees have read as many bytes more as a rebuild costs more than a refit. Frames in between are
    interpolated."""
    total, before, last = 0, 0, 0
    for frame, now in zip(frames, excess):
        for at in range(last + 1, frame + 1):
            total += before + (now - before) * (at - last) / (frame - last)
            if total >= rebuild:
                return str(at)
        before, last = now, frame
    return f"after {frames[-1]}"


def run(study):
    asked = [int(frame) for frame in study.options.frames.split(",")]
    mb = lambda bytes: f"{bytes / 1e6:.3f}"
    rows, summary = [], []
    with ThreadPoolExecutor(2) as pool:
        for name in SCENES:
            # Captures of the plant take ten times as long.
            trees, frames = (TREES[1:], asked[::2]) if name.startswith("plant") else (TREES, asked)
            for tree in trees:
                jobs = {(frame, method): pool.submit(measured, study, name, tree, frame, method) for frame in frames for method in METHODS}
                found = {key: job.result() for key, job in jobs.items()}
                excess = []
                for frame in frames:
                    refit, rebuild = (found[frame, method] for method in METHODS)
                    excess.append(refit["rays"] - rebuild["rays"])
                    steps = [f"{of['steps']:.2f}" for of in (refit, rebuild)]
                    bytes = [refit["rays"], rebuild["rays"], *refit["updates"], *rebuild["updates"]]
                    rows.append([name, tree, frame, f"{refit['triangles']:,}", *steps, *map(mb, bytes)])
                builders, [own] = rebuild["updates"], refit["updates"]
                more = 100 * sum(excess) / sum(found[frame, "rebuild"]["rays"] for frame in frames)
                summary.append([name, tree, mb(own), *map(mb, builders), mb(rebuild["rays"]), f"{more:.1f}", *(pays(frames, excess, builder - own) for builder in builders)])
                study.say(f"{name}, {tree}")
    detail = f"--size {study.options.size} --frames {study.options.frames}"
    study.write("tree-updates", detail, "scene | tree | frame | moved triangles | steps per ray, refit | steps per ray, rebuilt | rays MB, refit | rays MB, rebuilt"
                " | refit MB | rebuild MB, LBVH | rebuild MB, PLOC", rows)
    study.write("tree-updates-summary", detail, "scene | tree | refit MB | rebuild MB, LBVH | rebuild MB, PLOC | rays MB, rebuilt | more bytes of rays, refit %"
                " | a rebuild pays at frame, LBVH | a rebuild pays at frame, PLOC", summary)
