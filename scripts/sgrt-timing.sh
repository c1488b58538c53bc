#!/bin/sh
# The cycle-level model of the T&I units against the closed form: `scripts/sgrt-timing.sh SCENES` writes results/sgrt-timing.csv (12 scene-view pairs),
# results/sgrt-timing-performance.csv, results/sgrt-timing-causes.csv and results/sgrt-timing-speed.csv (times on one thread, on this machine).
# It uses built-in scenes only; SCENES is as for the other scripts.
set -eu
. "$(dirname "$0")/captures.sh"
here=$OLDPWD/scripts
built_in="teapot chess car lab music-box meadow"

for scene in $built_in; do
    "$bin/tracegen" rays "$scene" --size 512x512 --visits --quiet -o "$scene.raytrace"
    start=$(date +%s%N)
    "$bin/replay" reproject "$scene.raytrace" --timing cycle --threads 1 --json --quiet >"default,$scene.json"
    end=$(date +%s%N)
    echo "$scene $(((end - start) / 1000000))" >>times
done
# Name and parameters of each variant.
variant() {
    name=$1
    shift
    echo "$name" >>variants
    printf '%s\n' "$@" >variant.toml
    for scene in $built_in; do
        "$bin/replay" reproject "$scene.raytrace" --rule none --timing cycle --config variant.toml --json --quiet >"variant,$name,$scene.json"
    done
}
variant "2 tile buffers" "cycles.tile_buffers = 2"
variant "16 tile buffers" "cycles.tile_buffers = 16"
variant "16 tile buffers, 4 intersection pipelines" "cycles.tile_buffers = 16" "tni.ist_pipelines = 4"
variant "64 rays in flight" "tni.rays_in_flight = 64"
variant "512 rays in flight" "tni.rays_in_flight = 512"
variant "rays return in order" "cycles.in_order_return = true"
variant "warps of 16 rays" "cycles.warp_rays = 16"
python3 "$here/sgrt_timing.py" "$results" $built_in
