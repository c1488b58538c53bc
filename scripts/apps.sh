#!/bin/sh
# Captures unmodified web libraries in headless Chromium: installs what is missing from Debian and npm, captures three.js's
# StereoEffect and Babylon.js's VR camera, holds the records to occlusion queries, and replays both traces.
#   OUT=DIR     where the traces and pictures go (out)
#   RESULTS=1   instead measure every program of scripts/apps.py and write results/applications.csv (about ten minutes)
set -eu
cd "$(dirname "$0")/.."
scripts/install-deps.sh apps
out=${OUT:-out}/apps
bin=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
mkdir -p "$out/site"
cp -r apps/pages/* apps/package.json apps/package-lock.json "$out/site/"
if ! cmp -s apps/package-lock.json "$out/site/node_modules/.installed"; then
    (cd "$out/site" && npm ci --no-audit --no-fund --ignore-scripts --loglevel error)
    cp apps/package-lock.json "$out/site/node_modules/.installed"
fi
if [ "${RESULTS:-0}" = 1 ]; then
    exec python3 scripts/apps.py "$bin" "$out" results/applications.csv
fi
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }
# capture NAME PAGE QUERY
capture() {
    say "capture $1"
    "$bin/tracegen" page "$out/site/$2" --query "$3" --check --image "$out/$1.png" -o "$out/$1.textrace"
    "$bin/replay" validate "$out/$1.textrace"
    for order in morton z2-sta; do
        "$bin/replay" run "$out/$1.textrace" --order $order
    done
}
capture three-stereo three.html "?mode=stereo"
capture babylon-vr babylon.html "?mode=vr"
say "the traces and pictures are in $out"
