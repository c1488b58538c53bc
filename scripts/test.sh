#!/bin/sh
# Runs every test of the workspace and closes with the totals. Uses cargo-nextest where it is installed: it runs the tests of
# all programs side by side, in half the time on two cores.
set -eu
cd "$(dirname "$0")/.."
cargo=${CARGO:-cargo}
common="--release --workspace --locked --no-fail-fast"
code=0
if "$cargo" nextest --version >/dev/null 2>&1; then
    log=${CARGO_TARGET_DIR:-target}/nextest/default/junit.xml
    rm -f "$log"
    "$cargo" nextest run $common || code=$?
    [ -f "$log" ] || exit "$code"
else
    log=$(mktemp)
    status=$(mktemp)
    trap 'rm -f "$log" "$status"' EXIT
    # A plain sh has no pipefail: the status travels through a file.
    {
        "$cargo" test $common 2>&1 || code=$?
        echo "$code" >"$status"
    } | tee "$log"
    code=$(cat "$status")
    awk '/^test result:/ { passed += $4; failed += $6; ignored += $8 }
         END { printf "%d passed, %d failed, %d skipped\n", passed, failed, ignored }' "$log"
fi
# Tests that found something missing print a line each; the same line from several tests counts once.
grep -o 'SKIPPED: .*' "$log" | sed 's/<.*//' | sort | uniq -c | while read -r times _ reason; do
    echo "skipped: $reason (tests that said so: $times)"
done
exit "$code"
