#!/usr/bin/env python3
"""Compares `replay locality` and `replay run` with pycachesim, with a plain twin in this file and,
where its program is given, with Dinero IV, on the accesses that `replay convert` writes.

    pip install pycachesim
    scripts/pycachesim_compare.py REPLAY TRACE... [--order morton] [--dinero DINEROIV]

REPLAY is the program. One core, since an export has one stream. For both levels: look-ups, misses,
the split into compulsory, capacity and conflict misses, and the misses of a fully associative cache
of the size. Ends with code 1 where any count differs.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections import OrderedDict

LINE_BYTES = 16


class Lru:
    """A set-associative LRU cache, the plainest way."""

    def __init__(self, sets, ways):
        self.sets, self.ways = [OrderedDict() for _ in range(sets)], ways

    def access(self, line):
        entries = self.sets[line % len(self.sets)]
        if line in entries:
            entries.move_to_end(line)
            return True
        if len(entries) == self.ways:
            entries.popitem(last=False)
        entries[line] = None
        return False


class Level:
    """A level with its fully associative and its infinite companion."""

    def __init__(self, size_bytes, ways):
        self.lines, self.ways = size_bytes // LINE_BYTES, ways
        self.own, self.full, self.seen = Lru(self.lines // ways, ways), Lru(1, self.lines), set()
        self.counts = dict.fromkeys(KEYS, 0)

    def access(self, line):
        own, full = self.own.access(line), self.full.access(line)
        counts = self.counts
        counts["accesses"] += 1
        counts["fully_associative_misses"] += not full
        if not own:
            counts["misses"] += 1
            cause = "conflict" if full else "capacity" if line in self.seen else "compulsory"
            counts[cause] += 1
        elif not full:
            counts["avoided"] += 1
        self.seen.add(line)
        return own


KEYS = ["accesses", "misses", "compulsory", "capacity", "conflict", "avoided", "fully_associative_misses"]


def twin(addresses, l1, l2):
    for address in addresses:
        line = address // LINE_BYTES
        if not l1.access(line):
            l2.access(line)
    return [l1.counts, l2.counts]


def pycachesim(cachesim, addresses, geometries):
    """Look-ups and misses of each level of a hierarchy: geometries are sets and ways, L1 first."""
    below, caches = None, []
    for number, (sets, ways) in reversed(list(enumerate(geometries, 1))):
        below = cachesim.Cache(f"L{number}", sets, ways, LINE_BYTES, "LRU", load_from=below)
        caches.append(below)
    memory = cachesim.MainMemory()
    memory.load_to(caches[0])
    memory.store_from(caches[0])
    simulator = cachesim.CacheSimulator(below, memory)
    simulator.load(addresses, length=1)
    return [{"accesses": s["HIT_count"] + s["MISS_count"], "misses": s["MISS_count"]}
            for s in list(simulator.stats())[: len(geometries)]]


def dinero(program, din, sizes):
    """What Dinero IV prints of the L1, with the split."""
    options = ["-l1-dsize", str(sizes[0]), "-l1-dassoc", "4", "-l1-dbsize", str(LINE_BYTES), "-l1-dccc",
               "-l1-drepl", "l", "-l1-dfetch", "d", "-informat", "d"]
    with open(din) as text:
        out = subprocess.run([program, *options], stdin=text, check=True, capture_output=True, text=True).stdout
    number = lambda name: int(re.search(rf"^ *{name}\s+(\d+)", out, re.M).group(1))
    return {"accesses": number("Demand Fetches"), "misses": number("Demand Misses"),
            **{cause: number(f"{cause.capitalize()} misses") for cause in ("compulsory", "capacity", "conflict")}}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("replay")
    parser.add_argument("traces", nargs="+")
    parser.add_argument("--order", default="morton")
    parser.add_argument("--dinero")
    args = parser.parse_args()
    try:
        import cachesim
    except ImportError:
        print("skipped: pycachesim is not installed")
        return 0
    sizes, ways = [8 << 10, 128 << 10], 4
    machine = ["--cores", "1", "--line", str(LINE_BYTES), "--ways", str(ways),
               "--l1", str(sizes[0]), "--l2", str(sizes[1])]
    differences = 0
    for trace in args.traces:
        call = lambda *words: subprocess.run([args.replay, *words], check=True, capture_output=True).stdout
        rows = json.loads(call("locality", trace, "--orders", args.order, "--json", *machine))["rows"]
        run = json.loads(call("run", trace, "--order", args.order, "--mode", "functional", "--json", *machine))
        with tempfile.NamedTemporaryFile("r", suffix=".din") as din:
            subprocess.run([args.replay, "convert", trace, "--to", "din", "--order", args.order, "-o", din.name],
                           check=True)
            addresses = [int(line[2:], 16) for line in open(din.name)]
            others = {"replay run": [
                {"accesses": run["result"][level]["line_lookups"], "misses": run["result"][level]["line_misses"]}
                for level in ("l1", "l2")]}
            sets = [size // LINE_BYTES // ways for size in sizes]
            others["pycachesim"] = pycachesim(cachesim, addresses, [(s, ways) for s in sets])
            full = pycachesim(cachesim, addresses, [(1, sizes[0] // LINE_BYTES)])
            others["pycachesim, 1 set"] = [{"fully_associative_misses": full[0]["misses"]}]
            others["twin"] = twin(addresses, *[Level(size, ways) for size in sizes])
            if args.dinero:
                others["Dinero IV"] = [dinero(args.dinero, din.name, sizes)]
        for other, levels in others.items():
            for row, counts in zip(rows, levels):
                wrong = {key: (row[key], count) for key, count in counts.items() if row[key] != count}
                differences += len(wrong)
                said = f"differ: {wrong}" if wrong else f"{len(counts)} counts identical"
                print(f"{trace}, {row['stream']}, {other}: {said}", flush=True)
        for row in rows:
            print(f"{trace}, {row['stream']}: " + ", ".join(f"{key} {row[key]}" for key in KEYS), flush=True)
    return int(differences > 0)


if __name__ == "__main__":
    sys.exit(main())
