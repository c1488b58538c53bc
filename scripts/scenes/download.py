"""Source files of scenes by published address, size and SHA-256 (sources.csv)."""

import csv
import hashlib
import urllib.request
from pathlib import Path

SOURCES = Path(__file__).with_name("sources.csv")
CHUNK = 1 << 20
TIMEOUT_S = 30


class Unreachable(Exception):
    """No answer from the address, or no such file there."""


class WrongFile(Exception):
    """A file that is not the one of the table."""


def sha256(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while chunk := file.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def copy(address, path):
    try:
        with urllib.request.urlopen(address, timeout=TIMEOUT_S) as answer, open(path, "wb") as file:
            while chunk := answer.read(CHUNK):
                file.write(chunk)
    except (urllib.error.URLError, TimeoutError, ConnectionError) as error:
        raise Unreachable(f"{address}: {getattr(error, 'reason', error)}") from error


def source(name, folder, table=SOURCES):
    """The folder with the files of a source. A file that is there already is only checked."""
    folder = folder / name
    folder.mkdir(parents=True, exist_ok=True)
    with open(table, newline="") as rows:
        for row in csv.DictReader(rows):
            if row["source"] == name:
                fetch(row, folder / row["file"])
    return folder


def fetch(row, path):
    if path.is_file():
        check(row, path, path)
        return
    part = path.with_name(path.name + ".part")
    try:
        copy(row["address"], part)
        check(row, part, row["address"])
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def check(row, path, shown):
    found = path.stat().st_size, sha256(path)
    if found != (int(row["bytes"]), row["sha256"]):
        raise WrongFile(f"{shown}: expected {row['bytes']} bytes, SHA-256 {row['sha256']}; found {found[0]} bytes, {found[1]}")
