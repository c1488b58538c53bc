"""Error detection of stereo reprojection, rule by rule: two tables, and the chart of docs/results/sgrt-readings.md."""

import math

from .common import FAINT, SGRT_SCENES, energy_14_nm, geometric_mean, svg_text, write_svg

# Not used while the rules were designed.
HELD_OUT = ["stk-black-forest", "crytek-sponza", "teapot_16k", "chess_42k", "bmw_55k"]
STRICT = "depth=0.02+row=0.02+object+opaque"
RULES = [
    "none", f"{STRICT}+gap+triangles+shadow-edge", f"{STRICT}+triangles+shadow-edge", "triangles+shadow-edge", "row=0.02+triangles+shadow-edge",
    "object+opaque+triangles+shadow-edge", f"{STRICT}+silhouette+triangles+shadow-edge", "triangles+oracle=0.02", "triangles+oracle=0.05",
]
DETECTIONS = {
    "plain reuse, rows in DRAM": "--preset sgrt-paper --reuse shadow",
    f"primary hits, rows in DRAM: `{STRICT}+triangles`": f"--preset sgrt-paper --reuse primary --rule {STRICT}+triangles",
    **{f"on chip: `{rule}`": f"--rule {rule}" for rule in RULES},
}
DETAIL = "replay reproject, 2048x1024 per eye"
# Goals: energy at most, FLIP below, and performance at least this share of plain reuse's.
ENERGY, FLIP, PERFORMANCE = 0.95, 0.01, 0.97


def measured(row, plain):
    """A scene's figures; performance also over that of plain reuse."""
    scene, performance = row["scene"].rsplit("/")[-1], float(row["relative_performance"])
    return {
        "scene": scene, "set": "design" if scene in SGRT_SCENES else "held out", "flip": float(row["flip_mean"]), "energy": float(row["relative_energy"]),
        "performance": performance, "of plain": performance / plain.setdefault(scene, performance), "kib": f"{float(row['detection_sram_kib']):.0f}", "row": row}


def summary(detection, name, rows):
    worst = max(rows, key=lambda row: row["flip"])
    mean = lambda key: geometric_mean(row[key] for row in rows)
    return [
        detection, name, f"{worst['flip']:.4f} ({worst['scene']})", sum(row["flip"] < FLIP for row in rows), len(rows), f"{mean('performance'):.3f}",
        f"{100 * (mean('of plain') - 1):+.1f}", f"{mean('energy'):.3f}", f"{max(row['energy'] for row in rows):.2f}",
        energy_14_nm([row["row"] for row in rows]), rows[0]["kib"]]


# The chart.

# Okabe and Ito's colours; oracles in grey.
COLOURS = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#d55e00", "#cc79a7", "#0072b2", "#7a4f2a"]
GREYS = ["#c4c9cf", "#a6acb4", "#878e97", "#6a717a"]
GRID = "#e3e6ea"
WIDTH, PANEL, TOP, BOTTOM, LEFT = 1200, 500, 74, 474, 76
FLIPS = (1e-4, 0.2)


def height_of(flip):
    share = math.log(max(flip, FLIPS[0]) / FLIPS[0]) / math.log(FLIPS[1] / FLIPS[0])
    return BOTTOM - share * (BOTTOM - TOP)


def colours():
    oracles, others = iter(GREYS), iter(COLOURS)
    return {name: next(oracles if "oracle" in name else others) for name in DETECTIONS}


def marker(x, y, colour, held_out, title, size=4.5):
    kind, place = (("rect", f'x="{x - size:.1f}" y="{y - size:.1f}" width="{2 * size}" height="{2 * size}"') if held_out
                   else ("circle", f'cx="{x:.1f}" cy="{y:.1f}" r="{size + 0.5}"'))
    return f'<{kind} {place} fill="{colour}" fill-opacity="0.75" stroke="#ffffff" stroke-width="0.8"><title>{title}</title></{kind}>'


def line(x1, x2, y1, y2):
    return f'<line x1="{x1:.1f}" x2="{x2:.1f}" y1="{y1:.1f}" y2="{y2:.1f}" stroke="{GRID}"/>'


def panel(left, title, found, key, goal):
    """FLIP over a measure: a marker per detection and scene."""
    values = [row[key] for rows in found.values() for row in rows]
    low, high = math.floor(min(values) * 10) / 10, math.ceil(max(values) * 10) / 10
    place = lambda value: left + (value - low) / (high - low) * PANEL
    out = [svg_text(left, TOP - 14, title, 14, weight="600")]
    for step in range(round((high - low) * 10) + 1):
        value = low + step / 10
        if step % 2 == 0 or high - low < 0.7:
            out += [line(place(value), place(value), TOP, BOTTOM), svg_text(place(value), BOTTOM + 18, f"{value:.1f}", 12, FAINT, "middle")]
    for flip in (1e-4, 1e-3, 1e-2, 1e-1):
        out += [line(left, left + PANEL, height_of(flip), height_of(flip)), svg_text(left - 8, height_of(flip) + 4, f"{flip:g}", 12, FAINT, "end")]
    # Less energy is better, and more performance.
    start, end, words, anchor = (low, goal, place(goal) - 6, "end") if key == "energy" else (goal, high, place(goal) + 6, "start")
    out += [f'<rect x="{place(start):.1f}" y="{height_of(FLIP):.1f}" width="{place(end) - place(start):.1f}" height="{BOTTOM - height_of(FLIP):.1f}" '
            'fill="#009e73" fill-opacity="0.08"/>', svg_text(words, height_of(FLIP) + 16, "goal", 12, "#00704f", anchor)]
    for name, rows in found.items():
        for row in rows:
            title = (f"{name.replace('`', '')}, {row['scene']}: FLIP {row['flip']:.4f}, energy {row['energy']:.3f}, "
                     f"performance {row['performance']:.3f}")
            out.append(marker(place(row[key]), height_of(row["flip"]), colours()[name], row["set"] != "design", title))
    return out


def legend():
    out = [svg_text(LEFT, BOTTOM + 62, "Circles: scenes of the design. Squares: held-out scenes. Below 0.0001 a FLIP is drawn at 0.0001.", 12, FAINT)]
    for number, name in enumerate(DETECTIONS):
        x, y = LEFT + (number % 2) * 560, BOTTOM + 86 + (number // 2) * 20
        out += [marker(x + 5, y - 4, colours()[name], False, name.replace("`", "")), svg_text(x + 18, y, name.replace("`", ""), 12)]
    return out


def draw(path, found):
    middle = (TOP + BOTTOM) / 2
    parts = [svg_text(LEFT, 30, "Error detection: image error against energy and performance", 17, weight="600"),
             svg_text(20, middle, "mean FLIP", 12, FAINT, "middle", more=f' transform="rotate(-90 20 {middle})"'),
             *panel(LEFT, "Energy over tracing both eyes", found, "energy", ENERGY),
             *panel(LEFT + PANEL + 100, "Performance over plain reuse of the same scene", found, "of plain", PERFORMANCE), *legend()]
    write_svg(path, WIDTH, BOTTOM + 86 + 20 * -(-len(DETECTIONS) // 2) + 10, parts)


def run(study):
    for scene in HELD_OUT:
        study.scene(scene)
    traces = sorted(study.rays(scene, "--size 2048x1024") for scene in [*SGRT_SCENES, *HELD_OUT])
    found, plain = {}, {}
    for detection, flags in DETECTIONS.items():
        found[detection] = [measured(row, plain) for row in study.csv("reproject", *traces, flags) if row["run"] == "chosen"]
    summaries, single = [], []
    for detection, rows in found.items():
        for name in ("design", "held out"):
            own = [row for row in rows if row["set"] == name]
            summaries.append(summary(detection, name, own))
            single += [[detection, name, row["scene"], f"{row['flip']:.5f}", f"{row['energy']:.3f}", f"{row['performance']:.3f}", row["kib"]] for row in own]
    study.write(
        "sgrt-detection", DETAIL,
        "detection | scenes | worst FLIP | scenes below 0.01 | of | performance | against plain reuse % | energy | worst energy | energy at 14 nm | "
        "row buffers KiB", summaries)
    study.write("sgrt-detection-scenes", DETAIL, "detection | set | scene | FLIP | energy | performance | row buffers KiB", single)
    draw(study.picture("sgrt-detection"), found)
