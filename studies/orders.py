"""What tile orders save on real scenes, in parts: the tables of docs/results/orders.md, which says which cameras and displays were held out.

Parts: displays, all, cameras, frames, timed, axes, speed; by default all of them, which takes hours. The traces of `frames` have 9 GB (--traces).
"""

import json
import math
import os

from .common import Failed, geometric_mean, mean

# Set, label, scene, camera.
CAMERAS = [line.split() for line in """
design crytek-atrium crytek-sponza cam_atrium_eye
design crytek-arcade crytek-sponza cam_arcade
design dabrovic-gallery dabrovic-sponza cam_gallery
design cocoa-jungle stk-cocoa-temple cam_jungle
design cocoa-bridge stk-cocoa-temple cam_bridge
design forest-farm stk-black-forest cam_farm
design chess-player chess_42k cam_player
held-out crytek-gallery crytek-sponza cam_gallery
held-out dabrovic-atrium dabrovic-sponza cam_atrium_eye
held-out dabrovic-arcade dabrovic-sponza cam_arcade
held-out cocoa-pond stk-cocoa-temple cam_pond
held-out cocoa-temple stk-cocoa-temple cam_temple
held-out forest-brook stk-black-forest cam_brook
held-out chess-low chess_42k cam_low
""".strip().splitlines()]
# Held-out scenes. BMW's textures fit into the caches and the teapot has none, so orders cannot change their traffic.
BUILT_IN = "atrium jungle meadow plant car lab music-box".split()
DISPLAYS = "symmetric-100 dk2 vive rift-cv1 quest3 quest2 index pimax-5k-plus".split()
IN_MOTION = ["chess-player", "dabrovic-gallery", "crytek-atrium", "crytek-gallery"]
SETS = ["design", "held-out"]
BASE, BEST = "z2-sta", "adaptive+sta+offset+runs"


# Rows of `replay orders`: a trace, an order, a pair of caches.


def labelled(rows):
    for row in rows:
        row["set"], row["label"] = row["trace"].split(",", 1)
    return rows


def where(rows, **wanted):
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def by(rows, key):
    """Rows by the value of a column, in the order of first appearance."""
    found = {}
    for row in rows:
        found.setdefault(row[key], []).append(row)
    return found


def can_change(row):
    return row["external_bytes"] / (1 + row["change_pct"] / 100) > row["distinct_bytes"] * (1 + 1e-9)


def change(rows):
    """Change of the bytes relative to z2-sta, percent: geometric mean over the rows in which an order can change the bytes."""
    return mean_change(row["change_pct"] for row in rows if row["change_pct"] is not None and can_change(row))


def mean_change(percents):
    ratios = [1 + percent / 100 for percent in percents]
    return 100 * (geometric_mean(ratios) - 1) if ratios else None


def changes(rows):
    """The change of each order."""
    return {order: change(own) for order, own in by(rows, "order").items()}


def worst(rows):
    """The camera with the worst mean over its caches, and that mean."""
    found = {label: change(own) for label, own in by(rows, "label").items()}
    return max((value, label) for label, value in found.items() if value is not None)


def show_worst(rows):
    most, label = worst(rows)
    return f"{label}: {one(most)}"


def by_set(rows):
    """The changes on the design cameras and on those held out."""
    return [change(where(rows, set=name)) for name in SETS]


def rank_correlation(a, b):
    """Spearman's rank correlation of two tables with the same orders."""
    ranks = [{name: place for place, name in enumerate(sorted(table, key=table.get))} for table in (a, b)]
    n = len(a)
    return 1 - 6 * sum((ranks[0][name] - ranks[1][name]) ** 2 for name in a) / (n * (n * n - 1))


def correlation_of_sets(rows):
    return rank_correlation(*(changes(where(rows, set=name)) for name in SETS))


def one(x, decimals=1):
    if x is None:
        return ""
    text = f"{x:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def capture(study, folder, flags, labels=None):
    """Traces of every camera, or of those named. Those of a folder are made once."""
    return sorted(
        study.raster(scene, "--camera", camera, flags, name=f"{folder}/{name},{label}")
        for name, label, scene, camera in CAMERAS if labels is None or label in labels)


def symmetric(study):
    return capture(study, "symmetric-100", "--hmd symmetric-100")


# The Z2 paper's machines.
PAPER = "--caches 8/128,16/128,8/256,16/256"


def measure(study, traces, *flags):
    """Rows of `replay orders`, on the paper's machines unless a flag has others."""
    caches = [] if any("--caches" in flag for flag in flags) else [PAPER]
    return labelled(study.json("orders", *traces, *flags, *caches)["rows"])


# Parts.

DISPLAY_ORDERS = (
    "z2-sta,morton,z2-lrta,gilbert+sta,zig-zag+sta,band+sta,morton+sta+offset,zig-zag+sta+offset,strip+sta+offset,adaptive+sta+offset,"
    "adaptive+sta+offset+runs,adaptive+halves+offset+runs,adaptive+lrta+offset+runs,strip+sta+infinity+runs,adaptive+sta+infinity+runs")


def displays(study, write):
    found = {}
    for display in DISPLAYS:
        traces = capture(study, display, f"--hmd {display}{' --size 960x1080' if display == 'quest3' else ''}")
        found[display] = measure(study, traces, "--orders", DISPLAY_ORDERS)
        if display != "symmetric-100":
            study.drop(*traces)
    traces = sorted(study.raster(scene, name=f"built-in/held-out,{scene}") for scene in BUILT_IN)
    found["built-in"] = measure(study, traces, "--orders", DISPLAY_ORDERS)
    table, worsts = [], []
    for order, rows in by(found["symmetric-100"], "order").items():
        of = {name: where(found[name], order=order) for name in found}
        table.append([order, *(rows[0][key] for key in ("state_bytes", "table_bytes", "tile_buffers")), *(change(own) for own in of.values())])
        (most, label), display = max((worst(own), name) for name, own in of.items())
        worsts.append([order, most, label, display, max(row["change_pct"] for own in of.values() for row in own if can_change(row))])
    splits = [[name, *by_set(where(found[name], order=BEST)), one(correlation_of_sets(found[name]), 3)] for name in DISPLAYS]
    detail = f"tracegen raster SCENE --hmd DISPLAY, replay orders TRACES --orders ... {PAPER} --json: rows, change_pct"
    offsets = " | ".join(f"{name}: {abs(int(found[name][0]['offset_tiles']))} tiles" for name in DISPLAYS)
    write("orders-displays", detail, f"order | state, bytes | tables, bytes | tile buffers | {offsets} | built-in scenes, symmetric", table)
    write("orders-worst", detail, "order | worst camera, % | camera | display | worst camera and caches, %", worsts)
    write("orders-split", detail, f"display | {BEST}: design cameras, % | held-out cameras, % | rank correlation of the orders between both", splits)


def all_orders(study, write):
    every = measure(study, symmetric(study))
    table = []
    for order, own in sorted(by(every, "order").items(), key=lambda pair: change(pair[1])):
        misses = mean(row["l1_footprint_miss_pct"] for row in own)
        needs = [own[0][key] for key in ("state_bytes", "table_bytes", "look_ahead_items", "tile_buffers", "decision_cycles", "information")]
        table.append([order, change(own), *by_set(own), show_worst(own), one(misses, 2), *needs])
    write("orders-all", f"replay orders TRACES {PAPER} --json: rows", (
        "order | all cameras, % | design, % | held out, % | worst camera, % | L1 misses, % | state, bytes | tables, bytes | look-ahead, items | "
        "tile buffers | decision, cycles | information"), table)
    print("rank correlation, all orders:", correlation_of_sets(every))


SEARCHED_ORDERS = ["z2-sta", "zig-zag+sta+offset", "adaptive+sta+offset", BEST, "adaptive+halves+offset+runs"]
INFINITE = "bound: infinite cache"
# Columns by camera, and rows of orders and bounds.
BY_CAMERA = [INFINITE, "bound: OPT of z2-sta", "greedy", "anneal", "zig-zag+sta+offset", "adaptive+sta+offset"]
BOUNDS = [
    *SEARCHED_ORDERS, "greedy-64", "greedy", "anneal", "bound: OPT by ways of z2-sta", "bound: OPT of z2-sta", "bound: OPT of zig-zag+sta+offset", INFINITE,
]


def cameras(study, write):
    flags = "--bounds --search greedy,greedy-64,anneal --moves 20000"
    rows = measure(study, symmetric(study), "--orders", ",".join(SEARCHED_ORDERS), flags)
    detail = f"replay orders TRACES {flags} {PAPER} --json: rows, change_pct"
    table = []
    for trace, own in by(rows, "trace").items():
        base = mean(row["external_mb_per_frame"] for row in where(own, order=BASE))
        table.append([trace.replace(",", ": "), one(base, 3), *(change(where(own, order=name)) for name in BY_CAMERA)])
    table.append(["geometric mean", "", *(change(where(rows, order=name)) for name in BY_CAMERA)])
    write("orders-cameras", detail, " | ".join(["camera", "z2-sta, MB per frame", *BY_CAMERA]), table)
    of = {name: where(rows, order=name) for name in BOUNDS}
    log = {name: math.log(1 + change(own) / 100) for name, own in of.items()}
    table = []
    for name, own in of.items():
        by_l2 = [change(where(own, l2_kib=l2)) for l2 in (128, 256)]
        table.append([name, "yes" if own[0]["buildable"] else "", *by_l2, change(own),
                      *(one(100 * log[name] / log[to], 0) for to in ("greedy", "anneal", INFINITE))])
    write("orders-bounds", detail, (
        "order or bound | buildable | 128 KiB L2, % | 256 KiB L2, % | all, % | of the way to greedy, % | to anneal, % | to the infinite cache, %"), table)


BETWEEN = {"keep": "kept", "lose-50": "50 % of the L2 lost", "flush": "emptied"}
MOVING_ORDERS = (
    "z2-sta,morton+sta+boustro,zig-zag+sta+offset+boustro,adaptive+sta+offset,adaptive+sta+offset+boustro,adaptive+sta+offset+boustro+runs,"
    "adaptive+halves+offset+boustro+runs,band+sta+offset+boustro")


def learned_rows(learned):
    """Of each pair of caches: the trace, the caches, the best fixed order, and what the learner fetches over the usual order, its regret and more."""
    for l1, l2 in dict.fromkeys((row["l1_kib"], row["l2_kib"]) for row in learned):
        *fixed, learner = where(learned, l1_kib=l1, l2_kib=l2)
        best = min(fixed, key=lambda row: row["external_bytes"])
        yield l1, l2, best["order"], 100 * (learner["external_bytes"] / fixed[0]["external_bytes"] - 1), learner


def frames(study, write):
    rows, table, over, regrets = [], [], [], []
    between = f"--between {','.join(BETWEEN)}"
    for label in sorted(IN_MOTION, key=lambda label: next(camera[:2] for camera in CAMERAS if camera[1] == label)):
        traces = capture(study, "head", "--path head --frames 120", labels=[label])
        rows += measure(study, traces, between, "--orders", MOVING_ORDERS)
        for l1, l2, best, percent, learner in learned_rows(study.json("orders --learn --orders", BASE, *traces)["learned"]):
            over.append(percent)
            regrets.append(learner["regret_pct"])
            if l1 == 8:
                table.append([learner["trace"].replace(",", ": "), f"8/{l2:.0f}", best, percent, learner["regret_pct"], learner["frame_best_pct"]])
        study.drop(*traces)
    table.append(["mean of all caches", "", "", mean_change(over), mean(regrets), ""])
    write("orders-learned", f"replay orders TRACE --learn {PAPER} --json: learned", (
        "camera | caches, KiB | best fixed order | learned, against adaptive+sta+offset+boustro, % | regret, % | best order of each frame saves, %"), table)
    table = []
    for order, own in by(rows, "order").items():
        kept = where(own, between_frames="keep")
        table.append([order, *(change(where(own, between_frames=name)) for name in BETWEEN), *by_set(kept), show_worst(kept)])
    titles = ", % | ".join(BETWEEN.values())
    write("orders-frames", f"tracegen raster SCENE --path head --frames 120, replay orders TRACE {between} {PAPER} --json: rows, change_pct",
          f"order | {titles}, % | kept: design, % | kept: held out, % | kept: worst camera, %", table)


TIMED_ORDERS = (
    "z2-sta,morton,z2-lrta,zig-zag+sta+offset,adaptive+sta+offset,adaptive+sta+offset+static,adaptive+sta+offset+affinity,adaptive+sta+offset+quads,"
    "adaptive+sta+offset+runs,adaptive+halves+offset+runs,adaptive+lrta+offset+runs")
TIMED_FIGURES = [("utilization_pct", 2), ("l1_footprint_miss_pct", 2), ("dram_row_hit_pct", 1)]


def timed(study, write):
    flags = "--mode timed --dram lpddr4 --caches 8/128,16/256 --orders"
    by_cores = {cores: measure(study, symmetric(study), f"--cores {cores}", flags, TIMED_ORDERS) for cores in (2, 4, 8, 16)}
    two = by_cores[2]
    print("rank correlation, timed:", correlation_of_sets(two))
    energy = {order: geometric_mean(row["dram_energy_mj"] for row in own) for order, own in by(two, "order").items()}
    table = []
    for order in energy:
        costs = []
        for rows in by_cores.values():
            own = where(rows, order=order)
            costs += [change(own), one(mean_change(row["cycles_change_pct"] for row in own), 2)]
        figures = [one(mean(row[key] for row in where(two, order=order)), digits) for key, digits in TIMED_FIGURES]
        table.append([order, *costs[:2], *figures, 100 * (energy[order] / energy[BASE] - 1), *costs[2:]])
    write("orders-timed", "replay orders TRACES --mode timed --dram lpddr4 --cores N --caches 8/128,16/256 --json: rows; bytes, cycles and energy against z2-sta", (
        "order | bytes, % | cycles, % | utilisation, % | L1 misses, % | DRAM row hits, % | DRAM energy, % | 4 cores: bytes, % | 4 cores: cycles, % | "
        "8 cores: bytes, % | 8 cores: cycles, % | 16 cores: bytes, % | 16 cores: cycles, %"), table)


# Changed setting: folder and flags of the capture if it is another one, flags of the replay.
AXES = {
    "BC1, 16-byte lines": ("", ""),
    "32-byte lines": ("", "--line 32"),
    "64-byte lines": ("", "--line 64"),
    "BC7": ("", "--texel-format bc7"),
    "ASTC 6x6": ("", "--texel-format astc-6x6"),
    "RGBA8": ("", "--texel-format rgba8"),
    "tiles of 32 px": ("", "--tile-px 32"),
    "one core": ("", "--cores 1"),
    "8 cores": ("", "--cores 8"),
    "512 KiB L2": ("", "--caches 8/512"),
    "four shadow cascades": ("--shadows", ""),
    "linear shadow maps": ("--shadows", "--shadow-map-order linear"),
    "whole frame, all clients": ("--geometry", "--frame tile-based"),
}
# A learner finds the best of the first four for each camera and pair of caches while the head is still.
CURVES = [BEST, "zig-zag+sta+offset+runs", "band4+sta+offset+runs", "band8+sta+offset+runs"]
PAIRINGS = ["adaptive+halves+offset+runs", "adaptive+lrta+offset+runs"]


def axes(study, write):
    orders = [BASE, CURVES[1], BEST, *PAIRINGS, *CURVES[2:]]
    shown = [*CURVES[1:], *PAIRINGS]
    table, made = [], ("", [])
    for setting, (with_, flags) in AXES.items():
        if with_ and made[0] != with_:
            study.drop(*made[1])
            made = (with_, capture(study, with_.strip("-"), f"--hmd symmetric-100 {with_}"))
        of = by(measure(study, made[1] if with_ else symmetric(study), "--orders", ",".join(orders), flags), "order")
        settled = [min(rows, key=lambda row: row["external_bytes"]) for rows in zip(*(of[order] for order in CURVES))]
        whole = [own["whole_frame_bytes"] / base["whole_frame_bytes"] for own, base in zip(of[BEST], of[BASE]) if base["whole_frame_bytes"]]
        table.append([
            setting, one(mean(row["external_mb_per_frame"] for row in of[BASE]), 3), change(of[BEST]), *by_set(of[BEST]), show_worst(of[BEST]),
            *(change(of[order]) for order in shown), change(settled), 100 * (geometric_mean(whole) - 1) if whole else ""])
    study.drop(*made[1])
    write("orders-axes", f"replay orders TRACES {PAPER} with the flag that the row names, --json: rows, change_pct", (
        f"changed setting | z2-sta, MB per frame | {BEST}, % | design, % | held out, % | worst camera, % | {', % | '.join(shown)}, % | "
        f"best of the first four curves, % | all clients: {BEST}, %"), table)


def speed(study, write):
    """Time of one run over all traces, with the first 40 default orders and the paper's four pairs of caches."""
    traces = symmetric(study)
    orders = list(by(measure(study, traces[:1], "--caches 8/128"), "order"))[:40]
    done = study.replay("orders --json --quiet --orders", ",".join(orders), *traces)
    replays = len(json.loads(done.out)["rows"])
    write("orders-speed", f"replay orders TRACES {PAPER} --json, timed by the study", (
        "cameras | orders | pairs of caches | replays | processors | wall time, s | user time, s | system time, s"),
        [[len(traces), len(orders), 4, replays, os.cpu_count(), done.wall_s, done.user_s, done.system_s]])


PARTS = {"displays": displays, "all": all_orders, "cameras": cameras, "frames": frames, "timed": timed, "axes": axes, "speed": speed}
OPTIONS = {"parts": dict(nargs="*", metavar="PART", help=f"some of: {', '.join(PARTS)} (all)")}


def run(study):
    for part in study.options.parts or PARTS:
        if part not in PARTS:
            raise Failed(f"expected some of: {', '.join(PARTS)}; found '{part}'")

        def write(name, detail, heading, rows):
            """Writes a table of the part. Figures have a decimal unless they are formatted already."""
            cells = [[one(cell) if cell is None or isinstance(cell, float) else cell for cell in row] for row in rows]
            study.write(name, detail, heading, cells, part=part)

        PARTS[part](study, write)
