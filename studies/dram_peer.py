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
    """By device, channels, order of requests and timings: the ranges of all scenes and schedulers."""
    groups = {}
    for _, device, channels, order, timings, _, _, _, apart, _, _, distance, ours, theirs, *_ in rows:
        group = groups.setdefault((device, channels, order, timings), ([], [], []))
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
    same = [row for row in rows if row[3] == "hits first" and row[4] == "ours"]
    columns = [at for at in range(len(rows[0])) if at not in (3, 4)]
    names = heading.split(" | ")
    study.write("dram-closed-loop", detail, " | ".join(names[at] for at in columns), [[row[at] for at in columns] for row in same])
    study.write(
        "dram-closed-loop-causes", detail,
        "DRAM | channels | Ramulator's order of requests | timings | cycles apart, % | largest distance | row hits apart, points", causes(rows))
