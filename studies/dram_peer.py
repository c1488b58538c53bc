"""The DRAM model against Ramulator 1: on the same streams of requests, and in the closed loop of `replay schedule`. Needs a C++ compiler."""

import csv
import os
from pathlib import Path

from .common import CARGO, ROOT, execute, needs

SCENES = ["atrium", "jungle", "crytek-sponza"]
CAPTURE = "--size 480x540"


def peer(*traces):
    """The heading and the rows that the peer prints; it exits with 1 if a row is not within the limits of its test."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"), "peers")
    command = f"{CARGO} run --quiet --release --locked --manifest-path tests/peers/ramulator/Cargo.toml --target-dir"
    heading, *rows = csv.reader(execute(command, target, "--", *traces, folder=ROOT, allowed=(0, 1)).out.splitlines())
    return " | ".join(heading), rows


def causes(rows):
    """By memory, order of requests and timings: the ranges of all scenes and schedulers."""
    groups = {}
    for row in rows:
        _, *memory, _, _, _, apart, _, _, distance, ours, theirs, _, _ = row
        group = groups.setdefault(tuple(memory), ([], [], []))
        for of, value in zip(group, (float(apart), float(distance), float(ours) - float(theirs))):
            of.append(value)
    for key, (aparts, distances, hits) in groups.items():
        yield [*key, f"{min(aparts):.2f} to {max(aparts):.2f}", f"{max(distances):.3f}", f"{min(hits):.1f} to {max(hits):.1f}"]


def run(study):
    needs("c++")
    heading, rows = peer()
    study.write("dram-peer", "", heading, rows)
    traces = [study.raster(scene, CAPTURE) for scene in study.present(SCENES)]
    heading, rows = peer(*traces)
    study.drop(*traces)
    detail = f"tracegen raster SCENE {CAPTURE}"
    without_settings = lambda row: [*row[:3], *row[7:]]
    same = [without_settings(row) for row in rows if row[3:7] == ["32", "yes", "hits first", "ours"]]
    study.write("dram-closed-loop", detail, " | ".join(without_settings(heading.split(" | "))), same)
    study.write(
        "dram-closed-loop-causes", detail,
        "DRAM | channels | queue | writes | Ramulator's order of requests | timings | cycles apart, % | largest distance | row hits apart, points", causes(rows))
