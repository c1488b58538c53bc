"""The programs that a wheel carries."""

import os
import subprocess
import sys
from pathlib import Path

import parallax_traces as plx
import pytest


def test_the_programs_of_the_wheel_are_found():
    if "PARALLAX_WHEEL" not in os.environ:
        pytest.skip("the package is not installed from a wheel of `make dist`")
    for name in ("replay", "tracegen"):
        path = plx.program(name)
        assert path.parent == Path(sys.prefix, "bin").resolve()
        version = subprocess.run([path, "--version"], check=True, capture_output=True).stdout
        assert version.decode().startswith(f"{name} {plx.__version__}")
    assert Path(sys.prefix, "lib/parallax/libparallax_layer.so").is_file()


def test_a_program_that_is_absent_is_an_error():
    with pytest.raises(FileNotFoundError, match="no-such: PATH has no such program"):
        plx.program("no-such")
