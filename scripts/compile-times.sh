#!/bin/sh
# Compile times of fragment shaders with and without the recording code: renders pages that use many kinds of shaders of
# three.js, Babylon.js, PixiJS and PlayCanvas, and two Debian games on zink, keeps the shaders that they hand to Vulkan,
# and writes results/compile-times.csv (about ten minutes).
#   OUT=DIR     where the pages and shaders go (out)
# Needs Chromium and npm; for the games xvfb, openarena and supertux, which are skipped where they are absent.
set -eu
cd "$(dirname "$0")/.."
scripts/install-deps.sh apps
out=${OUT:-out}/compile-times
bin=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
cargo build --release --locked -p parallax-tests --bin compile_times
mkdir -p "$out/site" "$out/modules"
cp -r apps/pages/* "$out/site/"
(cd "$out/site" && npm install --no-save --no-audit --no-fund --ignore-scripts --loglevel error \
    three@0.187.0 @babylonjs/core@9.34.0 pixi.js@8.22.0 playcanvas@2.23.3)
# The shaders are kept while the program makes its pipelines, so a page that loads too slowly still gives some.
for name in three babylon pixi playcanvas; do
    mkdir -p "$out/modules/$name"
    "$bin/tracegen" page "$out/site/shaders/$name.html" --root "$out/site" --frames 8 --list --modules "$out/modules/$name" ||
        echo "$name: the page did not end; its shaders so far are measured" >&2
done
# game NAME PROGRAM ARGUMENTS
game() {
    name=$1
    shift
    if ! command -v "$1" >/dev/null 2>&1 || ! command -v xvfb-run >/dev/null 2>&1; then
        echo "SKIPPED: $name: $1 or xvfb-run is absent" >&2
        return
    fi
    mkdir -p "$out/modules/$name" "$out/home"
    HOME="$out/home" xvfb-run -a "$bin/tracegen" app --gl --eyes mono --list --frames 30 --timeout 300 --modules "$out/modules/$name" -- "$@" ||
        echo "$name: the program did not end; its shaders so far are measured" >&2
}
game openarena /usr/games/openarena +set r_fullscreen 0 +set r_mode -1 +set r_customwidth 320 +set r_customheight 240 \
    +set s_initsound 0 +set com_maxfps 30 +set timedemo 1 +map oa_dm1 +wait 150 +quit
game supertux /usr/games/supertux2 --window --geometry 320x240 --disable-sound --renderer opengl33
python3 scripts/compile_times.py "$bin/compile_times" "$out/modules" results/compile-times.csv
