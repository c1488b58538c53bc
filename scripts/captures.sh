# Sourced by the scripts that measure on real scenes, with the folder of scenes as `$1`: sets `scenes`, `bin` and `results` (RESULTS, or results/) and works in a
# temporary folder that is removed at the end.
scenes=$(cd "${1:?the folder with the real scenes}" && pwd)
cd "$(dirname "$0")/.."
bin=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
results=${RESULTS:-$PWD/results}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Whether a file of the folder of scenes is there; a line says so if it isn't.
present() {
    [ -f "$scenes/$1" ] || {
        echo "skipped: $scenes/$1 is absent" >&2
        return 1
    }
}

# Ends the script with exit code 3 if one of the files is absent.
needs() {
    for file; do
        present "$file" || exit 3
    done
}

# Crytek Sponza, atrium and jungle as the DK2 shows them: NAME.textrace of each.
capture_dk2() {
    needs crytek-sponza/sponza.gltf
    for scene in "$scenes/crytek-sponza/sponza.gltf" atrium jungle; do
        name=$(basename "${scene%/sponza.gltf}")
        "$bin/tracegen" raster "$scene" --hmd dk2 --no-plain --quiet -o "$name.textrace"
    done
}
