#!/bin/sh
# Measures run time against error on built-in scenes, from capture to technique, and writes tables,
# charts and one page. The table of errors that reports show is errors.csv of such a run.
#   SIZE=WxH       pixels an eye (480x540)
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
