#!/bin/sh
# Reuse of the previous frame beside reuse between the eyes: `scripts/temporal.sh SCENES` writes results/temporal.csv.
#   SIZE=WxH   pixels per eye (512x512)
set -eu
size=${SIZE:-512x512}
. "$(dirname "$0")/captures.sh"
needs crytek-sponza/sponza.gltf stk-black-forest/stk-black-forest.gltf
here=$OLDPWD/scripts
# Pairs of frames of a head that looks around, 90 frames per second: slow, and at the fastest turn of the first seconds.
places="10 60 110"
for scene in teapot chess music-box meadow "$scenes/crytek-sponza/sponza.gltf" "$scenes/stk-black-forest/stk-black-forest.gltf"; do
    name=$(basename "${scene%/sponza.gltf}" .gltf)
    for place in $places; do
        for frame in "$place" "$((place + 1))"; do
            "$bin/tracegen" rays "$scene" --size "$size" --visits --path head --fps 90 --frame "$frame" --quiet -o "f$frame.raytrace"
        done
        for preset in none on-chip; do
            settings="--rule none --reuse shadow"
            [ $preset = none ] || settings="--preset $preset"
            # shellcheck disable=SC2086
            "$bin/replay" temporal "f$place.raytrace" "f$((place + 1)).raytrace" $settings --csv --quiet >"$preset,$name,$place.csv"
        done
        rm ./*.raytrace
    done
done
python3 "$here/temporal.py" "$results" "$size"
