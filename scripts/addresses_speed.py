#!/usr/bin/env python3
"""How fast `replay run --addresses` is: beside the plain loop of benches/plain_lru.rs and beside pycachesim.

    cargo build --release -p replay --benches --bins
    scripts/addresses_speed.py target/release/replay target/release/deps/plain_lru-HASH FILE.u32 [ROUNDS]

FILE holds 32-bit addresses (`replay convert TRACE --to u32`). Each program runs as a process of its own, in
turns, and its processor time counts (user and system). All must count the same misses: 8 KiB over 128 KiB,
4-way LRU, lines of 16 bytes. pycachesim (pip install pycachesim) is left out, with a line, where it is absent.
"""

import importlib.util
import json
import os
import re
import resource
import statistics
import subprocess
import sys

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


def run(command):
    """Output, and processor seconds: user alone, and with the system's."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    user = after.ru_utime - before.ru_utime
    return output, user, user + after.ru_stime - before.ru_stime


def replay_misses(output):
    point = json.loads(output)["points"][0]
    return point["l1"]["line_misses"], point["l2"]["line_misses"]


def loop_misses(output):
    return tuple(int(n) for n in re.findall(r"(\d+) L[12] misses", output))


def main():
    replay, loop, path = sys.argv[1:4]
    rounds = int(sys.argv[4]) if len(sys.argv) > 4 else 11
    accesses = os.path.getsize(path) // 4
    asked = ["--l1", "8KiB", "--l2", "128KiB", "--ways", "4", "--line", "16"]
    programs = {
        "plain loop": ([loop, path, "16"], loop_misses),
        "replay": ([replay, "-q", "run", "--addresses", path, "--json", *asked], replay_misses),
    }
    times = {name: [] for name in programs}
    counts = {}
    for _ in range(rounds):
        for name, (command, misses) in programs.items():
            output, user, both = run(command)
            times[name].append((user, both))
            counts.setdefault(misses(output), set()).add(name)
    if importlib.util.find_spec("cachesim") is None:
        print("skipped: pycachesim is absent")
    else:
        output, user, both = run([sys.executable, "-c", PYCACHESIM, path, "simulate"])
        counts.setdefault(tuple(int(n) for n in output.split()), set()).add("pycachesim")
        times["pycachesim"] = [(user, both)]
        times["Python alone"] = [run([sys.executable, "-c", PYCACHESIM, path, "idle"])[1:]]
    print(f"{accesses} accesses, misses of L1 and L2: {list(counts)}")
    for name, runs in times.items():
        user, both = (statistics.median(column) for column in zip(*runs))
        best = min(both for _, both in runs)
        rate = accesses / both / 1e6
        print(f"{name:14} user {user:.3f} s, with system {both:.3f} s (best {best:.3f}), {rate:7.1f} M/s")
    ratios = [a[1] / b[1] for a, b in zip(times["replay"], times["plain loop"])]
    print(f"replay over plain loop, round by round: median {statistics.median(ratios):.2f}")
    if "pycachesim" in times:
        own = statistics.median(both for _, both in times["replay"])
        whole = times["pycachesim"][0][1]
        core = whole - times["Python alone"][0][1]
        print(f"pycachesim over replay: {whole / own:.1f}; without Python's own part {core / own:.1f}")
    if len(counts) != 1:
        sys.exit(f"the counts differ: {counts}")


main()
