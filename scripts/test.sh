#!/bin/sh
# Runs every test of the workspace and closes with the totals.
set -eu
cd "$(dirname "$0")/.."
log=$(mktemp)
status=$(mktemp)
trap 'rm -f "$log" "$status"' EXIT
# A plain sh has no pipefail: the status travels through a file.
{
    code=0
    "${CARGO:-cargo}" test --release --workspace --locked --no-fail-fast 2>&1 || code=$?
    echo "$code" >"$status"
} | tee "$log"
awk '/^test result:/ { passed += $4; failed += $6; ignored += $8 }
     END { printf "%d passed, %d failed, %d skipped\n", passed, failed, ignored }' "$log"
# Tests that found something missing print a line each; the same line from several tests counts once.
grep -o 'SKIPPED: .*' "$log" | sort | uniq -c | while read -r times _ reason; do
    echo "skipped: $reason (tests that said so: $times)"
done
exit "$(cat "$status")"
