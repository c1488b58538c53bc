"""The programs ``tracegen`` and ``replay``: where they are, and how they are run."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from ._native import ParallaxError


class ProgramError(ParallaxError):
    """A program that failed. The text is that of its error.

    Attributes
    ----------
    exit_code : int
        1: a check failed; 2: wrong use, an unreadable input or an output that cannot be written; 128 + N: ended
        by signal N.
    """

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code


def program(name: str) -> Path:
    """Path of the program ``tracegen`` or ``replay``.

    It is the program that was installed with the package; without one, that of the checkout which the package is
    in; without one, the first on ``PATH``.

    Raises
    ------
    FileNotFoundError
        There is none.
    """
    try:
        installed = files("parallax-traces") or []
    except PackageNotFoundError:  # a copy of the modules
        installed = []
    places = [Path(str(file.locate())) for file in installed if file.name == name]
    places.append(Path(__file__).resolve().parents[2] / "target/release" / name)
    found = next(filter(Path.is_file, places), None) or shutil.which(name)
    if found is None:
        raise FileNotFoundError(
            f"{name}: PATH has no such program; the wheel of `make wheel` carries it"
        )
    return Path(found).resolve()


def output(name: str, arguments: Sequence[str]) -> str:
    """Runs a program and returns its standard output. Progress and warnings go to ``sys.stderr`` as they come."""
    message: list[str] = []
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as printed:
        process = subprocess.Popen(
            [str(program(name)), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
        )
        assert process.stderr is not None
        try:
            for line in process.stderr:
                if message or line.startswith("error: "):
                    message.append(line)
                else:
                    sys.stderr.write(line)
            code = process.wait()
        except BaseException:  # Ctrl-C: the program removes what it has begun
            process.terminate()
            process.wait()
            raise
        printed.seek(0)
        text = printed.read()
    if code:
        # The usage that follows a wrong option is that of the command line.
        why = "".join(message).removeprefix("error: ").split("\n\nUsage:")[0].strip()
        code = 128 - code if code < 0 else code
        raise ProgramError(why or f"{name} {arguments[0]}: ended with exit code {code}", code)
    return text
