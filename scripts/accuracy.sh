#!/bin/sh
# Measures run time against error on two built-in scenes and writes tables, charts and one page. The
# table of errors that reports show is errors.csv of such a run.
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/accuracy
bin=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$out"
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

set --
for scene in atrium atrium-plain; do
    say "capture $scene"
    "$bin/tracegen" raster -q "$scene" -o "$out/$scene.textrace"
    set -- "$@" "$out/$scene.textrace"
done
say "measure"
"$bin/replay" accuracy "$@" -o "$out" > "$out/accuracy.txt"
say "done: $out/accuracy.html"
