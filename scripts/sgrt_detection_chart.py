"""Chart of error detection from results/sgrt-detection-scenes.csv: sgrt_detection_chart.py RESULTS PICTURE.svg"""

import csv
import math
import sys

results, picture = sys.argv[1:]
# Goals: energy at most, FLIP below, and performance at least this share of plain reuse's.
ENERGY, FLIP, PERFORMANCE = 0.95, 0.01, 0.97

with open(f"{results}/sgrt-detection-scenes.csv", newline="") as file:
    rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
names = list(dict.fromkeys(row["detection"] for row in rows))
plain = {row["scene"]: float(row["performance"]) for row in rows if row["detection"] == names[0]}
for row in rows:
    row["of plain"] = float(row["performance"]) / plain[row["scene"]]


# Okabe and Ito's colours; oracles in grey.
COLOURS = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#d55e00", "#cc79a7", "#0072b2", "#7a4f2a"]
GREYS = ["#c4c9cf", "#a6acb4", "#878e97", "#6a717a"]
INK, FAINT, GRID = "#1d2229", "#5b636d", "#e3e6ea"
WIDTH, PANEL, TOP, BOTTOM, LEFT = 1200, 500, 74, 474, 76
FLIPS = (1e-4, 0.2)


def text(x, y, words, size=12, fill=INK, anchor="start", more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{fill}" text-anchor="{anchor}" {more}>{words}</text>'


def height_of(flip):
    share = math.log(max(flip, FLIPS[0]) / FLIPS[0]) / math.log(FLIPS[1] / FLIPS[0])
    return BOTTOM - share * (BOTTOM - TOP)


def colours():
    oracles, others = iter(GREYS), iter(COLOURS)
    return {name: next(oracles if "oracle" in name else others) for name in names}


def marker(x, y, colour, held_out, title, size=4.5):
    shape = (f'<rect x="{x - size:.1f}" y="{y - size:.1f}" width="{2 * size}" height="{2 * size}"' if held_out
             else f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size + 0.5}"')
    return f'{shape} fill="{colour}" fill-opacity="0.75" stroke="#ffffff" stroke-width="0.8"><title>{title}</title></{"rect" if held_out else "circle"}>'


def panel(left, title, column, goal):
    """FLIP over a measure: a marker per detection and scene."""
    values = [float(row[column]) for row in rows]
    low, high = math.floor(min(values) * 10) / 10, math.ceil(max(values) * 10) / 10
    place = lambda v: left + (v - low) / (high - low) * PANEL
    out = [text(left, TOP - 14, title, 14, more='font-weight="600"')]
    for step in range(round((high - low) * 10) + 1):
        value = low + step / 10
        if step % 2 == 0 or high - low < 0.7:
            out += [f'<line x1="{place(value):.1f}" x2="{place(value):.1f}" y1="{TOP}" y2="{BOTTOM}" stroke="{GRID}"/>',
                    text(place(value), BOTTOM + 18, f"{value:.1f}", fill=FAINT, anchor="middle")]
    for flip in (1e-4, 1e-3, 1e-2, 1e-1):
        out += [f'<line x1="{left}" x2="{left + PANEL}" y1="{height_of(flip):.1f}" y2="{height_of(flip):.1f}" stroke="{GRID}"/>',
                text(left - 8, height_of(flip) + 4, f"{flip:g}", fill=FAINT, anchor="end")]
    least = column == "energy"
    start, end = (place(low), place(goal)) if least else (place(goal), place(high))
    out += [f'<rect x="{start:.1f}" y="{height_of(FLIP):.1f}" width="{end - start:.1f}" height="{BOTTOM - height_of(FLIP):.1f}" fill="#009e73" fill-opacity="0.08"/>',
            text(end - 6 if least else start + 6, height_of(FLIP) + 16, "goal", fill="#00704f", anchor="end" if least else "start")]
    for row in rows:
        flip, name = float(row["FLIP"]), row["detection"]
        what = f"{name.replace('`', '')}, {row['scene']}: FLIP {flip:.4f}, energy {row['energy']}, performance {row['performance']}"
        out.append(marker(place(float(row[column])), height_of(flip), colours()[name], row["set"] != "design", what))
    return out


def legend():
    out = [text(LEFT, BOTTOM + 62, "Circles: scenes of the design. Squares: held-out scenes. Below 0.0001 a FLIP is drawn at 0.0001.", fill=FAINT)]
    for number, name in enumerate(names):
        x, y = LEFT + (number % 2) * 560, BOTTOM + 86 + (number // 2) * 20
        out += [marker(x + 5, y - 4, colours()[name], False, name.replace("`", "")), text(x + 18, y, name.replace("`", ""))]
    return out


def write_picture():
    second = LEFT + PANEL + 100
    parts = [text(LEFT, 30, "Error detection: image error against energy and performance", 17, more='font-weight="600"'),
             text(20, (TOP + BOTTOM) / 2, "mean FLIP", fill=FAINT, anchor="middle", more=f'transform="rotate(-90 20 {(TOP + BOTTOM) / 2})"'),
             *panel(LEFT, "Energy over tracing both eyes", "energy", ENERGY),
             *panel(second, "Performance over plain reuse of the same scene", "of plain", PERFORMANCE), *legend()]
    height = BOTTOM + 86 + 20 * -(-len(names) // 2) + 10
    with open(picture, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
                   'font-family="system-ui, -apple-system, \'Segoe UI\', \'Helvetica Neue\', Arial, sans-serif">\n'
                   f'<rect width="{WIDTH}" height="{height}" rx="8" fill="#ffffff"/>\n' + "\n".join(parts) + "\n</svg>\n")


write_picture()
