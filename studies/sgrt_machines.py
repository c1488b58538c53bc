"""Figure 3 of the SGRT paper on the units of its line: the default machine, the SGRT of 2013 and the T&I engine of 2011."""

from .common import SGRT_SCENES, geometric_mean

PRESETS = ["sgrt-paper", "sgrt-2013", "tni-2011"]
# Values of the presets that no available text states, each halved and doubled on its own.
ASSUMED = ["tni.units", "tni.trv_pipelines", "tni.ist_pipelines", "tni.rays_in_flight", "cache.node_l1_bytes", "cache.triangle_l1_bytes", "cache.l2_bytes"]


def run(study):
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
