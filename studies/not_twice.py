"""What is not done twice: orders over many frames, equal recipes, equal frames. Times are processor times."""

import shutil

from .common import execute, machine

ORDERS = [
    "z2-sta", "z2-sta-merge", "z2-lrta", "morton", "zig-zag", "zig-zag+sta+offset", "strip+sta+offset", "band4+sta+offset+boustro",
    "hilbert+sta", "zig-zag+sta+row-lines",
]
STUDIED = f"orders --orders {','.join(ORDERS)} --caches 8/128,16/256 --between keep,lose-50,flush --json --quiet"
SIZE = "--size 960x1080"
PATHS = [("jungle", "960x1080", 6), ("atrium", "960x1080", 6), ("jungle", "480x540", 60), ("atrium", "480x540", 60)]


def orders(study):
    """Time of ten orders with two pairs of caches and three treatments between frames, beside one of each."""
    rows = []
    for scene, size, frames in PATHS:
        trace = study.raster(scene, f"--size {size} --path head --frames {frames}", name=f"{scene}-{frames}")
        new = study.replay(STUDIED, trace)
        one = study.replay("run --mode functional --order z2-sta --json --quiet", trace)
        rows.append([scene, size, frames, f"{one.processor_s:.1f}", f"{new.processor_s:.1f}", f"{new.wall_s:.1f}", f"{new.peak_mb:.0f}"])
        study.say(f"{scene}: {rows[-1]}")
        study.drop(trace)
    study.write(
        "not-twice-orders", f"head path: {STUDIED}",
        "scene | size, px per eye | frames | one order s | 60 points s | 60 points, wall s | peak MB", rows, machine(),
    )


def captures(study):
    """Wall time of a capture, of the same recipe again, and of a copy of its output."""
    rows = []
    folder = study.work / "cache"
    cached = {"PARALLAX_CACHE_DIR": str(folder), "PARALLAX_CAPTURE_CACHE_SIZE": "8GiB"}
    for command, scene, options, kind in [
        ("raster", "atrium", SIZE, "textrace"), ("raster", "jungle", f"{SIZE} --path head --frames 4", "textrace"),
        ("rays", "chess", "--size 512x512", "raytrace"),
    ]:
        first, again, copy = (study.work / f"{name}.{kind}" for name in ("first", "again", "copy"))
        runs = [study.tracegen(command, scene, options, "-o", first, **cached)]
        runs += [study.tracegen(command, scene, options, "-o", again, **cached) for _ in range(5)]
        assert first.read_bytes() == again.read_bytes() and runs[0].out == runs[1].out, f"{command} {scene}"
        assert all("from the cache of captures" in run.err for run in runs[1:]), f"{command} {scene}"
        copies = [execute("cp", "--reflink=auto", first, copy).wall_s for _ in range(5)]
        hits = sorted(run.wall_s for run in runs[1:])
        hit, copied = hits[2], sorted(copies)[2]
        megabytes = first.stat().st_size / 1e6
        rows.append([f"{command} {scene}", f"{megabytes:.1f}", f"{runs[0].wall_s:.2f}", f"{hit:.3f}", f"{copied:.3f}", f"{hit - copied:.3f}"])
        for path in (first, again, copy):
            path.unlink()
        shutil.rmtree(folder)
    study.write(
        "not-twice-captures", "median of five hits and of five copies",
        "command | output MB | capture s | again s | copy s | again beside the copy s", rows, machine(),
    )


def frames(study):
    """Sizes of a trace of 12 equal frames beside one frame, and times to replay it."""
    poses = study.work / "still.csv"
    poses.write_text("time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n")
    rows = []
    for scene in ("atrium", "jungle"):
        one, twelve = (study.raster(scene, f"{SIZE} --path {poses} --frames {n}", name=f"{scene}-still-{n}") for n in (1, 12))
        sizes = [trace.stat().st_size for trace in (one, twelve)]
        times = [study.replay("run --mode functional --order z2-sta --json --quiet", trace).processor_s for trace in (one, twelve)]
        rows.append([scene, f"{sizes[0] / 1e6:.2f}", f"{sizes[1] / 1e6:.2f}", f"{sizes[1] / sizes[0]:.3f}", f"{times[0]:.2f}", f"{times[1]:.2f}"])
        study.drop(one, twelve)
    study.write(
        "not-twice-frames", f"{SIZE}, a head that does not move",
        "scene | one frame MB | 12 frames MB | ratio | replay of one s | replay of 12 s", rows, machine(),
    )


def run(study):
    orders(study)
    captures(study)
    frames(study)
