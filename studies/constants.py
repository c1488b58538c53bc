"""Tables of both papers' models. constants.csv says what each constant means and where it comes from."""

import tomllib
from pathlib import Path

from .common import Failed, read_csv

def value(found, key):
    for part in key.split("."):
        found = found[int(part)] if part.isdigit() else found[part]
    if isinstance(found, bool):
        return str(found).lower()
    return ", ".join(f"{v}" for v in found.values()) if isinstance(found, dict) else found


def run(study):
    rows = read_csv(Path(__file__).with_suffix(".csv"))

    def write(model, detail, **configs):
        """A column of values for each configuration."""
        table = []
        for row in (row for row in rows if row["model"] == model):
            key = row["key"].replace("level.0", "l1").replace("level.1", "l2")
            table.append([f"`{key}`", *(value(config, row["key"]) for config in configs.values()), row["meaning"], row["source"]])
        study.write(f"{model}-constants", detail, " | ".join(["key", *configs, "meaning", "source"]), table)

    config = lambda words: tomllib.loads(study.replay(words, "--print-config").out)
    write("z2", "replay run --print-config, replay run --preset z2-paper --print-config", **{
        "default": config("run"), "`--preset z2-paper`": config("run --preset z2-paper")})
    sgrt = config("reproject")
    found = {f"{table}.{key}" for table, keys in sgrt.items() for key in keys}
    known = {row["key"] for row in rows if row["model"] == "sgrt"}
    if found != known:
        raise Failed(f"constants.csv: keys without a row, or rows without a key: {sorted(found ^ known)}")
    write("sgrt", "replay reproject --print-config", value=sgrt)
