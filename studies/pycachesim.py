"""`replay locality` and `replay run` against pycachesim, a plain twin and Dinero IV, on the accesses that `replay convert` writes. Prints; writes no table.

One core, since an export has one stream. For both levels: look-ups, misses, the split into compulsory, capacity and conflict misses, and the misses of
a fully associative cache of the size. Exit code 1 where any count differs. Needs the Python package pycachesim.
"""

import re
from collections import OrderedDict
from pathlib import Path

import cachesim

from .common import execute

OPTIONS = {
    "files": dict(nargs="+", type=Path, metavar="TRACE"),
    "--order": dict(default="morton", help="tile order (morton)"),
    "--dinero": dict(type=Path, help="the program dineroIV"),
}
LINE_BYTES, WAYS = 16, 4
SIZES = [8 << 10, 128 << 10]
KEYS = "accesses misses compulsory capacity conflict avoided fully_associative_misses".split()


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

    def __init__(self, size_bytes):
        lines = size_bytes // LINE_BYTES
        self.own, self.full, self.seen = Lru(lines // WAYS, WAYS), Lru(1, lines), set()
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


def twin(addresses):
    l1, l2 = map(Level, SIZES)
    for address in addresses:
        line = address // LINE_BYTES
        if not l1.access(line):
            l2.access(line)
    return [l1.counts, l2.counts]


def pycachesim(addresses, geometries):
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
    levels = list(simulator.stats())[: len(geometries)]
    return [{"accesses": of["HIT_count"] + of["MISS_count"], "misses": of["MISS_count"]} for of in levels]


def dinero(program, din):
    """What Dinero IV prints of the L1, with the split."""
    options = f"-l1-dsize {SIZES[0]} -l1-dassoc {WAYS} -l1-dbsize {LINE_BYTES} -l1-dccc -l1-drepl l -l1-dfetch d -informat d"
    out = execute(program, options, stdin=din).out
    number = lambda name: int(re.search(rf"^ *{name}\s+(\d+)", out, re.M).group(1))
    return {"accesses": number("Demand Fetches"), "misses": number("Demand Misses"),
            **{cause: number(f"{cause.capitalize()} misses") for cause in ("compulsory", "capacity", "conflict")}}


def counted(study, trace, machine):
    """Counts of each level by every other program."""
    order, din = study.options.order, study.work / "accesses.din"
    run = study.result(trace, order, "--mode functional", machine)
    study.replay("convert", trace, f"--to din --order {order} -o", din)
    with open(din) as lines:
        addresses = [int(line[2:], 16) for line in lines]
    lines = [size // LINE_BYTES for size in SIZES]
    full = pycachesim(addresses, [(1, lines[0])])
    others = {
        "replay run": [{"accesses": run[level]["line_lookups"], "misses": run[level]["line_misses"]} for level in ("l1", "l2")],
        "pycachesim": pycachesim(addresses, [(count // WAYS, WAYS) for count in lines]),
        "pycachesim, 1 set": [{"fully_associative_misses": full[0]["misses"]}],
        "twin": twin(addresses),
    }
    if study.options.dinero:
        others["Dinero IV"] = [dinero(study.options.dinero, din)]
    din.unlink()
    return others


def run(study):
    machine = f"--cores 1 --line {LINE_BYTES} --ways {WAYS} --l1 {SIZES[0]} --l2 {SIZES[1]}"
    differences = 0
    for trace in study.options.files:
        rows = study.json("locality", trace, "--orders", study.options.order, machine)["rows"]
        for other, levels in counted(study, trace, machine).items():
            for row, counts in zip(rows, levels):
                wrong = {key: (row[key], count) for key, count in counts.items() if row[key] != count}
                differences += len(wrong)
                said = f"differ: {wrong}" if wrong else f"{len(counts)} counts identical"
                print(f"{trace}, {row['stream']}, {other}: {said}", flush=True)
        for row in rows:
            print(f"{trace}, {row['stream']}: " + ", ".join(f"{key} {row[key]}" for key in KEYS), flush=True)
    return int(differences > 0)
