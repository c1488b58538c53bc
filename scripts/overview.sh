#!/bin/sh
# Makes the picture and the table of README.md from one built-in scene: docs/images/overview.svg and results/overview.csv.
# Needs Pillow (Debian: python3-pil). The same Mesa gives the same figures.
set -eu
cd "$(dirname "$0")/.."
bin=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
python3 -c 'import PIL' 2>/dev/null || { echo "scripts/overview.sh: needs Python with Pillow (Debian: python3-pil)" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$bin/tracegen" raster atrium --no-plain --quiet -o "$work/atrium.textrace" --image "$work/atrium.png"
echo 'tile_maps = true' >"$work/maps.toml"
for order in scanline zig-zag morton hilbert z2-lrta z2-sta random; do
    "$bin/replay" run "$work/atrium.textrace" --order $order --config "$work/maps.toml" --json 2>/dev/null >"$work/$order.json"
done
python3 scripts/overview.py "$work" results/overview.csv docs/images/overview.svg
