"""The JSON of every command against the published schemas, in both directions."""

import json

import jsonschema
import pytest

from conftest import ROOT

EXPERIMENT = """
[base]
mode = "functional"
[axes]
order = ["morton", "z2-sta"]
[one-at-a-time]
l1.size_bytes = ["4KiB"]
"""

COMMANDS = {
    "info": ["info", "{trace}"],
    "info, rays": ["info", "{rays}"],
    "run": ["run", "{trace}"],
    "run, all parts": ["run", "{trace}", "--tiles", "--dram", "lpddr4", "--l3", "512KiB", "--prefetch", "next-line"],
    "run, by draw": ["run", "{trace}", "--count-by", "draw", "--mode", "functional"],
    "compare": ["compare", "{trace}", "{trace}"],
    "locality": ["locality", "{trace}"],
    "orders": ["orders", "{trace}", "--orders", "morton,z2-sta"],
    "paper": ["paper", "{trace}"],
    "sweep": ["sweep", "{experiment}", "{trace}", "--out", "{out}"],
    "plan": ["sweep", "{experiment}", "{trace}", "--out", "{out}", "--plan"],
    "calibrate": ["calibrate", "{trace}", "--try", "tmu.threads=32,64"],
    "reproject": ["reproject", "{rays}"],
    "readings": ["readings", "{rays}"],
}


def closed(schema):
    """The schema with every object limited to the properties that it lists."""
    if isinstance(schema, list):
        return [closed(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    schema = {key: closed(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and "type" in schema:
        schema.setdefault("additionalProperties", False)
    return schema


def published(name):
    text = (ROOT / "schemas" / (name.replace("/", "-") + ".json")).read_text()
    return json.loads(text)


@pytest.mark.parametrize("name", COMMANDS)
def test_output_has_its_schema(replay, traces, tmp_path, name):
    experiment = tmp_path / "experiment.toml"
    experiment.write_text(EXPERIMENT)
    places = {
        "trace": traces / "atrium.textrace",
        "rays": traces / "teapot-rays.raytrace",
        "experiment": experiment,
        "out": tmp_path / "out",
    }
    command = [part.format(**places) for part in COMMANDS[name]]
    printed = json.loads(replay(*command, "--json").stdout)
    schema = published(printed["schema"])
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(closed(schema)).validate(printed)


def test_a_missing_and_an_unknown_key_are_found(replay, traces):
    printed = json.loads(replay("run", traces / "atrium.textrace", "--json").stdout)
    validator = jsonschema.Draft202012Validator(closed(published(printed["schema"])))
    del printed["result"]["quads"]
    assert not validator.is_valid(printed)
    printed["result"]["quads"] = 1
    assert validator.is_valid(printed)
    printed["result"]["quadz"] = 1
    assert not validator.is_valid(printed)
