"""Prints what the package and some of its extras need, one requirement a line: `needs.py [EXTRA...]`."""

import sys
from pathlib import Path

try:
    import tomllib
except ImportError:  # before Python 3.11
    from pip._vendor import tomli as tomllib

project = tomllib.loads(Path(__file__).with_name("pyproject.toml").read_text())["project"]
needs = list(project["dependencies"])
for extra in sys.argv[1:]:
    needs += project["optional-dependencies"][extra]
print("\n".join(needs))
