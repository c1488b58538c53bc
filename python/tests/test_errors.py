"""Every wrong input is an exception with the text of the command line."""

import signal
import subprocess
import sys
import textwrap

import numpy as np
import parallax_traces as plx
import pytest
from parallax_traces import ParallaxError
from test_replays import LRU, SMALL, scanline


def refused(match, call, *arguments, **options):
    with pytest.raises(ParallaxError) as caught:
        call(*arguments, **options)
    text = str(caught.value)
    assert match in text, text
    assert "internal error" not in text
    return text


def printed(replay, *arguments):
    """The program's error."""
    process = replay(*arguments, check=False)
    assert process.returncode == 2
    return process.stderr.decode().removeprefix("error: ").strip()


def test_files_that_are_no_traces(atrium, traces, tmp_path, replay):
    cut = tmp_path / "cut.textrace"
    cut.write_bytes(atrium.read_bytes()[:100_000])
    damaged = bytearray(atrium.read_bytes())
    damaged[200_000] ^= 1
    broken = tmp_path / "broken.textrace"
    broken.write_bytes(damaged)
    empty = tmp_path / "empty.textrace"
    empty.write_bytes(b"")
    for path in [tmp_path / "none.textrace", tmp_path, cut, broken, empty]:
        expected = printed(replay, "run", path)
        for call in [plx.read_textrace, plx.lines, plx.run, plx.result]:
            assert refused(str(path), call, path) == expected
    rays = traces / "teapot-rays.raytrace"
    assert refused("textrace", plx.run, rays) == printed(replay, "run", rays)
    refused("raytrace", plx.read_raytrace, atrium)
    assert refused("raytrace", plx.reproject, atrium) == printed(replay, "reproject", atrium)
    refused("rows: expected rays, samples, visits, nodes or slots", plx.read_raytrace, rays, "pixels")
    for wrong in [None, 7, b"bytes", [atrium]]:
        refused("path: expected a path, found", plx.read_textrace, wrong)
    refused("trace: expected a path, found NoneType", plx.run, [None])
    assert issubclass(ParallaxError, ValueError)


@pytest.mark.parametrize(
    ("config", "match"),
    [
        ({"l1.size_byte": 1}, "config: `l1.size_byte`: unknown field `size_byte`"),
        ({"cache": {"l1": 1}}, "config: `cache.l1`: unknown field `cache`"),
        ({"mode": "fast"}, "config: `mode`: unknown variant `fast`"),
        ({"order": "mortn"}, "config: `order`"),
        ({"l1.size_bytes": 6 << 10}, "expected a power-of-two number of sets"),
        ({"l1.size_bytes": -1}, "config: `l1.size_bytes`"),
        ({"l1.size_bytes": 1 << 80}, "config"),
        ({"l1.size_bytes": 1 << 62}, "L1 cache"),
        ({"cores": 10**6}, "cores: expected 1 to 64, found 1000000"),
        ({"sampling.lod_bias": float("nan")}, "sampling.lod_bias"),
        ({"cores": None}, "config: `cores`: expected text, a number or a list, found NoneType"),
        ({"cores": {1, 2}}, "config: `cores`: expected text, a number or a list, found set"),
        ({7: 1}, "config: expected text as keys, found 7"),
        ({"a\nb": 1}, "config: `a\nb`"),
        ({"cores": 1, "l1": {"ways": 4, "way": 4}}, "config: `l1.way`: unknown field"),
        (["mode"], "config: expected a dict or a path, found list"),
        ({"l1.replacement": 7}, "policy: expected a name or a class, found"),
    ],
)
def test_settings_that_are_none(atrium, config, match):
    refused(match, plx.run, atrium, config)


def test_settings_in_files_have_the_errors_of_the_program(atrium, replay, tmp_path):
    file = tmp_path / "machine.toml"
    for text in ["cores = 1\ncore = 2", "cores = ", "[l1]\nways = 0", "\udcff"]:
        file.write_bytes(text.encode("utf-8", "surrogateescape"))
        expected = printed(replay, "run", atrium, "--config", file)
        assert refused("", plx.run, atrium, file) == expected
    absent = tmp_path / "absent.toml"
    expected = printed(replay, "run", atrium, "--config", absent)
    assert refused("absent.toml", plx.run, atrium, absent) == expected
    file.write_text("mode = 'functional'\ncores = 1")
    assert plx.run(atrium, file, order="z2-sta")["cores"][0] == 1


def test_no_traces_are_an_error():
    for call in [plx.run, plx.orders, lambda none: plx.sweep({"base": {}}, none)]:
        refused("traces: expected at least one, found none", call, [])


def test_sweeps_that_are_none(atrium):
    refused("traces: expected at least one, found none", plx.sweep, {"base": {}})
    refused("experiment: `bas`: unknown key", plx.sweep, {"bas": {"cores": 1}}, atrium)
    axes = {"axes": {"seed": range(10**6)}}
    refused("expected at most 100000 values, found 1000000", plx.sweep, axes, atrium)
    refused("experiment: expected a dict or a path", plx.sweep, 7, atrium)


ITEMS = scanline(plx.Grid(15, 17, 2, 0, 0))


@pytest.mark.parametrize(
    ("order", "match"),
    [
        ("mortn", "did you mean `morton`?"),
        ("z2-sta+sta", "order: "),
        ([], "item 0: expected every tile of both passes, found 510 tiles not listed"),
        (ITEMS[:-1], "item 509: expected every tile of both passes, found 1 tiles not listed"),
        ([*ITEMS, (1, 3, 4)], "item 510: expected a tile of these passes that was not listed yet, found (1, 3, 4)"),
        ([ITEMS[0], *ITEMS], "item 1: expected a tile of these passes that was not listed yet, found (0, 0, 0)"),
        ([(0, 15, 0)], "list: item 0: expected an eye of 0 or 1, a column below 15 and a row below 17, found (0, 15, 0)"),
        ([(2, 0, 0)], "list: item 0: expected an eye of 0 or 1"),
        ([(0, -1, 0)], "list: item 0: expected (eye, column, row) or two of them, found (0, -1, 0)"),
        ([(0, 1 << 40, 0)], "list: item 0: expected (eye, column, row)"),
        ([(0, 0.5, 0)], "list: item 0: expected (eye, column, row)"),
        ([7], "list: item 0: expected (eye, column, row) or two of them, found 7"),
        ([((0, 0, 0), (1, 0, 0), "halves")], "expected alternate or merge, found \"halves\""),
        (7, "list: expected a sequence of tiles, found int"),
        (lambda grid: None, "expected a sequence of tiles, found NoneType"),
        (lambda grid: "morton", "expected a sequence of tiles, found str"),
        (np.zeros((3, 2)), "list: item 0: expected (eye, column, row)"),
    ],
)
def test_orders_that_are_none(atrium, order, match):
    refused(match, plx.run, atrium, SMALL, order=order)
    refused(match, plx.lines, atrium, order)


def test_orders_of_other_traces(atrium, traces):
    name = plx.run(atrium, SMALL, order=scanline)["order"][0]
    refused("expected", plx.run, traces / "jungle.textrace", SMALL, order=name)
    refused("expected", plx.run, atrium, {**SMALL, "tile_px": 32}, order=name)
    both = [atrium, traces / "jungle.textrace"]
    refused("expected one trace for an order that is not named, found 2", plx.run, both, order=scanline)
    refused("expected", plx.sweep, {"base": {**SMALL, "order": scanline}, "axes": {"tile_px": [32]}}, atrium)


def test_exceptions_of_orders_and_policies_pass_through(atrium):
    def order(grid):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        plx.run(atrium, SMALL, order=order)

    class Raises(LRU):
        def victim(self, set):
            raise LookupError("no way")

    with pytest.raises(LookupError, match="no way"):
        plx.run(atrium, SMALL, policy=Raises)

    class NoArguments:
        pass

    with pytest.raises(TypeError):
        plx.run(atrium, SMALL, policy=NoArguments)

    class NoMethods:
        def __init__(self, sets, ways):
            pass

    with pytest.raises(AttributeError, match="hit"):
        plx.run(atrium, SMALL, policy=NoMethods)
    # A class that failed does not spoil the next replay.
    assert plx.run(atrium, SMALL, policy=LRU)["l1_footprint_miss_pct"][0] > 0


@pytest.mark.parametrize("way", [4, -1, None, "0", 1 << 70, 0.5])
def test_ways_that_are_none(atrium, way):
    class Bad(LRU):
        def victim(self, set):
            return way

    text = refused("expected a way from 0 to 3, found", plx.run, atrium, SMALL, policy=Bad)
    assert text.startswith("Bad@python: victim(") and text.endswith(f"found {way!r}")


def test_policies_that_are_none(atrium):
    refused("policy: expected a name of a policy, found `mru`", plx.run, atrium, SMALL, policy="mru")
    other = type("LRU", (LRU,), {})
    two = {**SMALL, "l1.replacement": LRU, "l2.replacement": other}
    refused("policy: two classes are named LRU", plx.run, atrium, two)


def test_reprojections_that_are_none(traces, replay):
    path = traces / "teapot-rays.raytrace"
    refused("tni.units", plx.reproject, path, config={"tni": {"units": 0}})
    refused("unit", plx.reproject, path, config={"tni": {"unit": 1}})
    refused("--rule", plx.reproject, path, rule="sometimes")
    refused("--preset", plx.reproject, path, preset="sgrt")
    refused("traces: expected at least one, found none", plx.reproject, [])


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT")
def test_ctrl_c_ends_a_long_replay(atrium):
    code = f"""
        import parallax_traces as plx, signal
        # A parent that runs in the background may have left SIGINT ignored.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        class Slow:
            def __init__(self, sets, ways): pass
            def hit(self, set, way, line): sum(range(2000))
            def fill(self, set, way, line): pass
            def victim(self, set): return 0
        print("started", flush=True)
        try:
            plx.run({str(atrium)!r}, {{"mode": "functional"}}, policy=Slow)
        except KeyboardInterrupt:
            print("interrupted")
    """
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "started\n"
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30)[0] == "interrupted\n"
    assert process.returncode == 0
