# Sourced by the scripts that measure on real scenes, with the folder of scenes as `$1`: sets `scenes`, `bin` and `results` (RESULTS, or results/) and works in a
# temporary folder that is removed at the end.
scenes=$(cd "${1:?the folder with the real scenes}" && pwd)
cd "$(dirname "$0")/.."
bin=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
results=${RESULTS:-$PWD/results}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Crytek Sponza, atrium and jungle as the DK2 shows them: NAME.textrace of each.
capture_dk2() {
    for scene in "$scenes/crytek-sponza/sponza.gltf" atrium jungle; do
        name=$(basename "${scene%/sponza.gltf}")
        "$bin/tracegen" raster "$scene" --hmd dk2 --no-plain --quiet -o "$name.textrace"
    done
}
