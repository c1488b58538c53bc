#!/bin/sh
# The cycle-level model of the T&I units against the closed form: `scripts/sgrt-timing.sh SCENES` writes results/sgrt-timing.csv (12 scene-view pairs),
# results/sgrt-timing-performance.csv, results/sgrt-timing-causes.csv and results/sgrt-timing-speed.csv (processor time on one thread).
# It uses built-in scenes only; SCENES is as for the other scripts.
set -eu
. "$(dirname "$0")/captures.sh"
here=$OLDPWD/scripts
built_in="teapot chess car lab music-box meadow"

for scene in $built_in; do
    "$bin/tracegen" rays "$scene" --size 512x512 --visits --quiet -o "$scene.raytrace"
    python3 - "$scene" "$bin/replay" reproject "$scene.raytrace" --timing cycle --threads 1 --json --quiet <<'PYTHON'
import resource, subprocess, sys

scene = sys.argv[1]
with open(f"default,{scene}.json", "w") as out:
    subprocess.run(sys.argv[2:], stdout=out, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
with open("times", "a") as times:
    print(scene, used.ru_utime + used.ru_stime, file=times)
PYTHON
done
# The pairs beyond 10 % on other machines: a name, and the parameters.
beyond="music-box meadow"
variant() {
    name=$1
    shift
    echo "$name" >>variants
    printf '%s\n' "$@" >variant.toml
    for scene in $beyond; do
        "$bin/replay" reproject "$scene.raytrace" --timing cycle --config variant.toml --json --quiet >"variant,$name,$scene.json"
    done
}
variant "16 tile buffers" "cycles.tile_buffers = 16"
variant "DRAM without delay" "memory.latency_ns = 2" "memory.bandwidth_gb_s = 2048"
variant "both" "cycles.tile_buffers = 16" "memory.latency_ns = 2" "memory.bandwidth_gb_s = 2048"
variant "512 rays in flight" "tni.rays_in_flight = 512"
python3 "$here/sgrt_timing.py" "$results" "$beyond" $built_in
