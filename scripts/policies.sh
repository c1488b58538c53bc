#!/bin/sh
# What replacement policies do to texture traffic: `scripts/policies.sh SCENES` writes results/policies.csv, Crytek Sponza, atrium and jungle as the DK2 shows them.
set -eu
. "$(dirname "$0")/captures.sh"
capture_dk2
for name in crytek-sponza atrium jungle; do
    for order in morton z2-sta; do
        for policy in lru fifo tree-plru random srrip brrip drrip ship; do
            "$bin/replay" run "$name.textrace" --mode functional --order $order --replacement $policy --json 2>/dev/null >"$name,$order,$policy.json"
        done
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

rows = []
for scene in ("crytek-sponza", "atrium", "jungle"):
    for policy in ("lru", "fifo", "tree-plru", "random", "srrip", "brrip", "drrip", "ship"):
        row = [scene, policy]
        for order in ("morton", "z2-sta"):
            result = json.load(open(f"{scene},{order},{policy}.json"))["result"]
            row += [f"{100 * result['l1']['footprint_miss_rate']:.2f}", f"{result['external_bytes'] / 1e6:.3f}"]
        rows.append(row)
with open(sys.argv[1] + "/policies.csv", "w", newline="") as file:
    file.write("# command: scripts/policies.sh SCENES  (tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --mode functional --order ORDER --replacement POLICY)\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(["scene", "policy", "Morton: L1 misses %", "Morton: MB per frame", "Z2 STA: L1 misses %", "Z2 STA: MB per frame"])
    table.writerows(rows)
PYTHON
