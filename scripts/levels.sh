#!/bin/sh
# What tile orders save below an L3: `scripts/levels.sh SCENES` writes results/levels.csv, Crytek Sponza, atrium and jungle as the DK2 shows them.
set -eu
. "$(dirname "$0")/captures.sh"
capture_dk2
for name in crytek-sponza atrium jungle; do
    for size in none 256KiB 512KiB 1MiB 2MiB 4MiB; do
        for order in morton z2-sta; do
            level=""
            [ "$size" = none ] || level="--l3 $size"
            "$bin/replay" run "$name.textrace" --order $order $level --json 2>/dev/null >"$name,$size,$order.json"
        done
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

rows = []
for scene in ("crytek-sponza", "atrium", "jungle"):
    for size in ("none", "256KiB", "512KiB", "1MiB", "2MiB", "4MiB"):
        morton, sta = (json.load(open(f"{scene},{size},{order}.json"))["result"] for order in ("morton", "z2-sta"))
        megabytes = [result["external_bytes"] / 1e6 for result in (morton, sta)]
        cycles = [result["cycles"] / 1e6 for result in (morton, sta)]
        rows.append([scene, size.replace("KiB", " KiB").replace("MiB", " MiB"), *(f"{value:.3f}" for value in megabytes),
                     f"{100 * (1 - megabytes[1] / megabytes[0]):.1f}", *(f"{value:.2f}" for value in cycles),
                     f"{100 * (1 - cycles[1] / cycles[0]):.1f}"])
with open(sys.argv[1] + "/levels.csv", "w", newline="") as file:
    file.write("# command: scripts/levels.sh SCENES  (tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --order ORDER --l3 SIZE)\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(["scene", "L3", "Morton: MB per frame", "Z2 STA: MB per frame", "saved %",
                    "Morton: million cycles", "Z2 STA: million cycles", "cycles saved %"])
    table.writerows(rows)
PYTHON
