"""What prefetchers of the L2 save in time and cost in traffic: Crytek Sponza, atrium and jungle as the DK2 shows them."""

from .common import megabytes

# A block of one line prefetches nothing.
PREFETCHERS = [
    ("none", 0), *(("next-line", lines) for lines in (1, 2, 4, 8)), *(("aligned-block", lines) for lines in (2, 4, 8)),
    *(("next-mip", levels) for levels in (1, 2)), ("tile-ahead", 4096),
]


def flags(study, prefetcher, lines):
    if prefetcher == "none":
        return []
    if prefetcher == "tile-ahead":
        return ["--prefetch", prefetcher]
    return study.config("[prefetch]", f'prefetcher = "{prefetcher}"', f"lines = {lines}")


def run(study):
    rows = []
    for scene, trace in study.dk2():
        base = study.pair(trace)
        for prefetcher, lines in PREFETCHERS:
            row = [scene, prefetcher, lines or "-"]
            for without, result in zip(base, study.pair(trace, *flags(study, prefetcher, lines))):
                prefetched = result.get("prefetch")
                useful = f"{100 * prefetched['useful_lines'] / prefetched['lines']:.1f}" if prefetched else "-"
                row += [megabytes(result), useful, f"{result['l2']['line_misses']:,}", f"{100 * (result['cycles'] / without['cycles'] - 1):+.1f}"]
            rows.append(row)
    study.write(
        "prefetch", "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --config FILE with a [prefetch] table",
        "scene | prefetcher | lines | Morton: MB per frame | Morton: useful % of prefetched | Morton: L2 misses | Morton: cycles, % | "
        "Z2 STA: MB per frame | Z2 STA: useful % of prefetched | Z2 STA: L2 misses | Z2 STA: cycles, %", rows)
