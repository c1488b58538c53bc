#!/bin/sh
# Holds the DRAM model against Ramulator 1 on the same streams of reads and writes results/dram-peer.csv. Needs cmake and a C++ compiler.
set -eu
cd "$(dirname "$0")/.."
command -v cmake >/dev/null || { echo "scripts/dram-peer.sh: cmake is missing" >&2; exit 2; }
target=${CARGO_TARGET_DIR:-target}/peers
csv=results/dram-peer.csv
{
    echo "# command: scripts/dram-peer.sh"
    "${CARGO:-cargo}" run --quiet --release --locked --manifest-path tests/peers/ramulator/Cargo.toml --target-dir "$target"
} >"$csv.part"
mv "$csv.part" "$csv"
