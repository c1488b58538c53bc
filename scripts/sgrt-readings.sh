#!/bin/sh
# The SGRT paper's figure 3 under every reading: `scripts/sgrt-readings.sh SCENES` writes results/sgrt-all-readings.csv,
# results/sgrt-figure-3.csv and results/sgrt-sizes.csv.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$(dirname "$0")/captures.sh"
built_in="teapot chess car lab music-box meadow"

for size in 512x512 1024x1024 2048x1024; do
    mkdir "$size"
    for scene in $built_in; do
        "$bin/tracegen" rays "$scene" --size "$size" --quiet -o "$size/$scene.raytrace"
    done
    "$bin/replay" readings "$size"/*.raytrace --calibrate teapot,chess,music-box --csv --quiet >"readings,$size.csv"
done
python3 "$root/scripts/sgrt_readings.py" "$results"
