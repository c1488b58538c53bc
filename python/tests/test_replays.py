"""Replays, orders and policies against the program and against each other."""

import io
import json

import numpy as np
import pandas as pd
import parallax_traces as plx
import pytest
from lru import LRU

SMALL = {"mode": "functional", "l1.size_bytes": "4KiB", "l2.size_bytes": "32KiB"}
COUNTS = ["footprints", "l1_footprint_miss_pct", "l2_line_miss_pct", "external_bytes", "unique_lines"]


def counts(frame):
    return frame[[key for key in COUNTS if key in frame]].to_dict("records")


@pytest.mark.parametrize("order", ["morton", "z2-sta"])
@pytest.mark.parametrize("mode", ["functional", "timed"])
def test_run_has_the_figures_of_the_program(atrium, replay, order, mode):
    frame = plx.run(atrium, {"mode": mode, "order": order})
    printed = json.loads(
        replay("run", atrium, "--json", "--mode", mode, "--order", order).stdout
    )
    result = plx.result(atrium, {"mode": mode}, order=order)
    assert result == printed
    row = frame.iloc[0]
    assert len(frame) == 1 and row["order"] == order
    assert row["checksum"] == printed["trace"]["checksum"]
    assert row["external_bytes"] == printed["result"]["external_bytes"]
    assert row["l1_footprint_miss_pct"] == pytest.approx(100 * printed["result"]["l1"]["footprint_misses"]
                                               / printed["result"]["l1"]["footprints"], rel=1e-12)
    if mode == "timed":
        assert row["cycles"] == printed["result"]["cycles"]


def test_sweep_has_the_rows_of_the_program(atrium, traces, replay, tmp_path):
    text = """
[base]
mode = "functional"
[axes]
order = ["morton", "z2-sta"]
l1.size_bytes = ["4KiB", "8KiB"]
[one-at-a-time]
layout.block_order = ["morton"]
"""
    file = tmp_path / "experiment.toml"
    file.write_text(text)
    both = [atrium, traces / "jungle.textrace"]
    frame = plx.sweep(file, both)
    replay("sweep", file, *both, "--out", tmp_path / "out")
    printed = pd.read_csv(tmp_path / "out/results.csv")
    assert list(printed.columns) == [*frame.columns]
    assert len(frame) == len(printed) == 16
    for key in frame.columns:
        if frame[key].dtype.kind in "iuf":
            assert np.allclose(frame[key], printed[key], rtol=1e-12, atol=0, equal_nan=True), key
    as_dict = {
        "base": {"mode": "functional"},
        "axes": {"order": ("morton", "z2-sta"), "l1.size_bytes": ["4KiB", 8192]},
        "one-at-a-time": {"layout": {"block_order": ["morton"]}},
    }
    assert plx.sweep(as_dict, both).equals(frame)
    assert frame.attrs["columns"]["l1_footprint_miss_pct"]["unit"] == "% of footprints"


def test_reproject_has_the_rows_of_the_program(traces, replay):
    path = traces / "teapot-rays.raytrace"
    for options, flags in [
        ({}, []),
        ({"rule": "none", "reuse": "primary"}, ["--rule", "none", "--reuse", "primary"]),
        ({"preset": "sgrt-paper"}, ["--preset", "sgrt-paper"]),
    ]:
        frame = plx.reproject(path, **options)
        printed = pd.read_csv(io.BytesIO(replay("reproject", path, "--csv", *flags).stdout))
        assert list(printed.columns) == list(frame.columns) and len(frame) == len(printed)
        for key in frame.columns:
            if frame[key].dtype.kind in "iuf":
                assert np.allclose(frame[key], printed[key], rtol=1e-12, atol=0, equal_nan=True), key
    slow = plx.reproject(path, config={"tni": {"units": 1}})
    assert not slow.equals(plx.reproject(path))


@pytest.mark.parametrize(
    "order",
    ["morton", "hilbert", "z2-lrta", "z2-sta", "z2-sta-merge", "adaptive+sta+offset", "zig-zag+merge+row-primitives"],
)
def test_a_list_counts_what_the_order_that_it_lists_counts(atrium, order):
    named = plx.run(atrium, SMALL, order=order)
    # Bands of adaptive orders depend on the size of the L2.
    listed = plx.run(atrium, SMALL, order=plx.order_items(atrium, order, SMALL))
    assert listed["order"][0].startswith("list@")
    assert counts(listed) == counts(named)
    timed = {"l1.size_bytes": "4KiB"}
    listed = plx.run(atrium, timed, order=plx.order_items(atrium, order, timed))
    assert listed["cycles"][0] == plx.run(atrium, timed, order=order)["cycles"][0]


def scanline(grid):
    return [(eye, x, y) for eye in range(grid.eyes) for y in range(grid.height) for x in range(grid.width)]


def test_orders_are_functions_lists_and_arrays(atrium):
    named = counts(plx.run(atrium, SMALL, order="scanline"))
    frame = plx.run(atrium, SMALL, order=scanline)
    assert frame["order"][0].startswith("scanline@")
    assert counts(frame) == named
    grid = plx.Grid(15, 17, 2, 0, 0)
    assert counts(plx.run(atrium, SMALL, order=np.array(scanline(grid)))) == named
    pairs = [((0, x, y), (1, x, y)) for y in range(17) for x in range(15)]
    both = plx.run(atrium, SMALL, order=pairs)
    assert both["external_bytes"][0] < named[0]["external_bytes"]
    assert counts(plx.run(atrium, SMALL, order=np.array(pairs))) == counts(both)
    frame = plx.sweep({"base": SMALL, "axes": {"order": ["scanline", scanline, pairs]}}, atrium)
    assert counts(frame) == [named[0], named[0], *counts(both)]


def test_an_order_gets_the_grid_of_the_tile_size(atrium):
    grids = []

    def order(grid):
        grids.append((grid.width, grid.height, grid.eyes))
        return scanline(grid)

    large = {**SMALL, "tile_px": 32}
    assert counts(plx.run(atrium, large, order=order)) == counts(
        plx.run(atrium, large, order="scanline")
    )
    assert grids == [(8, 9, 2)]


def test_a_changed_list_is_another_order(atrium):
    first = plx.run(atrium, SMALL, order=scanline)
    other = plx.run(atrium, SMALL, order=plx.order_items(atrium, "random"))
    again = plx.run(atrium, SMALL, order=scanline)
    assert first["order"][0] == again["order"][0] != other["order"][0]
    assert counts(first) == counts(again) != counts(other)


@pytest.mark.parametrize("mode", ["functional", "timed"])
def test_lru_in_python_counts_what_lru_counts(atrium, mode):
    config = {**SMALL, "mode": mode}
    own = plx.run(atrium, config, policy=LRU)
    assert own["l1_replacement"][0] == own["l2_replacement"][0] == "LRU@python"
    builtin = plx.run(atrium, config)
    assert counts(own) == counts(builtin)
    if mode == "timed":
        assert own["cycles"][0] == builtin["cycles"][0]
    only_l2 = plx.run(atrium, {**config, "l2.replacement": LRU})
    assert only_l2["l1_replacement"][0] == "lru" and counts(only_l2) == counts(builtin)


def test_policies_are_an_axis(atrium):
    class Last(LRU):
        def victim(self, set):
            return self.used[set][-1]

    frame = plx.sweep(
        {"base": SMALL, "axes": {"l1.replacement": ["lru", LRU, Last]}}, atrium
    )
    assert counts(frame)[0] == counts(frame)[1] != counts(frame)[2]
