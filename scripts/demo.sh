#!/bin/sh
# Captures the four built-in raster scenes in stereo and replays them in every order of the Z2 paper;
# traces the six ray-traced ones and reprojects them as in the SGRT paper. Writes two HTML reports.
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}
bin=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$out"
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

capture_and_replay() {
    set --
    for scene in atrium atrium-plain atrium-shadows jungle; do
        say "capture $scene"
        "$bin/tracegen" raster "$scene" -o "$out/$scene.textrace" --image "$out/$scene.png"
        set -- "$@" "$out/$scene.textrace" --image "$scene=$out/$scene.png"
    done
    say "replay: 4 scenes x 4 cache configurations x 3 orders, timed"
    "$bin/replay" report "$@" -o "$out/report.html"
}

trace_and_reproject() {
    set --
    for scene in teapot chess car lab music-box meadow; do
        say "trace rays of $scene"
        "$bin/tracegen" rays "$scene" --size 512x512 -o "$out/$scene.raytrace"
        set -- "$@" "$out/$scene.raytrace"
    done
    say "reproject: 6 scenes, the default rule and plain reuse"
    "$bin/replay" reproject "$@" --html "$out/reprojection.html" > "$out/reprojection.txt"
}

# Side by side: each has stretches that keep one core busy.
trace_and_reproject &
rays=$!
trap 'kill "$rays" 2>/dev/null || true' EXIT
capture_and_replay
wait "$rays"
trap - EXIT
say "done: open $out/report.html and $out/reprojection.html"
