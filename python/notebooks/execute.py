"""Executes the notebooks of this folder, each in an empty folder, and fails if a cell fails.

    python execute.py FOLDER    writes executed copies into FOLDER
    python execute.py --update  rewrites the notebooks, and the figures of docs/use/python.md from them
"""

import base64
import shutil
import sys
import tempfile
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parents[1] / "docs/images"
# Programs that a notebook cannot do without.
NEEDS = {"my-own-program": "chromium"}


def figures(notebook):
    """The PNG files of a notebook, in order."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    images = [output.get("data", {}).get("image/png") for output in outputs]
    return [base64.b64decode(image) for image in images if image]


def main(target):
    update = target == "--update"
    folder = HERE if update else Path(target)
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(HERE.glob("*.ipynb")):
        needs = NEEDS.get(path.stem, "python3")
        if not shutil.which(needs):
            print(f"SKIPPED: {needs} is absent, which {path.name} needs")
            continue
        start = time.monotonic()
        notebook = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as place:
            NotebookClient(notebook, timeout=300, resources={"metadata": {"path": place}}).execute()
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)  # times of day
            for output in cell.get("outputs", []):
                if "<iframe" in output.get("data", {}).get("text/html", ""):  # as large as a trace
                    del output["data"]["text/html"]
        notebook.metadata.language_info = {"name": "python"}
        nbformat.write(notebook, folder / path.name)
        found = figures(notebook)
        assert found, f"{path.name}: no figure"
        for number, figure in enumerate(found, 1):
            name = f"{path.stem}-{number}.png"
            ((IMAGES if update else folder) / name).write_bytes(figure)
        print(f"{path.name}: {len(found)} figures, {time.monotonic() - start:.1f} s")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
