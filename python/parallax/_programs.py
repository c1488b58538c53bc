"""The programs that a wheel carries beside the package."""

from __future__ import annotations

import shutil
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path


def program(name: str) -> Path:
    """Path of the program ``tracegen`` or ``replay``.

    It is the program that was installed with the package; without one, the first on ``PATH``.

    Raises:
        FileNotFoundError: there is none.
    """
    try:
        installed = [Path(file.locate()) for file in files("parallax") or () if file.name == name]
    except PackageNotFoundError:  # a copy of the modules
        installed = []
    found = next(filter(Path.is_file, installed), None) or shutil.which(name)
    if found is None:
        raise FileNotFoundError(
            f"{name}: PATH has no such program; the wheel of `make dist` carries it"
        )
    return Path(found).resolve()
