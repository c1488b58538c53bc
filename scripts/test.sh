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
PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -q 'libOSMesa\.so\.8' ||
    echo "skipped: captures through OSMesa, since libOSMesa.so.8 is absent"
command -v python3 >/dev/null 2>&1 ||
    echo "skipped: the independent trace readers, since python3 is absent"
PATH="$PATH:/usr/sbin" command -v slurmctld >/dev/null 2>&1 ||
    echo "skipped: sweeps on a Slurm cluster, since slurmctld is absent"
for package in duckdb polars pandas pyarrow; do
    python3 -c "import $package" >/dev/null 2>&1 ||
        echo "skipped: the example of docs/analysis.md that needs $package, since Python has none"
done
exit "$(cat "$status")"
