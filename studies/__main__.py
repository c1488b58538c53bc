"""The command line: `python3 -m studies` lists the studies, `python3 -m studies NAME [options]` runs one."""

import argparse
import ast
import importlib
import os
import sys
import tempfile
from pathlib import Path

from .common import ROOT, Absent, Failed, Study

OUT = os.environ.get("OUT", "out")


def listed():
    """Each study's name, and what its module says about it."""
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if path.stem not in ("__init__", "__main__", "common"):
            yield path.stem.replace("_", "-"), ast.get_docstring(ast.parse(path.read_text()))


def parse(name, about, module, words):
    parser = argparse.ArgumentParser(prog=f"python3 -m studies {name}", description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=ROOT / "results", help="folder of the results files (results)")
    parser.add_argument("--out", type=Path, default=Path(OUT), help=f"folder of all other outputs ({OUT})")
    parser.add_argument("--scenes", type=Path, help="folder of the real scenes (OUT/scenes)")
    parser.add_argument("--traces", type=Path, help="keep the captures below this folder, and use them again")
    parser.add_argument("--bin", type=Path, help="folder of tracegen and replay ($CARGO_TARGET_DIR/release)")
    for flag, settings in getattr(module, "OPTIONS", {}).items():
        parser.add_argument(flag, **settings)
    return parser.parse_args(words)


def main():
    studies = dict(listed())
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print("usage: python3 -m studies NAME [options]   (NAME --help lists the options)\n")
        for name, about in studies.items():
            print(f"{name:17} {about.splitlines()[0]}")
        return 0
    name, words = sys.argv[1], sys.argv[2:]
    if name not in studies:
        print(f"studies: expected one of: {', '.join(studies)}; found '{name}'", file=sys.stderr)
        return 2
    try:
        module = importlib.import_module(f"studies.{name.replace('-', '_')}")
        options = parse(name, studies[name], module, words)
        with tempfile.TemporaryDirectory(prefix="studies-") as work:
            return module.run(Study(name, options, Path(work))) or 0
    except ModuleNotFoundError as error:
        print(f"skipped: {name}: the Python package {error.name} is absent", file=sys.stderr)
    except Absent as error:
        print(f"skipped: {name}: {error} is absent", file=sys.stderr)
    except (Failed, OSError) as error:
        print(f"studies: {name}: {error}", file=sys.stderr)
        return 2
    return 3


if __name__ == "__main__":
    sys.exit(main())
