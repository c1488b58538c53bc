#!/bin/sh
# Fuzzes every target (or those named) for SECONDS each, on stable Rust: coverage comes from LLVM's
# own pass, not from a nightly flag. The committed corpus is read, what is found new stays in $OUT.
#
#   scripts/fuzz.sh [-b] [-n RUNS] [-t SECONDS] [TARGET...]
#
# -b: without building, for several at a time.
#
# A crash is written beside the new corpus as crash-*, and the script ends with 1.
set -eu
cd "$(dirname "$0")/.."
out="${OUT:-out}/fuzz"
seconds=60
runs=-1
build=yes
while getopts bn:t: flag; do
    case $flag in
    b) build="" ;;
    n) runs=$OPTARG ;;
    t) seconds=$OPTARG ;;
    *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))

host=$(rustc -vV | sed -n 's/^host: //p')
# Only with --target do these leave build scripts and procedural macros alone.
flags="-Cpasses=sancov-module"
for flag in level=4 inline-8bit-counters pc-table trace-compares; do
    flags="$flags -Cllvm-args=-sanitizer-coverage-$flag"
done
[ -z "$build" ] || RUSTFLAGS="$flags" ${CARGO:-cargo} build --profile fuzz --locked -p parallax-fuzz --features libfuzzer \
    --target "$host" --target-dir target/fuzz
program=target/fuzz/$host/fuzz/parallax-fuzz

# Scenes are files: in memory where the system has such a folder.
scratch=$(mktemp -d "$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}")/parallax-fuzz.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
failed=0
[ $# -gt 0 ] || set -- $(ls fuzz/corpus)
for target; do
    mkdir -p "$out/$target"
    words=""
    [ ! -f "fuzz/dictionaries/$target.dict" ] || words="-dict=fuzz/dictionaries/$target.dict"
    # Short inputs run fast; traces and scenes need room for their tables.
    case $target in
    textrace | raytrace | gltf) length=8192 ;;
    kernels | paths) length=400 ;;
    *) length=1500 ;;
    esac
    # A second an input is the target's own check, in processor time; -timeout, by the clock, catches what never ends.
    # shellcheck disable=SC2086
    FUZZ_TARGET=$target TMPDIR=$scratch nice -n 19 "$program" $words -max_len=$length -timeout=1200 \
        -rss_limit_mb=2048 -reload=0 -print_final_stats=1 -max_total_time="$seconds" -runs="$runs" \
        -artifact_prefix="$out/$target-" "$out/$target" "fuzz/corpus/$target" \
        >"$out/$target.log" 2>&1 || {
        failed=1
        echo "$target: stopped by a fault, see $out/$target.log"
        grep -a -m 1 -A 1 "panicked at\|ERROR: libFuzzer" "$out/$target.log" || true
    }
    awk -v target="$target" '
        / cov: / { for (i = 1; i < NF; i++) { if ($i == "cov:") cov = $(i + 1); if ($i == "ft:") ft = $(i + 1) } }
        /number_of_executed_units/ { runs = $2 } /average_exec_per_sec/ { rate = $2 }
        /slowest_unit_time/ { slowest = $2 } /peak_rss_mb/ { rss = $2 }
        END { printf "%-15s %10d runs %7d/s %6d edges %7d features, slowest %d s, at most %d MB\n", target, runs, rate, cov, ft, slowest, rss }
    ' "$out/$target.log"
done
exit $failed
