"""Commands of the programs as functions: captures return paths, analyses return data frames."""

from __future__ import annotations

import html
import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Protocol, Union

import pandas as pd

from . import _programs
from ._native import ParallaxError
from ._settings import AnyPath, Paths, Writer, paths_of
from ._tables import frame_of

Option = Union[None, bool, float, AnyPath, Sequence[Union[float, AnyPath]], Mapping[str, Any]]

_OPTIONS = """
    options
        Flags of ``{command}`` as keywords, with ``_`` for ``-`` (and ``as_`` for ``--as``); ``usage("{command}")``
        lists them. ``True`` gives a flag without a value. A sequence is joined by commas, and one of ``Path``
        objects repeats the flag. A dict is written as a TOML file. ``quiet=True`` leaves out progress and figures
        about the run, which go to ``sys.stderr``.
"""
_RAISES = """
    Raises
    ------
    ProgramError
        The program failed: the text is that of its error, and ``exit_code`` its exit code.
    FileNotFoundError
        There is no such program; see :func:`program`.
    """


class Capture(Protocol):
    """A function that writes a trace."""

    def __call__(
        self, scene: AnyPath, output: Optional[AnyPath] = None, **options: Option
    ) -> Path: ...


class Analysis(Protocol):
    """A function that returns the rows of a command."""

    def __call__(self, traces: Paths, **options: Option) -> pd.DataFrame: ...


def _run(command: str, operands: Sequence[AnyPath], options: Mapping[str, Option], *more: str) -> str:
    """Runs a command such as ``replay orders`` and returns its standard output."""
    program, name = command.split()
    with tempfile.TemporaryDirectory() as folder:
        flags = list(more)
        for key, value in options.items():
            flags += _flags(key, value, folder)
        # A command line of another program comes after the options.
        files = [os.fspath(operand) for operand in operands]
        arguments = [*flags, "--", *files] if name in ("app", "xr") else [*files, *flags]
        try:
            return _programs.output(program, [name, *arguments])
        except _programs.ProgramError as error:
            text = str(error).replace(folder + os.sep, "")
            raise _programs.ProgramError(text, error.exit_code) from None


def _flags(key: str, value: Option, folder: str) -> list[str]:
    flag = "--" + key.rstrip("_").replace("_", "-")
    if value is None or value is False:
        return []
    if value is True:
        return [flag]
    if isinstance(value, Mapping):
        file = Path(folder, f"{key}.toml")
        file.write_text(Writer([], 16).settings(value)["text"], encoding="utf-8")
        value = file
    if isinstance(value, (str, os.PathLike)) or not hasattr(value, "__iter__"):
        return [f"{flag}={value}"]
    values = list(value)
    if values and all(isinstance(each, os.PathLike) for each in values):
        return [f"{flag}={each}" for each in values]
    return [f"{flag}={','.join(map(str, values))}"]


def usage(command: str) -> str:
    """The help of a command such as ``"replay orders"`` or ``"tracegen raster"``."""
    return _run(command, [], {}, "--help")


def document(command: str, traces: Paths, **options: Option) -> Any:
    """The JSON object of a command such as ``"replay locality"``, which has more than its rows.

    Its schema is in docs/use/analysis.md. Parameters and errors are those of :func:`orders`.
    """
    return json.loads(_run(command, paths_of(traces), options, "--json"))


def _capture(name: str, command: str, suffix: str, what: str) -> Capture:
    def capture(scene: AnyPath, output: Optional[AnyPath] = None, **options: Option) -> Path:
        path = Path(output or Path(scene).stem + suffix)
        _run(command, [scene], options, f"--output={path}")
        return path

    capture.__name__ = capture.__qualname__ = name
    capture.__doc__ = f"""{what}, like ``{command}``.

    Parameters
    ----------
    scene : path or str
        A ``.gltf``, ``.glb`` or ``.obj`` file, or the name of a built-in scene such as ``"atrium"``.
    output : path, optional
        What to write; by default the scene's name and ``{suffix}`` in the current folder.{_OPTIONS.format(command=command)}
    Returns
    -------
    Path
        The output.
{_RAISES}"""
    return capture


capture = _capture(
    "capture", "tracegen raster", ".textrace", "Renders a stereo frame and records its texture samples"
)
rays = _capture("rays", "tracegen rays", ".raytrace", "Traces a stereo frame and records its rays")
capture_techniques = _capture(
    "capture_techniques",
    "tracegen techniques",
    "-techniques",
    "Measures rendering techniques along a path, and writes the folder that :func:`techniques` takes",
)


def capture_program(
    program: Union[AnyPath, Sequence[AnyPath]],
    output: Optional[AnyPath] = None,
    *,
    kind: Optional[str] = None,
    **options: Option,
) -> Path:
    """Records the texture samples of an unmodified program or page, like ``tracegen app``, ``page`` or ``xr``.

    Parameters
    ----------
    program : path, str or sequence
        A program, or a list of a program and its arguments; or a page: a file or an address.
    output : path, optional
        The trace; by default the program's name and ``.textrace`` in the current folder.
    kind : {"app", "page", "xr"}, optional
        A Vulkan or OpenGL program, a page of WebGL or WebXR, or an OpenXR program. By default ``"page"`` for
        addresses and files that end with ``.html`` or ``.htm``, otherwise ``"app"``.
    options
        Flags of ``tracegen KIND`` as in :func:`capture`.

    Returns
    -------
    Path
        The trace.

    Raises
    ------
    ProgramError, FileNotFoundError
        As :func:`capture`.
    """
    line = [program] if isinstance(program, (str, os.PathLike)) else list(program)
    if not line:
        raise ParallaxError("program: expected a program or a page, found an empty list")
    first = os.fspath(line[0])
    if kind is None:
        is_page = first.startswith(("http://", "https://")) or first.endswith((".html", ".htm"))
        kind = "page" if is_page else "app"
    if kind not in ("app", "page", "xr"):
        raise ParallaxError(f"kind: expected app, page or xr, found {kind!r}")
    path = Path(output or Path(first).stem + ".textrace")
    _run(f"tracegen {kind}", line, options, f"--output={path}")
    return path


def _analysis(name: str, what: str, traces_are: str = "Texture traces") -> Analysis:
    command = f"replay {name}"

    def analysis(traces: Paths, **options: Option) -> pd.DataFrame:
        with tempfile.TemporaryDirectory() as folder:
            rows = Path(folder, "rows.parquet")
            text = _run(command, paths_of(traces), options, f"--parquet={rows}")
            frame = frame_of(rows.read_bytes())
        frame.attrs["text"] = text
        return frame

    analysis.__name__ = analysis.__qualname__ = name
    analysis.__doc__ = f"""{what}, like ``{command}``.

    Parameters
    ----------
    traces : path or list of paths
        {traces_are}.{_OPTIONS.format(command=command)}
    Returns
    -------
    pandas.DataFrame
        The rows of ``--parquet``. ``X_low`` and ``X_high`` are the ends of the interval of ``X``;
        ``attrs["columns"]`` has the unit and the meaning of each column, and ``attrs["text"]`` what the program
        prints: the answer, the machine, and the main table.
{_RAISES}"""
    return analysis


orders = _analysis("orders", "Compares tile orders with each other and with lower bounds")
locality = _analysis("locality", "Analyses reuse distances, working sets and causes of misses, by order")
paper = _analysis("paper", "Replays the Z2 paper's experiment beside the published figures")
sample = _analysis(
    "sample", "Estimates figures of a path from some of its frames", "Plan of a path, then traces of its frames"
)
reproject = _analysis(
    "reproject", "Replays a ray-tracing GPU that reuses the left image for the right", "Ray traces"
)
temporal = _analysis(
    "temporal",
    "Compares reuse of the previous frame with reuse between the eyes",
    "Ray traces of a sequence of frames",
)
readings = _analysis("readings", "Sets every reading of the SGRT paper beside its figure 3", "Ray traces")
schedule = _analysis("schedule", "Models frame time by scheduler")
compare = _analysis("compare", "Compares two captures of the same views", "Two texture traces")
techniques = _analysis(
    "techniques",
    "Compares rendering techniques: frame time, image error, cache misses",
    "Folders of :func:`capture_techniques`",
)


def accuracy(traces: Paths, *, output: Optional[AnyPath] = None, **options: Option) -> pd.DataFrame:
    """Measures the run time and the error of faster methods, like ``replay accuracy``.

    Parameters
    ----------
    traces : path or list of paths
        Texture traces.
    output : path, optional
        Folder for tables, charts and a page; by default they are not kept.
    options
        Flags of ``replay accuracy`` as in :func:`orders`.

    Returns
    -------
    pandas.DataFrame
        One row per study, choice, scene and figure (``choices.csv``): ``value``, the ends of its interval
        ``value_low`` and ``value_high``, and ``unit``. ``attrs["text"]`` is what the program prints.

    Raises
    ------
    ProgramError, FileNotFoundError
        As :func:`orders`.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(output or folder)
        text = _run("replay accuracy", paths_of(traces), options, f"--output={place}")
        frame = pd.read_csv(place / "choices.csv")
    frame.attrs["text"] = text
    return frame


class Page:
    """A self-contained page. As the result of a notebook's cell it shows itself.

    Attributes
    ----------
    text : str
        The page as HTML.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def save(self, path: AnyPath) -> Path:
        """Writes the page into a file, for a browser."""
        file = Path(path)
        file.write_text(self.text, encoding="utf-8")
        return file

    def _repr_html_(self) -> str:
        style = "width: 100%; height: 45rem; border: 0"
        # Without this, links to parts of the page lead to the notebook's address.
        page = html.escape(self.text.replace("<head>", '<head><base href="about:srcdoc">', 1))
        return f'<iframe srcdoc="{page}" sandbox="allow-scripts" style="{style}"></iframe>'


def view(trace: AnyPath, **options: Option) -> Page:
    """A page to explore the tiles of a trace: maps of misses, and orders as an animation, like ``replay view``.

    Parameters
    ----------
    trace : path
        A texture trace.
    options
        Flags of ``replay view`` as in :func:`orders`, such as ``orders=["morton", "z2-sta"]``.

    Raises
    ------
    ProgramError, FileNotFoundError
        As :func:`orders`.
    """
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder, "view.html")
        _run("replay view", [trace], options, f"--output={page}")
        return Page(page.read_text(encoding="utf-8"))
