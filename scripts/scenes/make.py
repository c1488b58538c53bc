"""Makes the real scenes of the results (docs/use/real-scenes.md), a line each.

Exit code 0, also if scenes are skipped; 2 if a file is not the one of sources.csv.
"""

import argparse
import csv
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path

import debian
import download

HERE = Path(__file__).parent
GAME = "usr/share/games/supertuxkart/data"
COPYRIGHT = "usr/share/doc/supertuxkart-data/copyright"


def table(name):
    with open(HERE / name, newline="") as rows:
        return list(csv.DictReader(rows))


@cache
def unpacked(source, folder):
    tracks = tuple(f"{GAME}/{part}/" for part in ("library", "textures", "tracks/cocoa_temple", "tracks/black_forest"))
    debian.unpack(source / "supertuxkart-data.deb", folder, (*tracks, COPYRIGHT))
    return folder


def convert_track(track, limit, detail, source, cameras, work, folder, name):
    import supertuxkart
    from track import Detail

    game = unpacked(source, work)
    supertuxkart.convert(game / GAME, track, Detail(*detail), limit, cameras, folder, name)
    shutil.copyfile(game / COPYRIGHT, folder / "debian-copyright.txt")


def convert(scene, source, cameras, work, folder, name):
    """Imports late: most converters need Pillow."""
    if scene == "stk-cocoa-temple":
        convert_track("cocoa_temple", 1024, (), source, cameras, work, folder, name)
    elif scene == "stk-black-forest":
        # Full detail everywhere has 1,085,000 triangles: only within 152 m of the camera cam_brook.
        convert_track("black_forest", 512, ((19.88, -9.94, -271.26), 152.0), source, cameras, work, folder, name)
    elif scene == "crytek-sponza":
        import crytek_sponza

        crytek_sponza.convert(source, cameras, folder, name)
    elif scene == "utah-teapot":
        import teapot

        teapot.convert(source, cameras, folder, name)


def make(row, out, work):
    """Makes one scene under a temporary name and returns the line about it."""
    scene = row["scene"]
    if (out / scene).exists():
        return f"kept: {scene}"
    if not row["source"]:
        return f"not fetched: {scene}: {row['reason']}"
    part = work / scene
    part.mkdir()
    cameras = [camera for camera in table("cameras.csv") if camera["scene"] == scene]
    try:
        source = download.source(row["source"], out / "downloads")
        convert(scene, source, cameras, work, part, row["file"])
    except download.Unreachable as error:
        return f"skipped: {scene}: {error}"
    except ModuleNotFoundError as error:
        return f"skipped: {scene}: the Python package {error.name} is absent (Debian: python3-pil)"
    addresses = [source["address"] for source in table("sources.csv") if source["source"] == row["source"]]
    lines = ["From:", *addresses, f"Licence: {row['licence']}", "Changed: converted to glTF 2.0 by scripts/scenes of Parallax"]
    (part / "SOURCE.txt").write_text("\n".join([*lines, ""]))
    part.rename(out / scene)
    return f"made: {out / scene / row['file']}.gltf"


def main():
    parser = argparse.ArgumentParser(prog="scripts/scenes/make.py", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("scene", nargs="*", help="all by default")
    wanted = parser.parse_args()
    rows = table("scenes.csv")
    names = [row["scene"] for row in rows]
    for scene in wanted.scene:
        if scene not in names:
            raise ValueError(f"expected some of: {', '.join(names)}; found '{scene}'")
    wanted.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=wanted.folder) as work:
        for row in rows:
            if not wanted.scene or row["scene"] in wanted.scene:
                print(make(row, wanted.folder, Path(work)), flush=True)


if __name__ == "__main__":
    try:
        main()
    except (download.WrongFile, ValueError, OSError) as error:
        print(f"scripts/scenes/make.py: {error}", file=sys.stderr)
        sys.exit(2)
