#!/bin/sh
# Writes every kind of page from small inputs, takes screenshots of each at 1280 and 800 px and as
# printed, and checks what a machine can check: no page is wider than its window, and no two texts of a
# chart overlap.
#   OUT=DIR   writes DIR/screenshots (out)
#   BIN=DIR   folder of tracegen and replay (target/release)
#   PAGES=DIR checks the pages of this folder, and writes none
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/screenshots
bin=${BIN:-${CARGO_TARGET_DIR:-target}/release}
start=$(date +%s)
say() { printf '[%3ds] %s\n' "$(($(date +%s) - start))" "$*"; }

pages=${PAGES:-}
if [ -z "$pages" ]; then
    pages=$out/pages inputs=$out/inputs
    mkdir -p "$pages" "$inputs"
    atrium=$inputs/atrium.textrace
    say "capture inputs"
    [ -f "$atrium" ] || "$bin/tracegen" raster -q atrium --size 240x270 --image "$inputs/atrium.png" -o "$atrium"
    [ -f "$inputs/head.textrace" ] ||
        "$bin/tracegen" raster -q atrium --size 120x135 --path head --frames 4 --no-plain -o "$inputs/head.textrace"
    [ -f "$inputs/truth.textrace" ] ||
        "$bin/tracegen" verify -q atrium --trace "$atrium" --write-reference "$inputs/truth.textrace" > "$inputs/verify.txt"
    "$bin/tracegen" techniques -q plant --size 120x135 --path head --frames 3 --repeats 2 --trace-frames 1 -o "$inputs/techniques"

    say "write pages"
    "$bin/replay" report -q "$atrium" --image "atrium=$inputs/atrium.png" -o "$pages/report.html" > /dev/null
    "$bin/replay" report -q "$atrium" --as atrium=crytek-sponza --orders all -o "$pages/report-orders.html" > /dev/null
    "$bin/replay" paper -q traces/atrium.textrace traces/jungle.textrace --functional --html "$pages/paper.html" > /dev/null
    cat > "$inputs/sweep.toml" <<'TOML'
traces = []
[axes]
order = ["morton", "z2-lrta", "z2-sta"]
l1.size_bytes = ["4KiB", "8KiB", "16KiB", "32KiB"]
l2.size_bytes = ["32KiB", "128KiB", "512KiB"]
l1.replacement = ["lru", "random"]
[one-at-a-time]
cores = [1, 4]
TOML
    "$bin/replay" sweep -q "$inputs/sweep.toml" traces/atrium.textrace -o "$out/sweep" > /dev/null
    cp "$out/sweep/report.html" "$pages/sweep.html"
    "$bin/replay" locality -q "$atrium" --orders all --html "$pages/locality.html" > /dev/null
    "$bin/replay" orders -q "$atrium" --html "$pages/orders.html" > /dev/null
    "$bin/replay" reproject -q traces/chess-rays.raytrace traces/teapot-rays.raytrace --as chess-rays=chess \
        --curve --sensitivity --html "$pages/reproject.html" > /dev/null
    "$bin/replay" readings -q traces/chess-rays.raytrace traces/teapot-rays.raytrace --as chess --as teapot \
        --html "$pages/readings.html" > /dev/null
    "$bin/replay" techniques -q "$inputs/techniques" --html "$pages/techniques.html" > /dev/null
    "$bin/replay" accuracy -q "$atrium" --truth "$inputs/truth.textrace" "$inputs/head.textrace" \
        --rays traces/chess-rays.raytrace --techniques "$inputs/techniques" -o "$out/accuracy" > /dev/null
    cp "$out/accuracy/accuracy.html" "$pages/accuracy.html"
fi
chromium=$(command -v chromium || command -v chromium-browser || true)
if [ -z "$chromium" ]; then
    say "no Chromium here: no screenshots and no checks"
    exit 0
fi
say "take screenshots and check"
python3 scripts/screenshots.py "$chromium" "$pages" "$out"
say "done: $out"
