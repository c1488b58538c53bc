"""Compares results files: `reproduce.py OLD NEW TOLERANCE` prints each figure of NEW that differs from OLD's by more than a share."""
import csv
import sys
from difflib import SequenceMatcher
from pathlib import Path


def read(file):
    with open(file, newline="") as lines:
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return rows[0], rows[1:]


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
    old_heading, old_rows = read(old_file)
    heading, rows = read(new_file)
    pairs = matched(old_rows, rows)
    if heading != old_heading or len(rows) != len(pairs):
        return [f"expected {len(old_rows)} rows of {old_heading}, found {len(rows)} of {heading}"], 0, 0
    lines = []
    for place, (old_row, row) in enumerate(pairs, 1):
        for column, old, new in zip(heading, old_row, row):
            if differs(old, new, tolerance):
                lines.append(f"row {place} ({', '.join(row[:2])}), {column}: {old} before, {new} now")
    return lines, len(rows) * len(heading), len(old_rows) - len(rows)


def main():
    old, new, tolerance = Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])
    files = sorted(new.glob("*.csv"))
    if not files:
        print(f"{new}: no results")
        sys.exit(3)
    any_moved = False
    for file in files:
        lines, cells, absent = moved(old / file.name, file, tolerance)
        any_moved |= bool(lines)
        print(f"{file.name}: {len(lines)} of {cells} cells moved" + (f", {absent} rows not measured" if absent else ""))
        for line in lines:
            print(f"  {line}")
    sys.exit(int(any_moved))


main()
