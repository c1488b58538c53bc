"""Tile orders for rays: DRAM bytes of the hierarchy and cycles of Morton per eye, Z2 LRTA, Z2 STA and the rule, along head paths."""

import json
from concurrent.futures import ThreadPoolExecutor

from .common import mean, saved

# The rule's parameters were chosen on the first two groups. The last group is in the tables of the rule and of all scenes only.
UNSEEN = ["jungle", "plant", "meadow", "dabrovic-sponza"]
GROUPS = {"built in": ["chess", "car", "lab", "music-box"], "others": ["crytek-sponza", "stk-cocoa-temple", "stk-black-forest", "bmw_55k"], "unseen": UNSEEN}
SCENES = [scene for group in GROUPS.values() for scene in group]
OPTIONS = {
    "--size": dict(default="96x96", help="pixels per eye (96x96)"),
    "--frames": dict(type=int, default=30, help="consecutive frames of each path, 72 per second (30)"),
    "--only": dict(default=",".join(SCENES), help="scenes, with commas between them (all)"),
}
KINDS = {"primary": "primary", "shadow": "shadow", "mirror and glass": "reflection,refraction", "diffuse": "diffuse"}
# L2 sizes; the L1 caches of each unit have 4 KiB each.
L2_KIB = [16, 64, 256]
FIXED = ["morton", "z2-lrta", "z2-sta"]
RULE = "trials"
# What the results call both ways.
WAYS = {"full": ("reference_dram", "reference_tni_cycles"), "reprojected": ("dram", "tni_cycles")}


class Row:
    """A scene, a kind of ray, an L2 and a way: figures of each order, all frames together."""

    def __init__(self, way, runs, simulated):
        dram, cycles = WAYS[way]
        by_frame = {order: [of["result"][dram]["hierarchy_bytes"] for of in frames] for order, frames in runs.items()}
        self.frames = len(by_frame[RULE])
        self.cycles = {order: mean(of["result"][cycles] for of in frames) for order, frames in runs.items()}
        self.simulated = {order: result[cycles] for order, result in simulated.items()}
        self.sums = {order: sum(values) for order, values in by_frame.items()}
        self.oracle = sum(map(min, zip(*(by_frame[order] for order in FIXED))))
        self.over = 100 * (self.sums[RULE] / min(self.sums[order] for order in FIXED) - 1)

    def cells(self):
        base = self.sums["morton"]
        return [f"{base / self.frames / 1e6:.3f}", *(saved(self.sums[order], base) for order in [*FIXED[1:], RULE]), saved(self.oracle, base), f"{self.over:.2f}",
                *(f"{self.cycles[order] / 1e3:.1f}" for order in [*FIXED, RULE])]


def kept(rows):
    """The rule's share of the bytes that the oracle saves, in percent."""
    rows = list(rows)
    return 100 * sum(row.sums["morton"] - row.sums[RULE] for row in rows) / max(1, sum(row.sums["morton"] - row.oracle for row in rows))


def pair_kib(study, trace, kinds):
    """KiB of the distinct lines of a pair of tiles, mean over pairs, by kind of ray."""
    path = study.work / f"{trace.stem}.csv"
    study.replay("convert --to csv --line 64 --quiet", trace, "-o", path)
    of_name = {name: kind for kind, names in kinds.items() for name in names.split(",")}
    lines = {kind: set() for kind in kinds}
    with path.open() as rows:
        address, tile, kind = map(next(rows).rstrip().split(",").index, ("address", "tile", "kind"))
        for row in rows:
            cells = row.split(",")
            lines[of_name[cells[kind]]].add((cells[tile], cells[address]))
    path.unlink()
    tiles = {kind: len({tile for tile, _ in pairs}) for kind, pairs in lines.items()}
    return {kind: len(pairs) * 64 / 1024 / max(1, tiles[kind]) for kind, pairs in lines.items()}


def measure(study, traces, kind, kib):
    """The rows of both ways; none without such rays."""
    machine = study.work / f"{kib}.toml"
    machine.write_text(f"[cache]\nnode_l1_bytes = 4096\ntriangle_l1_bytes = 4096\nl2_bytes = {kib * 1024}\n")
    runs = {}
    for order in [*FIXED, RULE]:
        text = study.replay(
            "reproject --rule none --reuse pixel --between keep --json --quiet --rays", KINDS[kind], "--order", order, "--config", machine, *traces).out
        runs[order] = [json.loads(line) for line in text.splitlines()]
        if not runs[order][0]["result"]["reference_dram"]["hierarchy_bytes"]:
            return None
    # The cycle-level model supports only frames that start with empty caches. It is slow, so it runs with one size of the L2.
    words = ["reproject --rule none --reuse pixel --timing cycle --rays", KINDS[kind], "--config", machine, traces[0], "--order"]
    simulated = {order: study.json(*words, order)["result"] for order in FIXED if kib == L2_KIB[1]}
    return {way: Row(way, runs, simulated) for way in WAYS}


def run(study):
    scenes = study.options.only.split(",")
    for scene in scenes:
        study.scene(scene)
    size, frames = study.options.size, study.options.frames
    table, found = [], {}
    for scene in scenes:
        captured = lambda frame: study.rays(scene, f"--size {size} --visits --bounces 1 --path head --frame {frame}", name=f"{scene}-{frame}")
        traces = [captured(frame) for frame in range(frames)]
        pairs = pair_kib(study, traces[0], KINDS)
        study.say(scene)
        with ThreadPoolExecutor(2) as pool:
            rows = list(pool.map(lambda of: (of, measure(study, traces, *of)), [(kind, kib) for kind in KINDS for kib in L2_KIB]))
        study.drop(*traces)
        for (kind, kib), ways in rows:
            for way, row in (ways or {}).items():
                found[kind, kib, way, scene] = row
                table.append([scene, kind, f"{pairs[kind]:.1f}", kib, way, *row.cells()])
    detail = (f"{', '.join(scenes)}: tracegen rays SCENE --size {size} --visits --bounces 1 --path head --frame K, {frames} frames from 0, replay reproject --rule none "
              "--reuse pixel --between keep --rays KIND --order ORDER")
    figures = ("Morton MB per frame | LRTA saves % | STA saves % | rule saves % | oracle saves % | rule over the best fixed order % | "
               "Morton kcycles | LRTA kcycles | STA kcycles | rule kcycles")
    study.write("ray-orders", detail, f"scene | rays | tile pair KiB | L2 KiB | eyes | {figures}", table)
    middle = [[scene, kind, pair, way, *cells[:6]] for scene, kind, pair, kib, way, *cells in table if kib == L2_KIB[1] and scene not in UNSEEN]
    names = " | ".join(figures.split(" | ")[:6])
    study.write("ray-orders-scenes", detail, f"scene | rays | tile pair KiB | eyes | {names}", middle, f"L2 of {L2_KIB[1]} KiB")
    share = lambda rows, sums: f"{mean(100 * (1 - sums(row) / row.sums['morton']) for row in rows):.1f}"
    summary, cycles = [], []
    for kind in KINDS:
        for kib in L2_KIB:
            for way in WAYS:
                rows = {scene: row for (k, l2, w, scene), row in found.items() if (k, l2, w) == (kind, kib, way) and scene not in UNSEEN}
                shares = [share(rows.values(), lambda row, order=order: row.sums[order]) for order in [*FIXED[1:], RULE]]
                worst = max(rows, key=lambda scene: rows[scene].over)
                summary.append([kind, kib, way, len(rows), *shares, share(rows.values(), lambda row: row.oracle), f"{kept(rows.values()):.0f}",
                                f"{worst}: {rows[worst].over:.2f}"])
                cells = []
                for model, orders in ("cycles", [*FIXED[1:], RULE]), ("simulated", FIXED[1:]):
                    of_scenes = [getattr(row, model) for row in rows.values()]
                    if not of_scenes[0]:
                        cells += ["-"] * (1 + len(orders))
                        continue
                    cells.append(f"{mean(of['morton'] for of in of_scenes) / 1e3:.1f}")
                    cells += [f"{mean(100 * (1 - of[order] / of['morton']) for of in of_scenes):.1f}" for order in orders]
                cycles.append([kind, kib, way, *cells])
    study.write(
        "ray-orders-summary", detail, "rays | L2 KiB | eyes | scenes | LRTA saves % | STA saves % | rule saves % | oracle saves % | of the oracle's bytes, rule % | "
        "rule over the best fixed order, worst scene %", summary)
    study.write(
        "ray-orders-cycles", f"{detail}; cycle-level: frame 0 with --timing cycle", "rays | L2 KiB | eyes | closed form: Morton kcycles | LRTA saves % | STA saves % | "
        "rule saves % | cycle-level: Morton kcycles | cycle-level: LRTA saves % | cycle-level: STA saves %", cycles)
    groups = []
    for group, of_group in GROUPS.items():
        for way in WAYS:
            for kib in [*L2_KIB, "all"]:
                rows = [row for (_, l2, w, scene), row in found.items() if w == way and kib in (l2, "all") and scene in of_group]
                if not rows:
                    continue
                over = [row.over for row in rows]
                groups.append([group, way, kib, len(rows), share(rows, lambda row: row.sums[RULE]), share(rows, lambda row: row.oracle), f"{kept(rows):.1f}",
                               f"{mean(over):.2f}", f"{max(over):.2f}", sum(value > 1 for value in over)])
    study.write(
        "ray-orders-rule", detail, "scenes | eyes | L2 KiB | cases | rule saves % | oracle saves % | of the oracle's bytes, rule % | rule over the best fixed order, mean % | "
        "worst case % | cases above 1 %", groups)
