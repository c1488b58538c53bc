"""How fast `replay run --addresses` is: beside the plain loop of benches/plain_lru.rs and beside pycachesim. Prints; writes no table.

Each program runs as a process of its own, in turns, and its processor time counts (user and system). All must count the same misses: 8 KiB over
128 KiB, 4-way LRU, lines of 16 bytes. pycachesim (pip install pycachesim) is left out, with a line, where it is absent.
"""

import importlib.util
import json
import re
import statistics
import sys
from pathlib import Path

from .common import Failed, bench, execute

OPTIONS = {
    "file": dict(type=Path, help="32-bit addresses (`replay convert TRACE --to u32`)"),
    "--rounds": dict(type=int, default=11, help="how often each program runs (11)"),
}
# Runs in a process of its own. `idle` goes through the same addresses without a cache, which shows
# what of the time is Python's.
PYCACHESIM = """
import array, collections, sys
addresses = array.array("I")
with open(sys.argv[1], "rb") as file:
    addresses.frombytes(file.read())
if sys.argv[2] == "idle":
    collections.deque(addresses, maxlen=0)
else:
    from cachesim import Cache, CacheSimulator, MainMemory
    memory = MainMemory()
    l2 = Cache("L2", 2048, 4, 16, "LRU")
    l1 = Cache("L1", 128, 4, 16, "LRU", store_to=l2, load_from=l2)
    memory.load_to(l2)
    memory.store_from(l2)
    CacheSimulator(l1, memory).load(addresses)
    print(l1.stats()["MISS_count"], l2.stats()["MISS_count"])
"""


def replay_misses(output):
    point = json.loads(output)["points"][0]
    return [point[level]["line_misses"] for level in ("l1", "l2")]


def loop_misses(output):
    return re.findall(r"(\d+) L[12] misses", output)


def run(study):
    path = study.options.file
    accesses = path.stat().st_size // 4
    script = study.work / "pycachesim.py"
    script.write_text(PYCACHESIM)
    pycachesim = lambda part: execute(Path(sys.executable), script, path, part)
    programs = {
        "plain loop": (bench("replay", "plain_lru"), path, 16),
        "replay": (study.bin / "replay", "-q run --json --l1 8KiB --l2 128KiB --ways 4 --line 16 --addresses", path),
    }
    runs = {name: [] for name in programs}
    for _ in range(study.options.rounds):
        for name, command in programs.items():
            runs[name].append(execute(*command))
    misses = {"plain loop": loop_misses, "replay": replay_misses}
    if importlib.util.find_spec("cachesim") is None:
        print("skipped: pycachesim is absent")
    else:
        runs["pycachesim"], misses["pycachesim"] = [pycachesim("simulate")], str.split
        runs["Python alone"] = [pycachesim("idle")]
    counts = {name: {tuple(map(int, of(done.out))) for done in runs[name]} for name, of in misses.items()}
    print(f"{accesses} accesses, misses of L1 and L2: {list(set.union(*counts.values()))}")
    seconds = {name: statistics.median(done.processor_s for done in of) for name, of in runs.items()}
    for name, of in runs.items():
        user, best = statistics.median(done.user_s for done in of), min(done.processor_s for done in of)
        print(f"{name:14} user {user:.3f} s, with system {seconds[name]:.3f} s (best {best:.3f}), {accesses / seconds[name] / 1e6:7.1f} M/s")
    ratios = [a.processor_s / b.processor_s for a, b in zip(runs["replay"], runs["plain loop"])]
    print(f"replay over plain loop, round by round: median {statistics.median(ratios):.2f}")
    if "pycachesim" in runs:
        whole = seconds["pycachesim"]
        print(f"pycachesim over replay: {whole / seconds['replay']:.1f}; "
              f"without Python's own part {(whole - seconds['Python alone']) / seconds['replay']:.1f}")
    if len(set.union(*counts.values())) != 1:
        raise Failed(f"the counts differ: {counts}")
