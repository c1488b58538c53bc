"""Commands as functions, against the programs; types against mypy."""

import io
import json
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
import parallax_traces as plx
import pytest

TINY = {"size": "64x64", "quiet": True}
PAGE = """<!doctype html><canvas id=c width=64 height=64></canvas><script>
const gl = c.getContext("webgl2"), p = gl.createProgram();
for (const [kind, text] of [[gl.VERTEX_SHADER, `#version 300 es
void main() { vec2 q = vec2(gl_VertexID & 1, gl_VertexID >> 1); gl_Position = vec4(q * 2. - 1., .5, 1); }`],
[gl.FRAGMENT_SHADER, `#version 300 es
precision highp float; uniform sampler2D t; out vec4 o; void main() { o = texture(t, gl_FragCoord.xy / 16.); }`]]) {
  const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); gl.attachShader(p, s); }
gl.linkProgram(p); gl.useProgram(p); gl.enable(gl.DEPTH_TEST);
gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 16, 16, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(1024).fill(99));
gl.generateMipmap(gl.TEXTURE_2D);
const frame = () => { gl.clear(16640);
  for (const e of [0, 1]) { gl.viewport(e * 32, 0, 32, 64); gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4); }
  requestAnimationFrame(frame); };
requestAnimationFrame(frame);
</script>"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A small capture."""
    return plx.capture("atrium", tmp_path_factory.mktemp("captures") / "small.textrace", **TINY)


def same(frame, printed):
    """Compares rows; pandas 2 reads the last digit of CSV inexactly."""
    printed = pd.read_csv(io.BytesIO(printed))
    assert list(frame.columns) == list(printed.columns) and len(frame) == len(printed) > 0
    for key in frame.columns:
        if frame[key].dtype.kind in "iuf":
            assert np.allclose(frame[key], printed[key], rtol=1e-12, atol=0, equal_nan=True), key


@pytest.mark.parametrize(
    ("call", "options", "flags"),
    [
        (plx.orders, {"orders": ["morton", "z2-sta"], "caches": "8/128"}, "--orders morton,z2-sta --caches 8/128"),
        (plx.paper, {"as_": "none", "functional": True, "quiet": True}, "--as none --functional"),
    ],
)
def test_analyses_have_the_rows_and_the_text_of_the_program(atrium, replay, call, options, flags, capsys):
    frame = call(atrium, **options)
    command = [call.__name__, atrium, *flags.split()]
    same(frame, replay(*command, "--csv").stdout)
    assert frame.attrs["text"] == replay(*command).stdout.decode()
    assert frame.attrs["columns"]["l2_line_miss_pct"]["unit"] == "% of lines"
    assert ("2 points" in capsys.readouterr().err) == ("quiet" not in options)


def test_locality_has_rows_and_a_document(atrium, replay):
    options = {"orders": "morton", "only_l2": True, "quiet": True}
    frame = plx.locality(atrium, **options)
    assert list(frame["stream"]) == ["l2"] and 0 < frame["opt_line_miss_pct"][0] < frame["line_miss_pct"][0]
    document = plx.document("replay locality", atrium, **options)
    printed = replay("locality", atrium, "--orders", "morton", "--only-l2", "--json").stdout
    assert document == json.loads(printed) and document["curves"]


def test_configurations_are_dicts_or_files(atrium, tmp_path):
    few = {"orders": "morton", "caches": "8/128", "quiet": True}
    usual = plx.orders(atrium, **few)
    ways = plx.orders(atrium, config={"l1": {"ways": 1}}, **few)
    file = tmp_path / "ways.toml"
    file.write_text("l1.ways = 1")
    assert ways.equals(plx.orders(str(atrium), config=file, **few)) and not ways.equals(usual)
    with pytest.raises(plx.ProgramError, match=r"^config.toml: line 1: `l1.way`: unknown field") as caught:
        plx.orders(atrium, config={"l1": {"way": 1}})
    assert caught.value.exit_code == 2 and isinstance(caught.value, plx.ParallaxError)


def test_wrong_options_have_the_errors_of_the_program(atrium, capsys):
    for options, match in [
        ({"ordrs": "morton"}, "unexpected argument '--ordrs' found"),
        ({"orders": "mortn"}, "did you mean `morton`?"),
        ({"caches": [8, 128]}, "--caches"),
    ]:
        with pytest.raises(plx.ProgramError) as caught:
            plx.orders(atrium, **options)
        assert match in str(caught.value) and "Usage" not in str(caught.value)
    assert capsys.readouterr().err == ""


def test_accuracy_has_values_with_intervals(atrium, tmp_path):
    frame = plx.accuracy(atrium, output=tmp_path / "out", quiet=True)
    assert (tmp_path / "out/accuracy.html").is_file()
    found = frame.dropna(subset=["value_low"])
    assert len(found) and (found["value_low"] <= found["value"]).all() and (found["value"] <= found["value_high"]).all()
    assert set(frame["unit"]) >= {"%", "points"}


def test_captures_write_what_the_analyses_read(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert plx.run(small)["width_px"][0] == 64
    near = plx.capture("atrium", eye=(0, 1.5, 2.0), target=[0, 1.5, 0], **TINY)
    assert str(near) == "atrium.textrace" and plx.info(near) != plx.info(small)
    trace = plx.rays("teapot", spp=1, **TINY)
    assert str(trace) == "teapot.raytrace" and list(plx.reproject(trace)["run"]) == ["chosen", "plain"]
    second = plx.rays("teapot", "second.raytrace", frame=1, **TINY)
    assert len(plx.temporal([trace, second])) and plx.readings(trace)["chosen"].any()
    assert (plx.compare([small, small])["external_over_pct"] == 0).all()
    times = plx.schedule(small, quiet=True)
    assert (times["ms_low"] <= times["ms"]).all() and (times["ms"] <= times["ms_high"]).all()
    folder = plx.capture_techniques("atrium", only=["multi-resolution"], frames=1, repeats=1, **TINY)
    frame = plx.techniques(folder, quiet=True)
    assert str(folder) == "atrium-techniques" and list(frame["technique"]) == ["per-eye", "multi-resolution"]
    assert frame["flip_mean"][0] == 0 < frame["flip_mean"][1]
    head = {"path": "head", **TINY}
    plan = plx.capture("atrium", "plan.textrace", frames=4, plan_only=True, **head)
    frames = plx.capture("atrium", "frames.textrace", frames="0,1,2,3", **head)
    found = plx.sample([plan, frames], within="99points", quiet=True)
    assert {"value", "value_low", "value_high"} <= set(found.columns), found.columns
    with pytest.raises(plx.ProgramError, match=r"none.glb: scene: cannot read"):
        plx.capture("none.glb")


def test_programs_and_pages_are_captured(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(plx.ProgramError, match="true never used Vulkan") as caught:
        plx.capture_program(["true"], frames=1)
    assert caught.value.exit_code == 2
    for wrong, kind, match in [([], None, "an empty list"), ("a", "exe", "kind: expected app, page or xr, found 'exe'")]:
        with pytest.raises(plx.ParallaxError, match=match):
            plx.capture_program(wrong, kind=kind)
    if shutil.which("hello_xr"):
        trace = plx.capture_program(["hello_xr", "-g", "Vulkan2"], kind="xr", frames=1, **TINY)
        assert str(trace) == "hello_xr.textrace" and len(plx.info(trace)["passes"]) == 2
    if not shutil.which("chromium"):
        pytest.skip("chromium is absent")
    page = tmp_path / "own.html"
    page.write_text(PAGE)
    trace = plx.capture_program(page, frames=2, eyes="halves", size="64x64", quiet=True)
    assert str(trace) == "own.textrace" and plx.run(trace)["external_bytes"][0] > 0


def test_a_view_is_a_page_in_a_frame(atrium, tmp_path):
    view = plx.view(atrium, orders=["morton", "z2-sta"], quiet=True)
    assert view.save(tmp_path / "view.html").read_text() == view.text
    shown = view._repr_html_()
    assert shown.startswith('<iframe srcdoc="&lt;!') and "&lt;base href=&quot;about:srcdoc" in shown and shown.count('"') == 6 and "<script" not in shown


def test_usage_is_the_help_of_the_program(replay):
    assert plx.usage("replay orders") == replay("orders", "--help").stdout.decode()
    assert "replay orders" in plx.orders.__doc__ and plx.orders.__name__ == "orders"


def test_a_program_that_is_interrupted_ends():
    code = """
        import parallax_traces as plx, signal
        signal.signal(signal.SIGINT, signal.default_int_handler)
        print("started", flush=True)
        try:
            plx.capture_program(["sleep", "60"])
        except KeyboardInterrupt:
            print("interrupted")
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "started\n"
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1)
    process.send_signal(subprocess.signal.SIGINT)
    assert process.communicate(timeout=30)[0] == "interrupted\n"


def test_types_refuse_what_is_no_path(tmp_path):
    calls = {
        'plx.run(plx.capture("a", size="64x64", eye=(0, 1.5, 2), shadows=True), {"cores": 1}, order="morton")': None,
        'plx.orders(["a", "b"], config={"cores": 1}, orders=["morton"]).sum()': None,
        "plx.run(3)": 'Argument 1 to "run" has incompatible type "int"',
        "plx.orders([3])": "List item 0 has incompatible type",
        "plx.capture(None)": 'incompatible type "None"',
        "plx.sweep({}, order=1)": "Unexpected keyword argument",
    }
    package = Path(plx.__file__).parent
    assert (package / "py.typed").is_file()
    # A copy is checked, too, and quickly: without the types of NumPy.
    shutil.copytree(package, tmp_path / package.name, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    (tmp_path / "calls.py").write_text("import parallax_traces as plx\n" + "\n".join(calls))
    options = ["--strict", "--no-site-packages", "--ignore-missing-imports", "--cache-dir", tmp_path / "cache"]
    command = [sys.executable, "-m", "mypy", *options, "calls.py"]
    text = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path).stdout
    lines = [line for line in text.splitlines() if "error:" in line]
    expected = [(2 + number, match) for number, match in enumerate(calls.values()) if match]
    assert len(lines) == len(expected), text
    for line, (number, match) in zip(lines, expected):
        assert f"calls.py:{number}:" in line and match in line, text
