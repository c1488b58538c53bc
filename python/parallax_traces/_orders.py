"""Tile orders as functions or lists."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native

if TYPE_CHECKING:
    from ._settings import AnyPath, Config, Order


@dataclass(frozen=True)
class Grid:
    """The tiles of a pair of views: what an order function gets.

    Attributes
    ----------
    width, height : int
        Tile columns and rows of each eye.
    eyes : int
        Number of eyes, always 2.
    frame : int
        Number of the frame.
    layer : int
        Number of the layer; 0 in traces without layers.
    """

    width: int
    height: int
    eyes: int
    frame: int
    layer: int


def name(order: Any, paths: list[Path], tile_px: int) -> str:
    """Gives an order a name that configurations accept."""
    if callable(order):
        title = getattr(order, "__name__", type(order).__name__)
    else:
        title = "list"
    if len(paths) != 1:
        raise _native.ParallaxError(
            f"order: expected one trace for an order that is not named, found {len(paths)}"
        )
    lists = []
    for frame, layer, _, width, height in _native.pairs(paths[0], tile_px):
        given = order(Grid(width, height, 2, frame, layer)) if callable(order) else order
        lists.append(_items(title, given))
    return _native.name_order(paths[0], tile_px, title, lists)


def _items(title: str, given: Any) -> list[Any]:
    """Items as the native functions take them."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        found = type(given).__name__
        raise _native.ParallaxError(f"{title}: expected a sequence of tiles, found {found}")
    return [_item(title, index, item) for index, item in enumerate(given)]


def _item(title: str, index: int, item: Any) -> tuple[Any, ...]:
    try:
        parts = tuple(item)
        if len(parts) == 3 and not isinstance(parts[0], (Sequence, np.ndarray)):
            return (_tile(parts), None)
        if len(parts) in (2, 3):
            interleave = parts[2] if len(parts) == 3 else "alternate"
            if isinstance(interleave, str):
                return (_tile(parts[0]), (_tile(parts[1]), interleave))
    except (TypeError, ValueError, OverflowError):
        pass
    raise _native.ParallaxError(
        f"{title}: item {index}: expected (eye, column, row) or two of them, found {item!r}"
    )


def _tile(tile: Any) -> tuple[int, int, int]:
    eye, column, row = (_number(part) for part in tile)
    return (eye, column, row)


def _number(part: Any) -> int:
    number = operator.index(part)
    if not 0 <= number < 1 << 32:
        raise ValueError(number)
    return number


def order_items(
    trace: AnyPath, order: Order = "morton", config: Config = None
) -> list[Any]:
    """The tiles of a trace in an order, in the form that ``order=`` takes.

    Parameters
    ----------
    trace : path
        A texture trace.
    order : str, callable or sequence
        As in :func:`run`.
    config : dict or path, optional
        As in :func:`run`. The order depends on ``seed``, ``cores``, ``tile_px`` and the size of the L2;
        an order that uses counters of the frame before also depends on sampling, layout and line size.

    Returns
    -------
    list
        Items of the only pair of views: ``(eye, column, row)``, or ``(tile, tile, how)`` for two tiles that are
        rendered together. A trace with several pairs (frames, layers) gives a list of such lists.

    Raises
    ------
    ParallaxError
        The trace cannot be read, the order is unknown, or it is no list of tiles because it renders halves of
        tiles.
    """
    from ._settings import path_of, settings_of

    path = path_of(trace)
    lists = _native.order_items(path, settings_of(config, [path], order))
    of_pairs = [
        [tile if other is None else (tile, other[0], other[1]) for tile, other in items]
        for items in lists
    ]
    return of_pairs[0] if len(of_pairs) == 1 else of_pairs
