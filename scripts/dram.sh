#!/bin/sh
# What tile orders do to rows of DRAM: `scripts/dram.sh SCENES` writes results/dram-orders.csv, Crytek Sponza, atrium and jungle as the DK2 shows them.
set -eu
. "$(dirname "$0")/captures.sh"
capture_dk2
for name in crytek-sponza atrium jungle; do
    for device in lpddr4 gddr6; do
        for order in scanline morton hilbert z2-lrta z2-sta; do
            "$bin/replay" run "$name.textrace" --order $order --dram $device --json 2>/dev/null >"$name,$device,$order.json"
        done
    done
done
python3 - "$results" <<'PYTHON'
import csv, glob, json, sys

SCENES, DEVICES = ["crytek-sponza", "atrium", "jungle"], ["lpddr4", "gddr6"]
ORDERS = ["scanline", "morton", "hilbert", "z2-lrta", "z2-sta"]
rows = []
for scene in SCENES:
    for device in DEVICES:
        for order in ORDERS:
            dram = json.load(open(f"{scene},{device},{order}.json"))["result"]["dram"]
            rows.append([scene, dram["device"], order, f"{dram['reads']:,}", f"{100 * dram['row_hit_rate']:.1f}", f"{dram['activates']:,}",
                         f"{dram['latency_mean_ns']:.0f}", f"{dram['latency_p99_ns']:.0f}", f"{dram['energy_mj']:.3f}"])
with open(sys.argv[1] + "/dram-orders.csv", "w", newline="") as file:
    file.write("# command: scripts/dram.sh SCENES  (tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --order ORDER --dram DEVICE)\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(["scene", "DRAM", "order", "reads", "row hits %", "rows opened", "mean latency ns", "99 % ns", "energy mJ"])
    table.writerows(rows)
PYTHON
