"""What sectors, victim caches, inclusion, MSHRs, tile sizes and prefetching FIFOs change: Crytek Sponza, atrium and jungle as the DK2 shows them."""

from .common import l1_misses, megabytes, million_cycles, saved

COMMAND = "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --config FILE"
# What the table says, and the lines of the configuration.
CACHES = {
    "as in the default preset": [],
    "victim cache of 16 lines for each L1": ['l1.size_bytes = "8KiB"', "l1.victim_lines = 16"],
    "L2: 4 sectors of 16 bytes per tag": ['l2.size_bytes = "128KiB"', "l2.sectors = 4"],
    "L2 of 64 KiB for each core": ['l2.size_bytes = "64KiB"', "l2.shared = false"],
    "L2 of 64 KiB for each core, shared L3 of 256 KiB": ['l2.size_bytes = "64KiB"', "l2.shared = false", 'l3.size_bytes = "256KiB"'],
    "lines of 64 bytes": ["line_bytes = 64"],
    "lines of 64 bytes, L2: 2 sectors per tag": ["line_bytes = 64", 'l2.size_bytes = "128KiB"', "l2.sectors = 2"],
    "L3 of 256 KiB": ['l3.size_bytes = "256KiB"', 'l3.inclusion = "none"'],
    **{f"L3 of 256 KiB, {kind}": ['l3.size_bytes = "256KiB"', f'l3.inclusion = "{kind}"'] for kind in ("inclusive", "exclusive")},
    **{f"{count} MSHRs of the L2": [f"tmu.l2_mshrs = {count}"] for count in (32, 16, 8, 4)},
}
FIGURES = (
    "Morton: L1 misses % | Morton: MB per frame | Morton: million cycles | Z2 STA: L1 misses % | Z2 STA: MB per frame | Z2 STA: million cycles | saved %")
TILES_PX = [8, 16, 32, 64]
UNITS = {
    "looping (timed)": [],
    **{f"FIFO of {count} footprints": ['tmu.model = "prefetch-fifo"', f"tmu.fifo_footprints = {count}"] for count in (16, 64, 256, 1024)},
}


def figures(pair):
    cells = [cell(result) for result in pair for cell in (l1_misses, megabytes, million_cycles)]
    return [*cells, saved(pair[1]["external_bytes"], pair[0]["external_bytes"])]


def use(pair):
    cells = [cell(result) for result in pair for cell in (megabytes, million_cycles, lambda result: f"{100 * result['tmu']['utilization']:.2f}")]
    return [*cells, saved(pair[1]["cycles"], pair[0]["cycles"]).replace("-0.0", "0.0")]


def run(study):
    caches, tiles, units = [], [], []
    for scene, trace in study.dk2():
        pair = lambda lines: study.pair(trace, *study.config(*lines))
        caches += [[scene, text, *figures(pair(lines))] for text, lines in CACHES.items()]
        tiles += [[scene, f"{px}x{px}", 4 * px * px, *figures(pair([f"tile_px = {px}"]))] for px in TILES_PX]
        units += [[scene, text, *use(pair(lines))] for text, lines in UNITS.items()]
    study.write("organisations", COMMAND, f"scene | caches | {FIGURES}", caches)
    study.write("tiles", COMMAND, f"scene | tile, px | bytes of a tile's colours | {FIGURES}", tiles)
    study.write(
        "fifo", COMMAND,
        "scene | texture unit | Morton: MB per frame | Morton: million cycles | Morton: utilisation % | Z2 STA: MB per frame | Z2 STA: million cycles | "
        "Z2 STA: utilisation % | cycles saved %", units)
