"""Tables and arrays against the independent readers and the program."""

import io
import json
import subprocess
import sys

import numpy as np
import pandas as pd
import parallax_traces as plx
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from conftest import ROOT

# The others are compared with `replay dump`, which tests/tests/independent.rs compares with the readers: these are slow.
TEXTRACES = ["atrium", "atrium-shadows"]
RAYTRACES = ["teapot-rays"]


def independent(path, *options):
    """The rows of a trace as the reader written from FORMAT.md alone prints them."""
    script = ROOT / "tests/independent" / f"{path.suffix[1:]}.py"
    command = [sys.executable, "-B", script, path, *options]
    output = subprocess.run(command, check=True, capture_output=True).stdout
    return [json.loads(line) for line in output.splitlines()[1:]]


@pytest.mark.parametrize("name", TEXTRACES)
def test_records_are_those_of_the_independent_reader(traces, name):
    path = traces / f"{name}.textrace"
    rows = independent(path)
    table = plx.read_textrace(path)
    assert table.num_rows == len(rows) > 10_000
    expected = {}
    for key in ["pass", "tile", "draw", "primitive", "x", "y", "mask"]:
        expected[key] = [row[key] for row in rows]
    expected["group"] = [15 if row["group"] is None else row["group"] for row in rows]
    for key in ["uv", "dx", "dy", "cross"]:
        for axis, letter in enumerate("uv"):
            expected[f"{key}_{letter}"] = [row[key][axis] for row in rows]
    assert table.column_names == list(expected)
    for key, values in expected.items():
        assert np.array_equal(table[key].to_numpy(), values), key


@pytest.mark.parametrize("name", RAYTRACES)
def test_rays_and_samples_are_those_of_the_independent_reader(traces, name):
    path = traces / f"{name}.raytrace"
    samples = independent(path)
    table = plx.read_raytrace(path)
    place = ["eye", "tile", "x", "y", "sample"]
    of_ray = ["kind", "outcome", "depth", "parent", "steps", "triangle_tests", "alpha_tests"]
    rays = [(s, n, ray) for s in samples for n, ray in enumerate(s["rays"])]
    assert table.num_rows == len(rays) > len(samples) > 10_000
    for key in place:
        assert table[key].to_pylist() == [s[key] for s, _, _ in rays], key
    assert table["ray"].to_pylist() == [n for _, n, _ in rays]
    for key in of_ray:
        values = [ray[key] for _, _, ray in rays]
        values = [4294967295 if value is None else value for value in values]
        assert table[key].to_pylist() == values, key
    assert table.column_names == [*place, "ray", *of_ray]

    table = plx.read_raytrace(path, rows="samples")
    assert table.num_rows == len(samples)
    hits = [s["hit"] for s in samples]
    assert table["hit"].to_pylist() == [int(hit is not None) for hit in hits]
    for key in ["primitive", "object", "material"]:
        values = [4294967295 if hit is None else hit[key] for hit in hits]
        assert table[key].to_pylist() == values, key
    vectors = {"position": "xyz", "geometric_normal": "xyz", "shading_normal": "xyz", "uv": "uv"}
    for key, letters in vectors.items():
        for axis, letter in enumerate(letters):
            values = [np.nan if hit is None else hit[key][axis] for hit in hits]
            found = table[f"{key}_{letter}"].to_numpy()
            # FORMAT.md leaves the rounding of the geometric normal open.
            tolerance = 1e-6 if key == "geometric_normal" else 0
            assert np.allclose(
                found, np.array(values, np.float32), rtol=0, atol=tolerance, equal_nan=True
            ), key
    for key in ["view_independent", "view_dependent"]:
        for axis, letter in enumerate("rgb"):
            values = np.array([s[key][axis] for s in samples], np.float32)
            assert np.array_equal(table[f"{key}_{letter}"].to_numpy(), values), key
    assert table["rays"].to_pylist() == [len(s["rays"]) for s in samples]


@pytest.mark.parametrize("tree", ["bvh2", "bvh4", "bvh8", "cwbvh8"])
def test_columns_are_those_of_the_independent_reader(tmp_path, tree):
    path = tmp_path / "columns.raytrace"
    path.write_bytes((ROOT / f"fuzz/corpus/raytrace/columns-{tree}").read_bytes())
    rays = [ray for sample in independent(path) for ray in sample["rays"]]
    table = plx.read_raytrace(path)
    assert table.num_rows == len(rays) > 20
    for key in ["origin", "direction"]:
        for axis, letter in enumerate("xyz"):
            values = np.array([ray[key][axis] for ray in rays], np.float32)
            assert np.array_equal(table[f"{key}_{letter}"].to_numpy(), values), key
    for key in ["t_min", "t_max", "t"]:
        values = np.array([np.nan if ray[key] is None else ray[key] for ray in rays], np.float32)
        assert np.array_equal(table[key].to_numpy(), values, equal_nan=True), key
    slots = [4294967295 if ray["slot"] is None else ray["slot"] for ray in rays]
    assert table["slot"].to_pylist() == slots
    assert table["stack_depth"].to_pylist() == [ray["stack_depth"] for ray in rays]

    visits = plx.read_raytrace(path, rows="visits")
    of_rays = [visit for ray in rays for visit in ray["visits"]]
    assert visits["address"].to_pylist() == [visit["address"] for visit in of_rays]

    nodes = independent(path, "--nodes")
    children = [
        (node["node"], number, child.get("node", child.get("slot")), *child["min"], *child["max"])
        for node in nodes
        for number, child in enumerate(node["children"])
        if child
    ]
    table = plx.read_raytrace(path, rows="nodes")
    names = ["node", "child", "index"]
    names += [f"{corner}_{letter}" for corner in ["min", "max"] for letter in "xyz"]
    assert list(zip(*(table[name].to_pylist() for name in names))) == children

    table = plx.read_raytrace(path, rows="slots")
    rows = independent(path, "--slots")
    assert table["primitive"].to_pylist() == [row["primitive"] for row in rows]
    assert table["masked"].to_pylist() == [int(row["masked"]) for row in rows]
    for vertex in range(3):
        for axis, letter in enumerate("xyz"):
            values = [row["vertices"][vertex][axis] for row in rows]
            assert table[f"v{vertex}_{letter}"].to_pylist() == values


def test_rows_that_a_trace_lacks_are_refused(traces):
    for rows, text in [("visits", "with visits"), ("nodes", "content of its hierarchy")]:
        with pytest.raises(plx.ParallaxError, match=text):
            plx.read_raytrace(traces / "teapot-rays.raytrace", rows=rows)


@pytest.mark.parametrize(
    ("name", "options", "rows"),
    [
        ("atrium.textrace", [], None),
        ("jungle.textrace", [], None),
        ("teapot-rays.raytrace", [], "rays"),
        ("teapot-rays.raytrace", ["--samples"], "samples"),
        ("chess-rays.raytrace", [], "rays"),
        ("chess-rays.raytrace", ["--samples"], "samples"),
    ],
)
def test_dump_writes_the_same_columns_as_parquet(traces, replay, tmp_path, name, options, rows):
    path = tmp_path / "rows.parquet"
    replay("dump", traces / name, "--parquet", path, *options)
    of = plx.read_textrace if rows is None else plx.read_raytrace
    table = of(traces / name, *([rows] if rows else []))
    dumped = pq.read_table(path)
    assert dumped.column_names == table.column_names
    for key in table.column_names:
        values = table[key]
        if isinstance(values.type, pa.DictionaryType):
            values = values.cast(pa.string())
        assert dumped[key].type == values.type, key
        if pa.types.is_floating(values.type):  # NaN differs from itself
            assert np.array_equal(dumped[key].to_numpy(), values.to_numpy(), equal_nan=True), key
        else:
            assert dumped[key].equals(values), key


def test_convert_writes_the_records_and_the_accesses_of_csv(traces, replay, atrium):
    table = plx.read_textrace(atrium)
    records = np.load(
        io.BytesIO(replay("convert", atrium, "--to", "npy", "--granularity", "record").stdout)
    )
    assert list(records.dtype.names) == table.column_names
    for key in table.column_names:
        assert np.array_equal(records[key], table[key].to_numpy()), key
    dumped = replay("dump", atrium, "--parquet", "-").stdout
    assert replay("convert", atrium, "--to", "parquet", "--granularity", "record").stdout == dumped

    options = ["--order", "z2-sta", "--granularity", "texel", "--filter", "nearest"]
    csv = replay("convert", atrium, "--to", "csv", *options).stdout
    csv = pd.read_csv(io.BytesIO(csv), converters={"address": lambda text: int(text, 16)})
    array = np.load(io.BytesIO(replay("convert", atrium, "--to", "npy", *options).stdout))
    rows = pq.read_table(
        pa.BufferReader(replay("convert", atrium, "--to", "parquet", *options).stdout)
    )
    assert list(array.dtype.names) == list(csv.columns) == rows.column_names
    for key in csv.columns:
        assert np.array_equal(array[key], csv[key]), key
        assert np.array_equal(rows[key].to_numpy(), csv[key]), key


def test_lines_on_one_core_are_those_of_convert(replay, atrium):
    for order in ["morton", "z2-sta", "z2-lrta"]:
        lines = plx.lines(atrium, order, {"cores": 1})
        csv = replay("convert", atrium, "--to", "npy", "--order", order).stdout
        expected = np.load(io.BytesIO(csv))
        for key in ["address", "pass", "tile", "texture", "level"]:
            same = lines[key] == (
                expected[key] // 16 * 16 if key == "address" else expected[key]
            )
            assert len(lines[key]) == len(expected) and same.all(), (order, key)
        assert np.array_equal(lines["eye"], expected["pass"])  # passes 0 and 1 are the eyes
        assert not lines["core"].any()


def test_lines_follow_the_settings(atrium, traces):
    usual = plx.lines(atrium, "z2-lrta")
    assert set(np.unique(usual["core"])) == {0, 1}
    assert np.array_equal(
        np.sort(usual["address"]), np.sort(plx.lines(atrium, "random")["address"])
    )
    coarse = plx.lines(atrium, "z2-lrta", {"line_bytes": 64})
    assert not (coarse["address"] % 64).any()
    assert len(coarse["address"]) < len(usual["address"])
    shadows = plx.lines(traces / "atrium-shadows.textrace")
    assert set(np.unique(shadows["eye"])) <= set(plx.EYES)


def test_columns_own_the_memory_of_the_decoder(atrium):
    table = plx.read_textrace(atrium)
    array = table["uv_u"].to_numpy()
    address = table["uv_u"].chunk(0).buffers()[1].address
    assert array.__array_interface__["data"][0] == address


def test_info_is_that_of_the_program(replay, atrium, traces):
    for path in [atrium, traces / "teapot-rays.raytrace"]:
        assert plx.info(path) == json.loads(replay("info", "--json", path).stdout)
