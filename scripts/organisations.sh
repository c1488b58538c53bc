#!/bin/sh
# What sectors, victim caches, inclusion and MSHRs change: `scripts/organisations.sh SCENES` writes results/organisations.csv, results/tiles.csv
# (tiles of 8 to 64 pixels) and results/fifo.csv (texture units with a prefetching FIFO), Crytek Sponza, atrium and jungle as the DK2 shows them.
set -eu
. "$(dirname "$0")/captures.sh"
capture_dk2
for name in crytek-sponza atrium jungle; do
    for order in morton z2-sta; do
        run() {
            machine=$1
            shift
            { printf 'order = "%s"\n' $order; printf '%s\n' "$@"; } >machine.toml
            "$bin/replay" run "$name.textrace" --config machine.toml --json 2>/dev/null >"$name,$order,$machine.json"
        }
        run plain
        run victim 'l1.size_bytes = "8KiB"' 'l1.victim_lines = 16'
        run sectored 'l2.size_bytes = "128KiB"' 'l2.sectors = 4'
        run private-l2 'l2.size_bytes = "64KiB"' 'l2.shared = false'
        run private-l2-l3 'l2.size_bytes = "64KiB"' 'l2.shared = false' 'l3.size_bytes = "256KiB"'
        run long-lines 'line_bytes = 64'
        run sectored-64 'line_bytes = 64' 'l2.size_bytes = "128KiB"' 'l2.sectors = 2'
        for inclusion in none inclusive exclusive; do
            run l3-$inclusion 'l3.size_bytes = "256KiB"' "l3.inclusion = \"$inclusion\""
        done
        for mshrs in 32 16 8 4; do
            run mshrs-$mshrs "tmu.l2_mshrs = $mshrs"
        done
        for footprints in 16 64 256 1024; do
            run fifo-$footprints 'tmu.model = "prefetch-fifo"' "tmu.fifo_footprints = $footprints"
        done
        for px in 8 16 32 64; do
            run tile-$px "tile_px = $px"
        done
    done
done
python3 - "$results" <<'PYTHON'
import csv, json, sys

COMMAND = "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --config FILE"
SCENES = ("crytek-sponza", "atrium", "jungle")
MACHINES = {
    "plain": "as in the default preset",
    "victim": "victim cache of 16 lines for each L1",
    "sectored": "L2: 4 sectors of 16 bytes per tag",
    "private-l2": "L2 of 64 KiB for each core",
    "private-l2-l3": "L2 of 64 KiB for each core, shared L3 of 256 KiB",
    "long-lines": "lines of 64 bytes",
    "sectored-64": "lines of 64 bytes, L2: 2 sectors per tag",
    "l3-none": "L3 of 256 KiB",
    "l3-inclusive": "L3 of 256 KiB, inclusive",
    "l3-exclusive": "L3 of 256 KiB, exclusive",
    "mshrs-32": "32 MSHRs of the L2",
    "mshrs-16": "16 MSHRs of the L2",
    "mshrs-8": "8 MSHRs of the L2",
    "mshrs-4": "4 MSHRs of the L2",
}

def result(scene, order, machine):
    with open(f"{scene},{order},{machine}.json") as file:
        return json.load(file)["result"]

def write(name, header, rows):
    with open(f"{sys.argv[1]}/{name}.csv", "w", newline="") as file:
        file.write(f"# command: scripts/organisations.sh SCENES  ({COMMAND})\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)

def figures(scene, machine):
    morton, sta = (result(scene, order, machine) for order in ("morton", "z2-sta"))
    cells = []
    for one in (morton, sta):
        cells += [f"{100 * one['l1']['footprint_miss_rate']:.2f}", f"{one['external_bytes'] / 1e6:.3f}", f"{one['cycles'] / 1e6:.2f}"]
    return [*cells, f"{100 * (1 - sta['external_bytes'] / morton['external_bytes']):.1f}"]

COLUMNS = ("L1 misses %", "MB per frame", "million cycles")
header = [f"{order}: {column}" for order in ("Morton", "Z2 STA") for column in COLUMNS] + ["saved %"]
rows = [[scene, text, *figures(scene, machine)] for scene in SCENES for machine, text in MACHINES.items()]
write("organisations", ["scene", "caches", *header], rows)
rows = [[scene, f"{px}x{px}", 4 * px * px, *figures(scene, f"tile-{px}")] for scene in SCENES for px in (8, 16, 32, 64)]
write("tiles", ["scene", "tile, px", "bytes of a tile's colours", *header], rows)
UNITS = {"plain": "looping (timed)", **{f"fifo-{n}": f"FIFO of {n} footprints" for n in (16, 64, 256, 1024)}}
rows = []
for scene in SCENES:
    for machine, text in UNITS.items():
        morton, sta = (result(scene, order, machine) for order in ("morton", "z2-sta"))
        use = [f"{100 * one['tmu']['utilization']:.2f}" for one in (morton, sta)]
        cells = [cell for one, share in zip((morton, sta), use) for cell in (f"{one['external_bytes'] / 1e6:.3f}", f"{one['cycles'] / 1e6:.2f}", share)]
        rows.append([scene, text, *cells, f"{100 * (1 - sta['cycles'] / morton['cycles']):.1f}".replace("-0.0", "0.0")])
columns = ("MB per frame", "million cycles", "utilisation %")
write("fifo", ["scene", "texture unit", *(f"{order}: {column}" for order in ("Morton", "Z2 STA") for column in columns), "cycles saved %"], rows)
PYTHON
