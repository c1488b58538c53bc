#!/usr/bin/env python3
"""Makes the tables of docs/results/orders.md from the measurements of scripts/orders.sh.

orders.py PART RESULTS reads the JSON files in the current folder. orders.py speed RESULTS REPLAY TRACE... measures.
"""
import csv
import glob
import json
import math
import os
import resource
import subprocess
import sys
import time

BASE = "z2-sta"
part, results, *measured = sys.argv[1:]


def rows_of(path):
    rows = json.load(open(path))["rows"]
    for row in rows:
        row["set"], row["label"] = row["trace"].split(",", 1)
    return rows


def change(rows):
    """Change of the bytes relative to z2-sta, percent: geometric mean over the rows in which an order can change the bytes."""
    ratios = [1 + row["change_pct"] / 100 for row in rows if row["change_pct"] is not None and can_change(row)]
    return 100 * (math.exp(sum(map(math.log, ratios)) / len(ratios)) - 1) if ratios else None


def can_change(row):
    return row["external_bytes"] / (1 + row["change_pct"] / 100) > row["distinct_bytes"] * (1 + 1e-9)


def worst(rows):
    """The camera with the worst mean over its caches."""
    labels = sorted({row["label"] for row in rows})
    changes = [(change([row for row in rows if row["label"] == label]), label) for label in labels]
    return max(pair for pair in changes if pair[0] is not None)


def one(x, decimals=1):
    if x is None:
        return ""
    text = f"{x:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def orders_in(rows):
    return list(dict.fromkeys(row["order"] for row in rows))


def ranks(values):
    order = sorted(values, key=values.get)
    return {name: place for place, name in enumerate(order)}


def rank_correlation(a, b):
    """Spearman's rank correlation of two tables with the same orders."""
    a, b = ranks(a), ranks(b)
    n = len(a)
    return 1 - 6 * sum((a[name] - b[name]) ** 2 for name in a) / (n * (n * n - 1))


def write(name, flags, heading, rows):
    with open(os.path.join(results, name + ".csv"), "w", newline="") as file:
        file.write(f"# command: scripts/orders.sh SCENES {part}  ({flags})\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(heading)
        table.writerows(rows)


def displays():
    files = ["symmetric-100", "dk2", "vive", "rift-cv1", "quest3", "quest2", "index", "pimax-5k-plus", "built-in"]
    found = {name: rows_of(f"displays,{name}.json") for name in files}
    offsets = {name: abs(int(rows[0]["offset_tiles"])) for name, rows in found.items()}
    heading = ["order", "state, bytes", "tables, bytes", "tile buffers"]
    heading += [f"{name}: {offsets[name]} tiles" if name != "built-in" else "built-in scenes, symmetric" for name in files]
    table, worsts = [], []
    for order in orders_in(found["symmetric-100"]):
        of = {name: [row for row in found[name] if row["order"] == order] for name in files}
        needs = of["symmetric-100"][0]
        line = [order, needs["state_bytes"], needs["table_bytes"], needs["tile_buffers"]]
        table.append(line + [one(change(of[name])) for name in files])
        worst_rows = [(worst(of[name]), name) for name in files]
        (most, label), name = max(worst_rows)
        worsts.append([order, one(most), label, name, one(max(row["change_pct"] for name in files for row in of[name] if can_change(row)))])
    flags = "tracegen raster SCENE --hmd DISPLAY, replay orders TRACES --orders ... --json: rows, change_pct"
    write("orders-displays", flags, heading, table)
    write("orders-worst", flags, ["order", "worst camera, %", "camera", "display", "worst camera and caches, %"], worsts)
    lines = []
    for name in files[:-1]:
        split = {}
        for of in ("design", "held-out"):
            rows = [row for row in found[name] if row["set"] == of]
            split[of] = {order: change([row for row in rows if row["order"] == order]) for order in orders_in(rows)}
        best = "adaptive+sta+offset+runs"
        lines.append([name, one(split["design"][best]), one(split["held-out"][best]), one(rank_correlation(split["design"], split["held-out"]), 3)])
    write("orders-split", flags, ["display", "adaptive+sta+offset+runs: design cameras, %", "held-out cameras, %", "rank correlation of the orders between both"], lines)


def cameras():
    rows = rows_of("cameras.json")
    table = []
    names = ["bound: infinite cache", "bound: OPT of z2-sta", "greedy", "anneal", "zig-zag+sta+offset", "adaptive+sta+offset"]
    for label in dict.fromkeys(row["trace"] for row in rows):
        own = [row for row in rows if row["trace"] == label]
        base = [row["external_mb_per_frame"] for row in own if row["order"] == BASE]
        changes = [change([row for row in own if row["order"] == name]) for name in names]
        table.append([label.replace(",", ": "), one(sum(base) / len(base), 3)] + [one(x) for x in changes])
    means = [change([row for row in rows if row["order"] == name]) for name in names]
    table.append(["geometric mean", ""] + [one(x) for x in means])
    flags = "replay orders TRACES --bounds --search greedy,greedy-64,anneal --moves 20000 --json: rows, change_pct; means over the paper's four caches"
    write("orders-cameras", flags, ["camera", "z2-sta, MB per frame"] + names, table)
    wanted = [
        "z2-sta", "zig-zag+sta+offset", "adaptive+sta+offset", "adaptive+sta+offset+runs", "adaptive+halves+offset+runs", "greedy-64", "greedy", "anneal", "bound: OPT by ways of z2-sta",
        "bound: OPT of z2-sta", "bound: OPT of zig-zag+sta+offset", "bound: infinite cache",
    ]
    lines = []
    log = lambda x: math.log(1 + x / 100)
    of = {name: [row for row in rows if row["order"] == name] for name in wanted}
    for name in wanted:
        line = [name, "yes" if of[name][0]["buildable"] else ""]
        for l2 in (128, 256):
            line.append(one(change([row for row in of[name] if row["l2_kib"] == l2])))
        own = change(of[name])
        line += [one(own)]
        line += [one(100 * log(own) / log(change(of[to])), 0) for to in ("greedy", "anneal", "bound: infinite cache")]
        lines.append(line)
    write("orders-bounds", flags, ["order or bound", "buildable", "128 KiB L2, %", "256 KiB L2, %", "all, %", "of the way to greedy, %", "to anneal, %", "to the infinite cache, %"], lines)


def all_orders():
    every = rows_of("all.json")
    table = []
    split = {}
    for which in ("design", "held-out"):
        rows = [row for row in every if row["set"] == which]
        split[which] = {order: change([row for row in rows if row["order"] == order]) for order in orders_in(rows)}
    for order in sorted(split["design"], key=lambda order: change([row for row in every if row["order"] == order])):
        own = [row for row in every if row["order"] == order]
        least, label = worst(own)
        miss = sum(row["l1_footprint_miss_pct"] for row in own) / len(own)
        needs = own[0]
        table.append([order, one(change(own)), one(split["design"][order]), one(split["held-out"][order]), f"{label}: {one(least)}", one(miss, 2),
                      needs["state_bytes"], needs["table_bytes"], needs["look_ahead_items"], needs["tile_buffers"], needs["decision_cycles"], needs["information"]])
    write("orders-all", "replay orders TRACES --json: rows", ["order", "all cameras, %", "design, %", "held out, %", "worst camera, %", "L1 misses, %",
          "state, bytes", "tables, bytes", "look-ahead, items", "tile buffers", "decision, cycles", "information"], table)
    print("rank correlation, all orders:", rank_correlation(split["design"], split["held-out"]))


def frames():
    betweens = ["keep", "lose-50", "flush"]
    rows = [row for path in sorted(glob.glob("frames,*.json")) for row in rows_of(path)]
    table = []
    for order in orders_in(rows):
        own = [row for row in rows if row["order"] == order]
        line = [order]
        line += [one(change([row for row in own if row["between_frames"] == between])) for between in betweens]
        kept = [row for row in own if row["between_frames"] == "keep"]
        least, label = worst(kept)
        line += [one(change([row for row in kept if row["set"] == which])) for which in ("design", "held-out")]
        table.append(line + [f"{label}: {one(least)}"])
    flags = "tracegen raster SCENE --path head --frames 120, replay orders TRACE --between keep,lose-50,flush --json: rows, change_pct"
    heading = ["order"] + [{"keep": "kept", "flush": "emptied"}.get(name, f"{name[5:]} % of the L2 lost") + ", %" for name in betweens]
    write("orders-frames", flags, heading + ["kept: design, %", "kept: held out, %", "kept: worst camera, %"], table)
    table, regrets, saved = [], [], []
    for path in sorted(glob.glob("learn,*.json")):
        learned = json.load(open(path))["learned"]
        for l1, l2 in dict.fromkeys((row["l1_kib"], row["l2_kib"]) for row in learned):
            own = [row for row in learned if (row["l1_kib"], row["l2_kib"]) == (l1, l2)]
            fixed, (learner,) = own[:-1], own[-1:]
            best = min(fixed, key=lambda row: row["external_bytes"])
            regrets.append(learner["regret_pct"])
            usual = fixed[0]["external_bytes"]
            saved.append(math.log(learner["external_bytes"] / usual))
            if l1 == 8:
                table.append([learner["trace"].replace(",", ": "), f"8/{l2:.0f}", best["order"], one(100 * (learner["external_bytes"] / usual - 1)), one(learner["regret_pct"]), one(learner["frame_best_pct"])])
    table.append(["mean of all caches", "", "", one(100 * (math.exp(sum(saved) / len(saved)) - 1)), one(sum(regrets) / len(regrets)), ""])
    heading = ["camera", "caches, KiB", "best fixed order", "learned, against adaptive+sta+offset+boustro, %", "regret, %", "best order of each frame saves, %"]
    write("orders-learned", "replay orders TRACE --learn --json: learned", heading, table)


def timed():
    table = []
    per_order = {}
    for cores in (2, 4, 8, 16):
        rows = rows_of(f"timed,{cores}.json")
        for order in orders_in(rows):
            own = [row for row in rows if row["order"] == order]
            mean = lambda key: sum(row[key] for row in own) / len(own)
            energy = math.exp(sum(math.log(row["dram_energy_mj"]) for row in own) / len(own))
            cycles = [1 + row["cycles_change_pct"] / 100 for row in own]
            cycles = 100 * (math.exp(sum(map(math.log, cycles)) / len(cycles)) - 1)
            per_order.setdefault(order, []).append((cores, change(own), cycles, mean("utilization_pct"), mean("l1_footprint_miss_pct"), mean("dram_row_hit_pct"), energy))
        if cores == 2:
            split = {of: {order: change([row for row in rows if row["order"] == order and row["set"] == of]) for order in orders_in(rows)} for of in ("design", "held-out")}
            print("rank correlation, timed:", rank_correlation(split["design"], split["held-out"]))
    base = {entry[0]: entry for entry in per_order[BASE]}
    for order, entries in per_order.items():
        two = entries[0]
        line = [order, one(two[1]), one(two[2], 2), one(two[3], 2), one(two[4], 2), one(two[5]), one(100 * (two[6] / base[2][6] - 1))]
        for entry in entries[1:]:
            line += [one(entry[1]), one(entry[2], 2)]
        table.append(line)
    heading = ["order", "bytes, %", "cycles, %", "utilisation, %", "L1 misses, %", "DRAM row hits, %", "DRAM energy, %"]
    heading += [f"{cores} cores: {what}, %" for cores in (4, 8, 16) for what in ("bytes", "cycles")]
    write("orders-timed", "replay orders TRACES --mode timed --dram lpddr4 --cores N --caches 8/128,16/256 --json: rows; bytes, cycles and energy against z2-sta", heading, table)


def axes():
    best = "adaptive+sta+offset+runs"
    fixed = ["zig-zag+sta+offset+runs", "band4+sta+offset+runs", "band8+sta+offset+runs"]
    table = []
    for path in sorted(glob.glob("axes,*.json"), key=os.path.getmtime):
        rows = rows_of(path)
        of = {order: [row for row in rows if row["order"] == order] for order in orders_in(rows)}
        line = [path[len("axes,"):-len(".json")], one(sum(row["external_mb_per_frame"] for row in of[BASE]) / len(of[BASE]), 3), one(change(of[best]))]
        line += [one(change([row for row in of[best] if row["set"] == which])) for which in ("design", "held-out")]
        least, label = worst(of[best])
        line.append(f"{label}: {one(least)}")
        line += [one(change(of[order])) for order in fixed + ["adaptive+halves+offset+runs", "adaptive+lrta+offset+runs"]]
        # The best of four orders for each camera and pair of caches, which a learner finds while the head is still.
        settled = [min(rows, key=lambda row: row["external_bytes"]) for rows in zip(*(of[order] for order in [best] + fixed))]
        line.append(one(change(settled)))
        whole = [(own["whole_frame_bytes"], base["whole_frame_bytes"]) for own, base in zip(of[best], of[BASE])]
        ratios = [own / base for own, base in whole if base]
        line.append(one(100 * (math.exp(sum(map(math.log, ratios)) / len(ratios)) - 1)) if ratios else "")
        table.append(line)
    heading = ["changed setting", "z2-sta, MB per frame", f"{best}, %", "design, %", "held out, %", "worst camera, %"] + [f"{order}, %" for order in fixed]
    heading += ["adaptive+halves+offset+runs, %", "adaptive+lrta+offset+runs, %", "best of the first four curves, %", f"all clients: {best}, %"]
    write("orders-axes", "replay orders TRACES with the flag that the row names, --json: rows, change_pct", heading, table)


def speed():
    """Time of one run over all traces, with the first 40 default orders and the paper's four pairs of caches."""
    replay, *traces = measured
    command = [replay, "orders", *traces, "--json", "--quiet"]
    listed = subprocess.run([replay, "orders", traces[0], "--caches", "8/128", "--json", "--quiet"], check=True, capture_output=True)
    orders = orders_in(json.loads(listed.stdout)["rows"])[:40]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    output = subprocess.run([*command, "--orders", ",".join(orders)], check=True, capture_output=True).stdout
    wall_s, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    heading = ["cameras", "orders", "pairs of caches", "replays", "processors", "wall time, s", "user time, s", "system time, s"]
    line = [len(traces), len(orders), 4, len(json.loads(output)["rows"]), os.cpu_count(), one(wall_s)]
    line += [one(after.ru_utime - before.ru_utime), one(after.ru_stime - before.ru_stime)]
    write("orders-speed", "replay orders TRACES --json, timed by scripts/orders.py", heading, [line])


{"displays": displays, "all": all_orders, "cameras": cameras, "frames": frames, "timed": timed, "axes": axes, "speed": speed}[part]()
