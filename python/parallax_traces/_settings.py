"""Settings as TOML: from files, or from dicts that may hold tile orders and policies in Python."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Union

import numpy as np

from . import _native, _orders

if TYPE_CHECKING:
    from numpy.typing import NDArray

AnyPath = Union[str, "os.PathLike[str]"]
Paths = Union[AnyPath, Iterable[AnyPath]]
Config = Union[AnyPath, Mapping[str, Any], None]
Order = Union[
    str, Callable[["_orders.Grid"], "Union[Sequence[Any], NDArray[Any]]"], Sequence[Any], "NDArray[Any]", None
]
Policy = Union[str, type, None]


class Settings(dict[str, Any]):
    """What the native functions take: the text, its file, and names of what is not text."""

    def __init__(self, text: str = "", file: Path | None = None) -> None:
        super().__init__(
            text=text, file=file, order=None, policy=None, policies=[], tiles=False
        )


def path_of(trace: AnyPath, what: str = "trace") -> Path:
    """A path, or an error that names the argument."""
    if isinstance(trace, (str, os.PathLike)):
        return Path(os.fspath(trace))
    raise _native.ParallaxError(f"{what}: expected a path, found {type(trace).__name__}")


def paths_of(traces: Paths) -> list[Path]:
    """One path or more."""
    if isinstance(traces, (str, os.PathLike)) or not isinstance(traces, Iterable):
        return [path_of(traces)]
    paths = [path_of(trace) for trace in traces]
    if not paths:
        raise _native.ParallaxError("traces: expected at least one, found none")
    return paths


def settings_of(
    config: Config, paths: list[Path], order: Order = None, policy: Policy = None
) -> Settings:
    """The configuration of a replay. `order` and `policy` override it."""
    if config is None or isinstance(config, Mapping):
        found = Writer(paths, _tile_px(config)).settings(config or {})
    else:
        found = _read(config, "config")
    if order is not None:
        if isinstance(order, str):
            found["order"] = order
        else:
            tile_px = json.loads(_native.config_json(found)).get("tile_px", 16)
            found["order"] = _orders.name(order, paths, tile_px)
    if policy is not None:
        if isinstance(policy, str):
            found["policy"] = policy
        else:
            found["policy"] = Writer(paths, 16).policy(policy)
            found["policies"].append(found["policy"])
    return found


def experiment_of(experiment: Union[AnyPath, Mapping[str, Any]], paths: list[Path]) -> Settings:
    """The settings of a sweep."""
    if not isinstance(experiment, Mapping):
        return _read(experiment, "experiment")
    base = experiment.get("base") or {}
    return Writer(paths, _tile_px(base)).settings(experiment)


def _read(settings: AnyPath, what: str) -> Settings:
    """The settings of a file."""
    if not isinstance(settings, (str, os.PathLike)):
        found = type(settings).__name__
        raise _native.ParallaxError(f"{what}: expected a dict or a path, found {found}")
    path = Path(os.fspath(settings))
    return Settings(_native.read_settings(path), path)


def _tile_px(config: Any) -> int:
    size = config.get("tile_px", 16) if isinstance(config, Mapping) else 16
    return size if isinstance(size, int) else 16


class Writer:
    """Writes a dict as TOML, one key a line, and names the orders and policies in it."""

    def __init__(self, paths: list[Path], tile_px: int) -> None:
        self.paths = paths
        self.tile_px = tile_px
        self.policies: dict[str, Any] = {}

    def settings(self, values: Mapping[str, Any]) -> Settings:
        lines: list[str] = []
        self._table(values, (), lines)
        found = Settings("\n".join(lines) + "\n")
        found["policies"] = list(self.policies)
        return found

    def policy(self, policy: Any) -> str:
        """The name of a class."""
        title = getattr(policy, "__name__", type(policy).__name__)
        if not callable(policy):
            raise _native.ParallaxError(f"policy: expected a name or a class, found {title}")
        name = f"{title}@python"
        if self.policies.get(name, policy) is not policy:
            raise _native.ParallaxError(f"policy: two classes are named {title}")
        _native.name_policy(name, policy)
        self.policies[name] = policy
        return name

    def _table(self, values: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
        for key, value in values.items():
            if not isinstance(key, str):
                raise _native.ParallaxError(f"config: expected text as keys, found {key!r}")
            inner = (*path, key)
            if isinstance(value, Mapping) and value:
                self._table(value, inner, lines)
                continue
            name = ".".join(_text(part) for part in inner)
            lines.append(f"{name} = {self._value(inner, value)}")

    def _value(self, path: tuple[str, ...], value: Any) -> str:
        key = path[-1].rsplit(".", 1)[-1]
        is_axis = path[0] in ("axes", "one-at-a-time")
        if is_axis and isinstance(value, (list, tuple, np.ndarray, range)):
            return "[" + ", ".join(self._single(key, path, each) for each in value) + "]"
        return self._single(key, path, value)

    def _single(self, key: str, path: tuple[str, ...], value: Any) -> str:
        if key == "order" and not isinstance(value, str):
            return _text(_orders.name(value, self.paths, self.tile_px))
        if key == "replacement" and not isinstance(value, str):
            return _text(self.policy(value))
        if isinstance(value, (bool, np.bool_)):
            return "true" if value else "false"
        if isinstance(value, str):
            return _text(value)
        if isinstance(value, (int, np.integer)):
            return str(int(value))
        if isinstance(value, (float, np.floating)):
            return repr(float(value))
        if isinstance(value, Mapping):
            fields = (f"{_text(k)} = {self._single(k, path, v)}" for k, v in value.items())
            return "{ " + ", ".join(fields) + " }"
        if isinstance(value, (list, tuple, np.ndarray, range)):
            return "[" + ", ".join(self._single(key, path, each) for each in value) + "]"
        if isinstance(value, os.PathLike):
            return _text(os.fspath(value))
        found = type(value).__name__
        raise _native.ParallaxError(
            f"config: `{'.'.join(path)}`: expected text, a number or a list, found {found}"
        )


def _text(text: str) -> str:
    """A string of TOML, which escapes what JSON does, and DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
