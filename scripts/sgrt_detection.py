"""Tables and chart of error detection from what scripts/sgrt-detection.sh measured: sgrt_detection.py RESULTS PICTURE.svg RULE..."""

import csv
import math
import sys

results, picture, rules = sys.argv[1], sys.argv[2], sys.argv[3:]
DESIGN = ["teapot", "chess", "car", "lab", "music-box", "meadow"]
# Goals: energy at most, FLIP below.
ENERGY, FLIP = 0.95, 0.01


def rows(name):
    with open(name, newline="") as file:
        return [row for row in csv.DictReader(file) if row["run"] == "chosen"]


def write(name, heading, table):
    with open(f"{results}/{name}.csv", "w", newline="") as file:
        file.write("# command: scripts/sgrt-detection.sh SCENES  (replay reproject, 2048x1024 per eye)\n")
        csv.writer(file, lineterminator="\n").writerows([heading, *table])


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def at_14_nm(of):
    """Geometric means of the bounds of relative energies on a 14 nm chip."""
    return "-".join(f"{mean([float(r[f'relative_energy_{end}']) for r in of]):.2f}" for end in ("least", "most"))


def scene(row):
    return row["scene"].rsplit("/")[-1]


def measured(row):
    """FLIP, energy and performance."""
    return tuple(float(row[key]) for key in ("flip_mean", "relative_energy", "relative_performance"))


cases = [("plain reuse, rows in DRAM", rows("plain.csv")), ("default of replay reproject", rows("default.csv"))]
cases += [(f"on chip: `{rule}`", rows(f"on-chip,{rule}.csv")) for rule in rules]
plain = {scene(r): float(r["relative_performance"]) for r in cases[0][1]}


def sets(of):
    return [(name, [r for r in of if (scene(r) in DESIGN) == (name == "design")]) for name in ("design", "held out")]


def write_tables():
    summary, single = [], []
    for name, found in cases:
        for label, of in sets(found):
            flips = {scene(r): measured(r)[0] for r in of}
            worst = max(flips, key=flips.get)
            faster = mean([measured(r)[2] / plain[scene(r)] for r in of])
            summary.append([name, label, f"{flips[worst]:.4f} ({worst})", sum(f < FLIP for f in flips.values()), len(flips),
                            f"{mean([measured(r)[2] for r in of]):.3f}", f"{100 * (faster - 1):+.1f}", f"{mean([measured(r)[1] for r in of]):.3f}",
                            f"{max(measured(r)[1] for r in of):.2f}", at_14_nm(of), f"{float(of[0]['detection_sram_kib']):.0f}"])
            for row in of:
                flip, energy, performance = measured(row)
                single.append([name, label, scene(row), f"{flip:.5f}", f"{energy:.3f}", f"{performance:.3f}", f"{float(row['detection_sram_kib']):.0f}"])
    write("sgrt-detection", ["detection", "scenes", "worst FLIP", "scenes below 0.01", "of", "performance", "against plain reuse %", "energy", "worst energy",
                             "energy at 14 nm", "row buffers KiB"], summary)
    write("sgrt-detection-scenes", ["detection", "set", "scene", "FLIP", "energy", "performance", "row buffers KiB"], single)


# Okabe and Ito's colours; oracles in grey.
COLOURS = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#d55e00", "#cc79a7", "#0072b2"]
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
    found, oracle = {}, iter(GREYS)
    others = iter(COLOURS)
    for name, _ in cases:
        found[name] = next(oracle) if "oracle" in name else next(others)
    return found


def marker(x, y, colour, held_out, title, size=4.5):
    shape = (f'<rect x="{x - size:.1f}" y="{y - size:.1f}" width="{2 * size}" height="{2 * size}"' if held_out
             else f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size + 0.5}"')
    return f'{shape} fill="{colour}" fill-opacity="0.75" stroke="#ffffff" stroke-width="0.8"><title>{title}</title></{"rect" if held_out else "circle"}>'


def panel(left, title, column, goal):
    """FLIP over a measure: a marker per detection and scene."""
    values = [measured(r)[column] for _, of in cases for r in of]
    low, high = math.floor(min(values) * 10) / 10, math.ceil(max(values) * 10) / 10
    place = lambda v: left + (v - low) / (high - low) * PANEL
    out = [text(left, TOP - 14, title, 14, more='font-weight="600"')]
    for step in range(round((high - low) * 10) + 1):
        value = low + step / 10
        if step % 2 == 0:
            out += [f'<line x1="{place(value):.1f}" x2="{place(value):.1f}" y1="{TOP}" y2="{BOTTOM}" stroke="{GRID}"/>',
                    text(place(value), BOTTOM + 18, f"{value:.1f}", fill=FAINT, anchor="middle")]
    for flip in (1e-4, 1e-3, 1e-2, 1e-1):
        out += [f'<line x1="{left}" x2="{left + PANEL}" y1="{height_of(flip):.1f}" y2="{height_of(flip):.1f}" stroke="{GRID}"/>',
                text(left - 8, height_of(flip) + 4, f"{flip:g}", fill=FAINT, anchor="end")]
    start, end = (place(low), place(goal)) if column == 1 else (place(goal), place(high))
    out += [f'<rect x="{start:.1f}" y="{height_of(FLIP):.1f}" width="{end - start:.1f}" height="{BOTTOM - height_of(FLIP):.1f}" fill="#009e73" fill-opacity="0.08"/>',
            text(start + 6 if column == 2 else end - 6, height_of(FLIP) + 16, "goal", fill="#00704f", anchor="start" if column == 2 else "end")]
    for name, of in cases:
        for row in of:
            kept = measured(row)
            what = f"{name.replace('`', '')}, {scene(row)}: FLIP {kept[0]:.4f}, energy {kept[1]:.3f}, performance {kept[2]:.3f}"
            out.append(marker(place(kept[column]), height_of(kept[0]), colours()[name], scene(row) not in DESIGN, what))
    return out


def legend():
    out = [text(LEFT, BOTTOM + 62, "Circles: scenes of the design. Squares: held-out scenes. Below 0.0001 a FLIP is drawn at 0.0001.", fill=FAINT)]
    for number, (name, _) in enumerate(cases):
        x, y = LEFT + (number % 2) * 560, BOTTOM + 86 + (number // 2) * 20
        out += [marker(x + 5, y - 4, colours()[name], False, name.replace("`", "")), text(x + 18, y, name.replace("`", ""))]
    return out


def write_picture():
    second = LEFT + PANEL + 100
    goal = 0.97 * mean(list(plain.values()))
    parts = [text(LEFT, 30, "Error detection: image error against energy and performance", 17, more='font-weight="600"'),
             text(20, (TOP + BOTTOM) / 2, "mean FLIP", fill=FAINT, anchor="middle", more=f'transform="rotate(-90 20 {(TOP + BOTTOM) / 2})"'),
             *panel(LEFT, "Energy over tracing both eyes", 1, ENERGY), *panel(second, "Performance over tracing both eyes", 2, goal), *legend()]
    height = BOTTOM + 86 + 20 * -(-len(cases) // 2) + 10
    with open(picture, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
                   'font-family="system-ui, -apple-system, \'Segoe UI\', \'Helvetica Neue\', Arial, sans-serif">\n'
                   f'<rect width="{WIDTH}" height="{height}" rx="8" fill="#ffffff"/>\n' + "\n".join(parts) + "\n</svg>\n")


write_tables()
write_picture()
