#!/bin/sh
# Measures the stereo rendering techniques on three built-in scenes along the model of a head, and
# writes one page of tables, plots and difference pictures. Rerun after an interruption, it goes on
# where it was.
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/techniques
bin=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$out"
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

set --
for scene in plant atrium jungle; do
    say "measure $scene"
    "$bin/tracegen" techniques "$scene" --path head --frames 2 --repeats 2 -o "$out/$scene"
    set -- "$@" "$out/$scene"
done
say "replay the traces, compare the pictures"
"$bin/replay" techniques "$@" --html "$out/index.html" > "$out/techniques.txt"
say "done: $out/index.html"
