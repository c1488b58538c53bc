#!/bin/sh
# Captures the four built-in scenes in stereo, replays them in every order of the paper and writes
# one HTML report.
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}
bin=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$out"
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

set --
for scene in atrium atrium-plain atrium-shadows jungle; do
    say "capture $scene"
    "$bin/tracegen" raster "$scene" -o "$out/$scene.textrace" --image "$out/$scene.png"
    set -- "$@" "$out/$scene.textrace" --image "$scene=$out/$scene.png"
done
say "replay: 4 scenes x 4 cache configurations x 3 orders, timed"
"$bin/replay" report "$@" -o "$out/report.html"
say "done: open $out/report.html"
