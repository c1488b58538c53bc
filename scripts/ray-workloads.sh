#!/bin/sh
# Ray workloads beyond Whitted's, and what reprojection saves of each: `scripts/ray-workloads.sh SCENES` writes results/ray-workloads.csv.
#   SIZE=WxH   pixels per eye (512x512)
set -eu
size=${SIZE:-512x512}
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf stk-black-forest/stk-black-forest.gltf
here=$OLDPWD/scripts
cat >workloads <<'WORKLOADS'
Whitted|
soft shadows|--light-radius 0.1 --sun-radius 0.5
4 occlusion rays|--ambient-occlusion 4
16 occlusion rays|--ambient-occlusion 16
1 bounce|--bounces 1
4 bounces|--bounces 4
coloured shadows|--coloured-shadows
normal maps|--normal-maps
WORKLOADS
for scene in chess music-box "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf"; do
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    while IFS='|' read -r workload options; do
        # shellcheck disable=SC2086
        "$bin/tracegen" rays "$scene" --size "$size" --visits $options --quiet -o trace.raytrace
        "$bin/replay" info trace.raytrace --json >"$name,$workload,info.json"
        for reuse in primary shadow color; do
            "$bin/replay" reproject trace.raytrace --rule none --reuse $reuse --json --quiet >"$name,$workload,$reuse.json"
        done
        "$bin/replay" reproject trace.raytrace --preset on-chip --json --quiet >"$name,$workload,on-chip.json"
        rm trace.raytrace
    done <workloads
done
python3 "$here/ray_workloads.py" "$results" "$size"
