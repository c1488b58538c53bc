"""Measures each distinct shader of the folders in MODULES: `compile_times.py PROGRAM MODULES TABLE.csv`, called by
compile-times.sh."""

import csv
import hashlib
import io
import os
import pathlib
import platform
import subprocess
import sys

PROGRAM, MODULES, TABLE = sys.argv[1:]
TURNS = os.environ.get("TURNS", "1")
NAMES = {
    "three": "three.js", "babylon": "Babylon.js", "pixi": "PixiJS", "playcanvas": "PlayCanvas",
    "openarena": "OpenArena (zink)", "supertux": "SuperTux (zink)",
}
COLUMNS = ["program", "shader", "words", "recording words", "texture reads", "plain ms", "recorded ms", "recorded over plain"]


def main():
    rows, seen = [], set()
    for name, program in NAMES.items():
        folder = pathlib.Path(MODULES, name)
        for module in sorted(folder.glob("*-program.spv")):
            # Pipelines share shaders.
            digest = hashlib.sha256(module.read_bytes()).digest()
            if digest in seen:
                module.with_name(module.name.replace("-program", "-recording")).unlink(missing_ok=True)
            seen.add(digest)
        if not folder.is_dir():
            continue
        environment = {**os.environ, "MESA_SHADER_CACHE_DISABLE": "true"}
        measured = subprocess.run([PROGRAM, "--turns", TURNS, str(folder)], stdout=subprocess.PIPE, text=True, check=True, env=environment)
        for number, row in enumerate(csv.DictReader(io.StringIO(measured.stdout))):
            plain, recorded = float(row["plain ms"]), float(row["recorded ms"])
            sizes = [row["words"], row["recording words"], row["samples"]]
            rows.append([program, number, *sizes, row["plain ms"], row["recorded ms"], f"{recorded / plain:.2f}"])
    with open(TABLE + ".new", "w", newline="") as file:
        file.write("# command: scripts/compile-times.sh\n")
        file.write(f"# machine: {os.cpu_count()} cores, {platform.machine()}, load average {os.getloadavg()[0]:.1f} at the end\n")
        file.write(f"# times: least processor time of {TURNS} turns, caches off\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(rows)
    os.replace(TABLE + ".new", TABLE)


main()
