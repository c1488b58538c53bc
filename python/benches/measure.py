"""Measures the Python package on a texture trace and writes results/python.csv.

    python measure.py TRACE [CSV]

TRACE is Crytek Sponza in the documents (docs/use/real-scenes.md). Each figure is the median of five calls in one
process, after a first one; the policy in Python is called once.
"""

import statistics
import sys
import time
from pathlib import Path

import parallax_traces as plx

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from lru import LRU

RUNS = 5


def once(call):
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def median(call):
    _, result = once(call)
    return statistics.median(once(call)[0] for _ in range(RUNS)), result


def main(trace, target):
    functional = {"mode": "functional", "order": "z2-sta"}
    read_s, records = median(lambda: plx.read_textrace(trace))
    lines_s, lines = median(lambda: plx.lines(trace, "z2-sta"))
    run_s, built_in = median(lambda: plx.run(trace, functional))
    own_s, own = once(lambda: plx.run(trace, functional, policy=LRU))
    assert own["external_bytes"][0] == built_in["external_bytes"][0]
    lookups = len(lines["address"])
    rows = [
        ("read_textrace(trace)", "records", records.num_rows, read_s),
        ('lines(trace, "z2-sta")', "look-ups", lookups, lines_s),
        ("run(trace, functional)", "look-ups", lookups, run_s),
        ("the same, LRU in Python", "look-ups", lookups, own_s),
    ]
    text = "# command: python3 python/benches/measure.py crytek.textrace\n"
    text += "call,what,number,seconds,million per second\n"
    for call, what, number, seconds in rows:
        call = f'"{call.replace(chr(34), chr(34) * 2)}"'
        text += f"{call},{what},{number},{seconds:.2f},{number / seconds / 1e6:.1f}\n"
    Path(target).write_text(text)
    print(text, end="")
    print(f"A policy in Python takes {own_s / run_s:.0f} times as long.")


if __name__ == "__main__":
    default = Path(__file__).resolve().parents[2] / "results/python.csv"
    main(sys.argv[1], *(sys.argv[2:] or [default]))
