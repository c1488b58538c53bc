"""Traces as tables and arrays."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from . import _native
from ._settings import AnyPath, Config, Order, path_of, settings_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

EYES = {0: "left", 1: "right", 255: None}
"""Meaning of the column ``eye`` of :func:`lines`. 255 is a pass of both eyes, such as a shadow map."""


def _table(columns: list[Any]) -> pa.Table:
    arrays = {}
    for name, codes, values in columns:
        array = pa.array(values)
        if codes:
            array = pa.DictionaryArray.from_arrays(array, codes)
        arrays[name] = array
    return pa.table(arrays)


def frame_of(rows: bytes) -> pd.DataFrame:
    """The rows of a Parquet file of ``replay``. ``attrs["columns"]`` has units and meanings."""
    table = pq.read_table(pa.BufferReader(rows))
    frame: pd.DataFrame = table.to_pandas()
    columns = (table.schema.metadata or {}).get(b"parallax.columns")
    if columns:
        frame.attrs["columns"] = json.loads(columns)
    return frame


def read_textrace(path: AnyPath) -> pa.Table:
    """Reads all quad records of a texture trace.

    The columns are those of ``replay dump --parquet``, and the numbers are those of the file (FORMAT.md). The
    table uses the decoder's memory without a copy.

    Parameters
    ----------
    path : path
        A ``.textrace`` file.

    Returns
    -------
    pyarrow.Table
        One row per record, in file order:

        ``pass``, ``tile``, ``draw``, ``primitive`` : uint32
            Where the record comes from. :func:`info` has the tables that these numbers point into.
        ``x``, ``y`` : uint8
            Column and row of the 2x2 quad in its tile, in quads.
        ``mask`` : uint8
            Covered pixels: bit 0 top left, 1 top right, 2 bottom left, 3 bottom right.
        ``group`` : uint8
            Index into the draw's groups of samples; 15 for a quad without samples.
        ``uv_u``, ``uv_v`` : int32
            Coordinates of the top left pixel, in 1/2048 of a texel of the group's extent.
        ``dx_u``, ``dx_v``, ``dy_u``, ``dy_v``, ``cross_u``, ``cross_v`` : int32
            Their derivatives, in the same unit per pixel.

    Raises
    ------
    ParallaxError
        The file cannot be read or is damaged; the text names the place.
    """
    return _table(_native.textrace(path_of(path, "path")))


def read_raytrace(path: AnyPath, rows: str = "rays") -> pa.Table:
    """Reads all rays, samples or visits of a ray trace, or its hierarchy.

    The columns are those of ``replay dump --parquet``, and of ``replay convert --to parquet`` for visits. The table uses the decoder's memory without a copy.

    Parameters
    ----------
    path : path
        A ``.raytrace`` file.
    rows : {"rays", "samples", "visits", "nodes", "slots"}
        What a row is: a ray with its cost; a sample of a pixel with its primary hit and colour; a visit of a
        node or triangle by a ray (of a trace captured with ``--visits``); a child of an inner node, or the
        triangle of a slot (``--hierarchy``). Those of rays, samples and visits have ``eye``, ``tile``, ``x``,
        ``y`` (pixel) and ``sample``.

    Returns
    -------
    pyarrow.Table
        In file order. For rays: ``ray`` (number in its sample), ``kind``, ``outcome``, ``depth``, ``parent``
        (4294967295 for primary rays), ``steps`` (inner nodes visited), ``triangle_tests``, ``alpha_tests``. If
        the trace was captured with ``--geometry``, also ``origin_*`` (metres, relative to the trace's origin),
        ``direction_*`` (unit length), ``t_min``, ``t_max`` (metres; the largest float without a limit), ``t``
        (distance of the hit, NaN for a miss), ``slot`` (of the triangle hit, 4294967295 for a miss) and
        ``stack_depth`` (most entries on the traversal stack).
        For samples: ``hit`` (0 or 1), ``t`` (metres), ``position_*`` (metres, relative to the trace's origin),
        ``geometric_normal_*``, ``shading_normal_*``, ``uv_*``, ``primitive``, ``object``, ``material``,
        ``view_independent_*``, ``view_dependent_*`` (linear RGB), ``rays`` (their number). Without a hit,
        measures of the hit are NaN and its numbers 4294967295.
        For visits: ``address``, ``bytes``, ``ray``, ``kind`` of the ray, ``entry`` ("node" or "triangle") and
        ``index`` (of the node, or slot). For nodes: ``node``, ``child`` (its number in the node), ``kind``
        ("node" or "leaf"), ``index`` (node, or first slot), ``triangles`` of a leaf, and the box ``min_*`` to
        ``max_*``. For slots: ``slot``, ``primitive``, ``masked`` (1 if rays look up its alpha), and the
        vertices ``v0_*``, ``v1_*``, ``v2_*``.

    Raises
    ------
    ParallaxError
        The file cannot be read or is damaged, does not have such rows, or `rows` is something else.
    """
    return _table(_native.raytrace(path_of(path, "path"), rows))


def info(path: AnyPath) -> dict[str, Any]:
    """What ``replay info --json`` prints: description, tables and totals of a trace of either kind.

    Raises
    ------
    ParallaxError
        The file cannot be read or is damaged.
    """
    found: dict[str, Any] = json.loads(_native.info(path_of(path, "path")))
    return found


def lines(path: AnyPath, order: Order = None, config: Config = None) -> dict[str, NDArray[Any]]:
    """Every look-up of a cache line, in the order in which a replay in functional mode performs them.

    Parameters
    ----------
    path : path
        A texture trace.
    order, config
        As in :func:`run`. The order, ``cores``, ``assign``, ``line_bytes``, ``tile_px``, ``hsr``, ``sampling``
        and ``layout`` matter; caches do not.

    Returns
    -------
    dict of numpy.ndarray
        Arrays of equal length, one element per look-up:

        ``address`` : uint64
            Byte address of the line.
        ``pass``, ``tile`` : uint32
            Index of the pass, and tile of that pass (row by row).
        ``eye`` : uint8
            See :data:`EYES`.
        ``core`` : uint8
            Core that renders the tile.
        ``texture`` : uint32
            Index into ``info(path)["textures"]``.
        ``level`` : uint8
            Mip level.

        A look-up takes 23 bytes of memory.

    Raises
    ------
    ParallaxError
        The trace cannot be read, or a setting cannot be used.
    """
    file = path_of(path, "path")
    return _native.lines(file, settings_of(config, [file], order))
