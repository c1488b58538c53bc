"""Figure 3 of the SGRT paper on the units of its line: the default machine, the SGRT of 2013 and the T&I engine of 2011."""

import tomllib

from .common import SGRT_SCENES, geometric_mean

PRESETS = ["sgrt-paper", "sgrt-2013", "tni-2011"]
# Values of the presets that no available text states, each halved and doubled on its own.
ASSUMED = ["tni.units", "tni.trv_pipelines", "tni.ist_pipelines", "tni.rays_in_flight", "cache.node_l1_bytes", "cache.triangle_l1_bytes", "cache.l2_bytes"]

# Values that differ from the defaults or count most, and where they are from.
VALUES = {
    "tni.units": "assumption, 2 to 8",
    "tni.trv_pipelines": "assumption, 2 to 8 and 12 to 48",
    "tni.trv_cycles_per_step": "2013: a box per cycle, as T&I unit 2.0 is the first with two. 2011: a traversal unit has one adder and one multiplier, and a step of two "
                               "boxes takes 12 of each operation. That engine traverses a kd-tree; here its units step through the trace's tree",
    "tni.trv_cycles_per_wide_step": "four times the boxes",
    "tni.ist_pipelines": "assumption, 0.5 to 2 times",
    "tni.rays_per_cycle": "2011: the dispatcher supplies one ray per cycle. 2013: assumption",
    "tni.rays_in_flight": "assumption, 0.5 to 2 times. 2011: buffers of 128 rays at input and output, and an accumulation buffer for each pipeline, of unknown size",
    "cache.node_l1_bytes": "assumption, 0.5 to 2 times. 2011: an L1 for each pipeline; here the pipelines of a unit share one",
    "cache.triangle_l1_bytes": "the same",
    "cache.l2_bytes": "assumption, 0.5 to 2 times. 2011: an L2 each for traversal, lists and intersection; here one",
    "cycles.l1_mshrs": "assumption; only for `--timing cycle`",
}


def run(study):
    machines = [tomllib.loads(study.replay("reproject --print-config --preset", preset).out) for preset in PRESETS[1:]]
    rows = [[f"`{key}`", *(f"{of[key.split('.')[0]][key.split('.')[1]]:g}" for of in machines), source] for key, source in VALUES.items()]
    study.write("sgrt-machine-values", "replay reproject --preset PRESET --print-config", " | ".join(["key", *PRESETS[1:], "source"]), rows)
    traces = [study.rays(scene, "--size 256x256 --visits") for scene in SGRT_SCENES]
    found = {preset: [row for row in study.csv("reproject", *traces, "--preset", preset) if row["run"] == "chosen"] for preset in PRESETS}
    table = []
    for rows in zip(*found.values()):
        figures = lambda key: [f"{float(row[key]):.2f}" for row in rows]
        table.append([rows[0]["scene"], *(cell for what in ("relative_performance", "relative_energy") for cell in (rows[0][f"paper_{what}"], *figures(what)))])
    detail = "tracegen rays SCENE --size 256x256 --visits, replay reproject *.raytrace --preset PRESET"
    study.write("sgrt-machines", f"{detail} --csv", " | ".join(["scene", *(f"{what}: {of}" for what in ("performance", "energy") for of in ("paper", *PRESETS))]), table)
    ranges = []
    reports = {preset: [study.json("reproject --sensitivity", trace, "--preset", preset) for trace in traces] for preset in PRESETS[1:]}
    for key in ASSUMED:
        cells = []
        for of_preset in reports.values():
            rows = [row for report in of_preset for row in report["sensitivity"] if row["parameter"] == key]
            ends = lambda what: " to ".join(f"{geometric_mean(row[what][end] for row in rows):.3f}" for end in (0, 1))
            cells += [f"{rows[0]['value']:g}", ends("relative_performance"), ends("relative_energy")]
        ranges.append([f"`{key}`", *cells])
    study.write("sgrt-machines-ranges", f"{detail} --sensitivity --json", " | ".join(["key", *(f"{preset}: {what}" for preset in PRESETS[1:] for what in ("value", "performance, half to double", "energy, half to double"))]), ranges)
