"""Replays as data frames."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Union

import pandas as pd

from . import _native
from ._settings import AnyPath, Config, Order, Paths, Policy, experiment_of, path_of, paths_of, settings_of
from ._tables import frame_of


def run(
    traces: Paths, config: Config = None, *, order: Order = None, policy: Policy = None
) -> pd.DataFrame:
    """Replays traces through caches and texture units, like ``replay run``.

    Parameters
    ----------
    traces : path or list of paths
        Texture traces.
    config : dict or path, optional
        Keys of docs/use/configuration.md, nested or with dots (``{"l1.size_bytes": "16KiB"}``), or a TOML file
        with them. The rest keeps its defaults.
    order : str, callable or sequence, optional
        Tile order, instead of the configuration's: a name such as ``"z2-sta"``; a function that gets a
        :class:`Grid` and returns a sequence; or the sequence itself. Its items are ``(eye, column, row)``, eye 0
        left and 1 right, or two such tiles that one core renders together, triangle by triangle. It must have
        every tile of both eyes once. Passes of one eye alone are rendered in Morton order.
    policy : str or class, optional
        Replacement policy of L1 and L2, instead of the configuration's: a name such as ``"drrip"``, or a class
        (see docs/use/python.md). A class is called for each look-up and is slow.

    Returns
    -------
    pandas.DataFrame
        One row per trace. The columns are those of ``replay sweep --csv``; ``frame.attrs["columns"]`` has the unit
        and the meaning of each.

    Raises
    ------
    ParallaxError
        A trace cannot be read, or a setting cannot be used. Exceptions of `order` and `policy` pass through.
    KeyboardInterrupt
        Ctrl-C. The replay ends in the background at its next frame.
    """
    paths = paths_of(traces)
    return frame_of(_native.run(paths, settings_of(config, paths, order, policy)))


def result(
    trace: AnyPath, config: Config = None, *, order: Order = None, policy: Policy = None, tiles: bool = False
) -> dict[str, Any]:
    """What ``replay run --json`` prints: all counts of one replay, by view, texture and level.

    Parameters
    ----------
    trace : path
        A texture trace.
    config, order, policy
        As in :func:`run`.
    tiles : bool
        Also count by tile, like ``--tiles``.

    Returns
    -------
    dict

    Raises
    ------
    ParallaxError
        As :func:`run`.
    """
    path = path_of(trace)
    settings = settings_of(config, [path], order, policy)
    settings["tiles"] = bool(tiles)
    found: dict[str, Any] = json.loads(_native.result(path, settings))
    return found


def sweep(
    experiment: Union[AnyPath, Mapping[str, Any]], traces: Union[Paths, None] = None
) -> pd.DataFrame:
    """Replays every point of an experiment, like ``replay sweep``. Points share work.

    Parameters
    ----------
    experiment : dict or path
        An experiment file, or a dict with its tables: ``base`` (keys of a configuration), ``axes`` (key to list of
        values, crossed; the last one varies fastest) and ``one-at-a-time``. Values of ``order`` may be functions
        or lists of tiles, values of ``l1.replacement`` and so on classes, as in :func:`run`.
    traces : path or list of paths
        Texture traces, instead of those of the experiment.

    Returns
    -------
    pandas.DataFrame
        One row per point and trace, with the columns of ``replay sweep --csv``.

    Raises
    ------
    ParallaxError
        As :func:`run`.
    """
    if traces is None and isinstance(experiment, Mapping):
        traces = experiment.get("traces")
    paths = [] if traces is None else paths_of(traces)
    return frame_of(_native.sweep(paths, experiment_of(experiment, paths)))
