"""Paths that the tests share."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def traces():
    """The folder of the golden traces."""
    return ROOT / "traces"


@pytest.fixture(scope="session")
def atrium(traces):
    return traces / "atrium.textrace"


@pytest.fixture(scope="session")
def replay():
    """Runs the program `replay` and returns its completed process."""
    program = os.environ.get("PARALLAX_REPLAY", ROOT / "target/release/replay")
    assert Path(program).exists(), f"{program} is not built: run `make build`"

    def run(*arguments, check=True):
        command = [program, *map(str, arguments)]
        return subprocess.run(command, check=check, capture_output=True)

    return run
