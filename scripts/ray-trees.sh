#!/bin/sh
# What rays read from trees of each kind and layout: `scripts/ray-trees.sh SCENES` writes results/rays-trees.csv.
#   SIZE=WxH   pixels per eye (512x512)
set -eu
size=${SIZE:-512x512}
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf
here=$OLDPWD/scripts
for scene in chess music-box meadow "$scenes/crytek-sponza/sponza.gltf"; do
    name=$(basename "${scene%/sponza.gltf}")
    for tree in "bvh2" "bvh2 --treelets 4096" "bvh4" "bvh4 --treelets 4096" "bvh8" "bvh8 --treelets 4096" "cwbvh8" "cwbvh8 --treelets 4096"; do
        # shellcheck disable=SC2086
        "$bin/tracegen" rays "$scene" --size "$size" --visits --bvh $tree --quiet -o trace.raytrace
        "$bin/replay" info trace.raytrace --json >"$name,$tree,info.json"
        "$bin/replay" reproject trace.raytrace --timing cycle --json --quiet >"$name,$tree.json"
        rm trace.raytrace
    done
done
python3 "$here/ray_trees.py" "$results" "$size"
