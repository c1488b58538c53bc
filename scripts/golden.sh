#!/bin/sh
# Rewrites the golden traces from their recipes and then the golden results.
set -eu
cd "$(dirname "$0")/.."
bin=${CARGO_TARGET_DIR:-target}/release
# The recipe of `app` names the test program.
PATH=$(cd "$bin" && pwd):$PATH
for recipe in traces/*.recipe; do
    name=${recipe%.recipe}
    # Word splitting is wanted: a recipe is a list of arguments.
    # shellcheck disable=SC2046
    set -- $(cat "$recipe")
    case "$1" in
        raster | app) out=$name.textrace ;;
        rays) out=$name.raytrace ;;
        *) echo "$recipe: expected raster, app or rays, found $1" >&2; exit 2 ;;
    esac
    echo "$recipe -> $out"
    command=$1
    shift
    "$bin/tracegen" "$command" -o "$out" "$@"
done
UPDATE_GOLDEN=1 "${CARGO:-cargo}" test --release --workspace --locked --test e2e golden::
