"""Measures tables of the documents again and prints which figures moved: `reproduce [STUDY...]`. The new files go to OUT/reproduce.

Scenes that are absent are skipped with a line. Exit code 1 if a figure moved, 3 if none could be measured.
"""

import importlib
import sys
from argparse import Namespace
from difflib import SequenceMatcher

from .common import Absent, Failed, Study, read_table

# Those whose figures are the same on every machine with the same Mesa. All of them take hours.
STUDIES = ["backends", "constants", "dram", "levels", "organisations", "paper", "policies", "prefetch", "ray-orders", "ray-sorts", "ray-trees", "sgrt", "shadow-formats", "shadow-orders", "temporal", "whole-frame"]
OPTIONS = {
    "studies": dict(nargs="*", metavar="STUDY", help=f"some of: {', '.join(STUDIES)} (all)"),
    "--tolerance": dict(type=float, default=0.001, help="relative difference that counts as equal (0.001)"),
}


def number(text):
    try:
        return float(text.strip().rstrip("%").replace(",", ""))
    except ValueError:
        return None


def differs(old, new, tolerance):
    a, b = number(old), number(new)
    if a is None or b is None:
        return old != new
    return abs(a - b) > tolerance * max(abs(a), abs(b))


def matched(old_rows, rows):
    """Pairs of rows. Where rows of absent scenes are left out, the first column tells which row is which."""
    if len(rows) == len(old_rows):
        return list(zip(old_rows, rows))
    keys = [[row[0] for row in table] for table in (old_rows, rows)]
    blocks = SequenceMatcher(None, *keys, autojunk=False).get_matching_blocks()
    return [(old_rows[block.a + i], rows[block.b + i]) for block in blocks for i in range(block.size)]


def moved(old_file, new_file, tolerance):
    """The figures that moved, a line each, how many were compared, and how many rows of the old file were not measured."""
    old_heading, *old_rows = read_table(old_file)
    heading, *rows = read_table(new_file)
    pairs = matched(old_rows, rows)
    if heading != old_heading or len(rows) != len(pairs):
        return [f"expected {len(old_rows)} rows of {old_heading}, found {len(rows)} of {heading}"], 0, 0
    lines = []
    for place, (old_row, row) in enumerate(pairs, 1):
        for column, old, new in zip(heading, old_row, row):
            if differs(old, new, tolerance):
                lines.append(f"row {place} ({', '.join(row[:2])}), {column}: {old} before, {new} now")
    return lines, len(rows) * len(heading), len(old_rows) - len(rows)


def measure(study, name, results):
    """Runs a study with its own settings and the folders of this one."""
    module = importlib.import_module(f".{name.replace('-', '_')}", __package__)
    settings = {flag.lstrip("-"): of["default"] for flag, of in getattr(module, "OPTIONS", {}).items()}
    options = Namespace(**{**vars(study.options), **settings, "results": results})
    work = study.work / name
    work.mkdir()
    module.run(Study(name, options, work))


def run(study):
    names = study.options.studies or STUDIES
    for name in names:
        if name not in STUDIES:
            raise Failed(f"expected some of: {', '.join(STUDIES)}; found '{name}'")
    for old in study.out.glob("*.csv"):
        old.unlink()
    for name in names:
        study.say(name)
        try:
            measure(study, name, study.out)
        except Absent as error:
            print(f"skipped: {name}: {error} is absent", file=sys.stderr)
    files, any_moved = sorted(study.out.glob("*.csv")), False
    if not files:
        print(f"{study.out}: no results")
        return 3
    for file in files:
        lines, cells, absent = moved(study.results / file.name, file, study.options.tolerance)
        any_moved |= bool(lines)
        print(f"{file.name}: {len(lines)} of {cells} cells moved" + (f", {absent} rows not measured" if absent else ""))
        for line in lines:
            print(f"  {line}")
    return int(any_moved)
