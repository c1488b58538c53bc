#!/bin/sh
# What prefetchers of the L2 save in time and cost in traffic: `scripts/prefetch.sh SCENES` writes results/prefetch.csv, Crytek Sponza, atrium and
# jungle as the DK2 shows them.
set -eu
. "$(dirname "$0")/captures.sh"
capture_dk2
for name in crytek-sponza atrium jungle; do
    for order in morton z2-sta; do
        "$bin/replay" run "$name.textrace" --order $order --json 2>/dev/null >"$name,$order,none,0.json"
        "$bin/replay" run "$name.textrace" --order $order --prefetch tile-ahead --json 2>/dev/null >"$name,$order,tile-ahead,4096.json"
        for prefetcher in next-line aligned-block next-mip; do
            for lines in 1 2 4 8; do
                [ "$prefetcher" = next-mip ] && [ $lines -gt 2 ] && continue
                # A block of one line prefetches nothing.
                [ "$prefetcher,$lines" = aligned-block,1 ] && continue
                printf 'order = "%s"\n[prefetch]\nprefetcher = "%s"\nlines = %s\n' $order $prefetcher $lines >machine.toml
                "$bin/replay" run "$name.textrace" --config machine.toml --json 2>/dev/null >"$name,$order,$prefetcher,$lines.json"
            done
        done
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

KINDS = [("none", 0), *(("next-line", lines) for lines in (1, 2, 4, 8)), *(("aligned-block", lines) for lines in (2, 4, 8)), *(("next-mip", levels) for levels in (1, 2)), ("tile-ahead", 4096)]
rows = []
for scene in ("crytek-sponza", "atrium", "jungle"):
    for kind, lines in KINDS:
        row = [scene, kind, lines or "-"]
        for order in ("morton", "z2-sta"):
            base, result = (json.load(open(f"{scene},{order},{name}.json"))["result"] for name in ("none,0", f"{kind},{lines}"))
            prefetch = result.get("prefetch")
            useful = f"{100 * prefetch['useful_lines'] / prefetch['lines']:.1f}" if prefetch else "-"
            row += [f"{result['external_bytes'] / 1e6:.3f}", useful, f"{result['l2']['misses']:,}",
                    f"{100 * (result['cycles'] / base['cycles'] - 1):+.1f}"]
        rows.append(row)
with open(sys.argv[1] + "/prefetch.csv", "w", newline="") as file:
    file.write("# command: scripts/prefetch.sh SCENES  (tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --config FILE with a [prefetch] table)\n")
    table = csv.writer(file, lineterminator="\n")
    columns = ("MB per frame", "useful % of prefetched", "L2 misses", "cycles, %")
    table.writerow(["scene", "prefetcher", "lines", *(f"{order}: {column}" for order in ("Morton", "Z2 STA") for column in columns)])
    table.writerows(rows)
PYTHON
