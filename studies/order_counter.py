"""The counter of the adaptive curve in hardware: distinct lines of a pair of tiles, counted exactly or with a bitmap, and how often the curve then differs."""

from math import log

from .common import mean

SIZES = ["480x540", "960x1080"]
SCENES = ["atrium", "jungle", "plant", "crytek-sponza", "stk-cocoa-temple", "stk-black-forest", "dabrovic-sponza"]
BITMAP_BITS = [256, 1024, 4096]
L2_KIB = [32, 64, 128, 256]
LINE_BYTES = 16
# As in replay/sim/src/order/curve/adaptive.rs.
ROWS, COLUMNS = (3, 8), 6


def lines_of_pairs(study, trace):
    """Of each pair of tiles, which have one number because the eyes are symmetric: its distinct lines. And the tiles of a row and column."""
    path = study.work / f"{trace.stem}.csv"
    info = study.json("info", trace)
    columns, rows = info["passes"][0]["tiles"]
    pairs = [set() for _ in range(columns * rows)]
    study.replay("convert --to csv --granularity line --quiet -o", path, trace)
    with open(path) as file:
        next(file)
        for line in file:
            address, _, tile, _ = line.split(",", 3)
            pairs[int(tile)].add(int(address, 16) // LINE_BYTES)
    path.unlink()
    return pairs, columns, rows


def by_bitmap(lines, bits):
    """Linear counting (Whang, Vander-Zanden, Taylor, 1990): each line sets a bit, and the zeros tell how many lines there were."""
    zeros = bits - len({(line * 2654435761 & 0xFFFFFFFF) * bits >> 32 for line in lines})
    return -bits * log(max(zeros, 1) / bits)


def height(count, columns, rows, l2_kib):
    """Rows of a band of the adaptive curve."""
    row_bytes = int(count * LINE_BYTES) // rows
    if row_bytes <= l2_kib * 1024:
        return 1
    return min(max(columns * l2_kib * 1024 // row_bytes // COLUMNS, ROWS[0]), ROWS[1])


def run(study):
    table, summary = [], []
    errors = {bits: [] for bits in BITMAP_BITS}
    other = {bits: 0 for bits in BITMAP_BITS}
    largest = 0
    for scene in study.present(SCENES):
        for size in SIZES:
            trace = study.raster(scene, f"--size {size}", name=f"{scene}-{size}")
            pairs, columns, rows = lines_of_pairs(study, trace)
            study.drop(trace)
            exact = sum(map(len, pairs))
            most = max(map(len, pairs))
            largest = max(largest, most)
            row = [scene, size, f"{exact / len(pairs):.0f}", most]
            for bits in BITMAP_BITS:
                found = sum(by_bitmap(lines, bits) for lines in pairs)
                errors[bits].append(100 * (found / exact - 1))
                differing = [kib for kib in L2_KIB if height(found, columns, rows, kib) != height(exact, columns, rows, kib)]
                other[bits] += len(differing)
                row += [f"{errors[bits][-1]:.2f}", ", ".join(map(str, differing)) or "none"]
            table.append(row)
            study.say(f"{scene}, {size}")
    study.write("order-counter", "tracegen raster SCENE --size SIZE, replay convert --to csv --granularity line",
                "scene | pixels per eye | distinct lines of a pair, mean | most | " + " | ".join(
                    f"{bits} bits: error % | {bits} bits: another curve at L2 KiB" for bits in BITMAP_BITS), table)
    cases = len(table) * len(L2_KIB)
    summary.append(["exact, a line number of 32 bits each", largest * 32 // 8, "0.00", "0.00", 0, cases])
    for bits in BITMAP_BITS:
        worst = max(errors[bits], key=abs)
        summary.append([f"bitmap of {bits} bits", bits // 8, f"{mean(errors[bits]):.2f}", f"{worst:.2f}", other[bits], cases])
    study.write("order-counter-summary", "", "counter | bytes | error, mean % | error, worst % | cases with another curve | cases", summary,
                f"L2 of {', '.join(map(str, L2_KIB))} KiB, lines of {LINE_BYTES} bytes")
