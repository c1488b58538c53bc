#!/bin/sh
# Measures run time against error on built-in scenes, from capture to technique, and writes tables,
# charts and one page. The table of errors that reports show is errors.csv of such a run.
#   SIZE=WxH       pixels an eye (480x540)
#   RESULTS=1      also write results/accuracy-times.csv and results/accuracy-rays.csv
#   TECHNIQUES=DIR a folder of `tracegen techniques` (default: a small run of its own)
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/accuracy
size=${SIZE:-480x540}
bin=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$out/captures"
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

seconds=$out/captures/seconds.csv
echo trace,seconds > "$seconds"
# Makes a trace with a command and notes its time: timed NAME COMMAND...
timed() {
    name=$1
    shift
    from=$(date +%s.%N)
    "$@" || return
    echo "$name,$(date +%s.%N | awk -v from="$from" '{ print $1 - from }')" >> "$seconds"
}

set --
for scene in atrium jungle; do
    say "capture $scene, and make the reference in double precision"
    trace=$out/captures/$scene.textrace
    truth=$out/captures/$scene-reference.textrace
    timed "$scene" "$bin/tracegen" raster -q "$scene" --size "$size" --no-plain -o "$trace"
    timed "$scene-reference" "$bin/tracegen" verify -q "$scene" --trace "$trace" --write-reference "$truth" \
        > "$out/captures/$scene-verify.txt"
    set -- "$@" "$trace" --truth "$truth"
done
say "capture atrium through softpipe"
trace=$out/captures/atrium-softpipe.textrace
if (export GALLIUM_DRIVER=softpipe
    timed atrium-softpipe "$bin/tracegen" raster -q atrium --size "$size" --no-plain --backend osmesa -o "$trace"); then
    set -- "$@" --capture "$trace"
else
    say "no OSMesa here: the row of softpipe is left out"
fi
say "capture 16 frames of a head in the atrium"
"$bin/tracegen" raster -q atrium --size 240x270 --path head --frames 16 --no-plain -o "$out/captures/frames.textrace"
set -- "$@" "$out/captures/frames.textrace"
for scene in chess music-box; do
    say "trace rays of $scene"
    "$bin/tracegen" rays -q "$scene" --size 384x384 -o "$out/captures/$scene.raytrace"
    set -- "$@" --rays "$out/captures/$scene.raytrace"
done
say "precision of the ray traversal"
"$bin/tracegen" precision -q -o "$out/captures/precision.json"
set -- "$@" --traversal "$out/captures/precision.json"
techniques=${TECHNIQUES:-}
if [ -z "$techniques" ]; then
    say "rendering techniques on the plant, a small run"
    techniques=$out/captures/techniques
    "$bin/tracegen" techniques -q plant --size 240x270 --path head --frames 1 --repeats 3 --trace-frames 1 -o "$techniques"
fi
set -- "$@" --techniques "$techniques"
say "measure"
"$bin/replay" accuracy -q "$@" --seconds "$seconds" -o "$out" > "$out/accuracy.txt"
say "done: $out/accuracy.html"
[ -n "${RESULTS:-}" ] || exit 0
python3 - "$out" <<'PYTHON'
import csv, sys

COMMAND = "# command: RESULTS=1 make accuracy\n"
DEFAULT = "depth=0.02+row=0.02+object+opaque+triangles"


def rows(name):
    with open(f"{sys.argv[1]}/{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


def write(name, heading, table):
    with open(f"results/{name}.csv", "w", newline="") as file:
        file.write(COMMAND)
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


times = {(row["study"], row["choice"], row["scene"]): float(row["time_ratio"]) for row in rows("times")}
SHOWN = [
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
table = []
for study, choice, title, over in SHOWN:
    cells = [times.get((study, choice, scene)) for scene in ("atrium", "jungle", "frames")]
    table.append([title, over, *("-" if cell is None else f"{cell:.2f}" for cell in cells)])
write("accuracy-times", ["choice", "time over that of", "atrium", "jungle", "16 frames of atrium"], table)

figures = {(row["study"], row["choice"], row["scene"], row["figure"]): float(row["value"]) for row in rows("choices")}
table = []
for rule in ("none", DEFAULT, "depth=0.02+object+opaque+silhouette+triangle"):
    for scene in ("chess", "music-box"):
        of = lambda figure: figures["rules", rule, scene, figure]
        table.append([rule, scene, f"{times['rules', rule, scene]:.3f}", f"{of('flip_mean'):.4f}", f"{of('reused_pct'):.1f}"])
write("accuracy-rays", ["rule", "scene", "time over both eyes in full", "FLIP, mean", "right pixels reused %"], table)
PYTHON
