"""The drawings of docs/models: tile orders as `replay` runs them, and the geometry of the models with their default constants."""

import json
import math
import re
import tomllib

from .common import FAINT, INK, svg_text, write_svg

# Okabe and Ito's colours, darker where text on white needs it.
BLUE, VERMILION, GREEN, PURPLE, LINE = "#0072b2", "#b34a00", "#00704f", "#8a3d6b", "#c9ced4"
HEADS = "".join(
    f'<marker id="{name}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8Z" fill="{colour}"/></marker>'
    for name, colour in (("ink", FAINT), ("blue", BLUE), ("red", VERMILION), ("green", GREEN)))
DEFS = f"<defs>{HEADS}</defs>"


def path(points, colour=FAINT, head="ink", width=1.4, more=""):
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    end = f' marker-end="url(#{head})"' if head else ""
    return f'<polyline points="{places}" fill="none" stroke="{colour}" stroke-width="{width}"{end}{more}/>'


def rect(x, y, width, height, fill="#ffffff", stroke=LINE, more=""):
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" stroke="{stroke}"{more}/>'


def dot(x, y, colour, size=4):
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size}" fill="{colour}"/>'


def block(x, y, width, height, title, *lines, fill="#f3f5f7"):
    """A box with a title and lines of text."""
    top = y + (height - 16 * len(lines)) / 2 + 5
    return [rect(x, y, width, height, fill, more=' rx="4"'), svg_text(x + width / 2, top, title, 13, anchor="middle", weight="600"),
            *(svg_text(x + width / 2, top + 16 * (n + 1), line, 12, FAINT, "middle") for n, line in enumerate(lines))]


DASHED = ' stroke-dasharray="5 4"'

# Tile orders. The eyes of this display shift a point at infinity by one tile at this size.
VIEW, COLUMNS, ROWS, CELL = "--hmd quest2 --size 128x96", 8, 6, 24
ORDERS = {
    "scanline": ("Scanline", "one eye after the other, row by row"),
    "zig-zag": ("Zig-zag", "one eye after the other, rows in alternating direction"),
    "morton": ("Morton", "one eye after the other, Z curve"),
    "z2-lrta": ("Z2 LRTA", "left and right tile in turn, Z curve"),
    "z2-sta": ("Z2 STA", "both tiles at a place are one work item, Z curve"),
    "zig-zag+sta+offset": ("zig-zag+sta+offset", "rows; tiles paired where points at infinity coincide"),
}


def work_items(study, trace, order):
    """The tiles of each work item of one core, (eye, column, row), in the order of the replay's time line."""
    timeline = study.work / "timeline.json"
    study.replay("run --cores 1 --tile-px 16 --quiet --order", order, trace, "--timeline", timeline)
    events = [event for event in json.loads(timeline.read_text())["traceEvents"] if "start_cycle" in event.get("args", {})]
    for event in sorted(events, key=lambda event: event["args"]["start_cycle"]):
        yield [(eye, int(column), int(row)) for eye, column, row in re.findall(r"(left|right) (\d+),(\d+)", event["name"])]


def order_panel(x, y, title, caption, items):
    middle = lambda eye, column, row: (x + (eye == "right") * (COLUMNS * CELL + 12) + (column + 0.5) * CELL, y + 46 + (row + 0.5) * CELL)
    half, tiles, numbers, paths = CELL / 2, [], [], []
    for number, item in enumerate(items):
        for left, top in (middle(*tile) for tile in item):
            shade = 0.05 + 0.5 * number / len(items)
            tiles.append(f'<rect x="{left - half:g}" y="{top - half:g}" width="{CELL}" height="{CELL}" fill-opacity="{shade:.2f}"/>')
            numbers.append(f'<text x="{left:g}" y="{top + 4:g}">{number}</text>')
    for eye in ("left", "right"):
        paths.append(path([middle(*tile) for item in items for tile in item if tile[0] == eye], VERMILION, "", 1.2, ' stroke-opacity="0.7"'))
        paths.append(svg_text(middle(eye, COLUMNS / 2 - 0.5, 0)[0], y + 46 + ROWS * CELL + 15, f"{eye} eye", 11, FAINT, "middle"))
    return [svg_text(x, y + 14, title, 14, weight="600"), svg_text(x, y + 31, caption, 12, FAINT), f'<g fill="{BLUE}" stroke="#ffffff">', *tiles, "</g>", *paths,
            f'<g font-size="11" text-anchor="middle" fill="{INK}" paint-order="stroke" stroke="#ffffff" stroke-width="2" stroke-opacity="0.6">', *numbers, "</g>"]


def tile_orders(study):
    trace, parts = study.raster("atrium", VIEW, name="quest2-small"), []
    for number, (order, (title, caption)) in enumerate(ORDERS.items()):
        items = list(work_items(study, trace, order))
        assert sum(map(len, items)) == 2 * COLUMNS * ROWS, order
        parts += order_panel(20 + number % 2 * 430, 14 + number // 2 * 224, title, caption, items)
    write_svg(study.picture("tile-orders"), 866, 14 + 3 * 224, parts)


def texture_unit(study):
    machine = tomllib.loads(study.replay("run --print-config").out)
    loop, unit = machine["tmu"]["loop_cycles"], machine["tmu"]
    near = machine["level"][1]["hit_cycles"]
    far = near + machine["memory_cycles"]
    parts = [
        DEFS, *block(30, 40, 150, 74, "Quads of the tile", "new threads"), *block(250, 40, 150, 74, "Issue", "looping threads first,", "then new ones"),
        *block(470, 40, 160, 74, "Tag check", "one footprint per cycle;", f"{unit['retry_footprints']} pending ones per slot"),
        *block(690, 40, 140, 74, "Filter", "one footprint", "per cycle", fill="#e3f2ec"),
        *block(470, 190, 160, 58, "L2", f"line after {near} cycles"), *block(690, 190, 140, 58, "Memory", f"line after {far} cycles"),
        path([(180, 77), (248, 77)]), path([(400, 77), (468, 77)]), path([(630, 77), (688, 77)], GREEN, "green"), svg_text(659, 68, "hit", 12, GREEN, "middle"),
        path([(520, 114), (520, 150), (325, 150), (325, 116)], VERMILION, "red"),
        svg_text(318, 168, f"miss: the thread is back {loop} cycles", 12, VERMILION), svg_text(318, 184, "after it entered, with pending footprints", 12, VERMILION),
        path([(580, 114), (580, 188)], BLUE, "blue"), svg_text(588, 140, f"at most {unit['fetches_per_trip']} lines", 12, BLUE), svg_text(588, 156, "per trip", 12, BLUE),
        path([(630, 219), (688, 219)], BLUE, "blue"),
    ]
    top, place = 316, lambda cycle: 190 + cycle * 2.3
    last = -(-far // loop) * loop
    parts.append(svg_text(30, top - 26, "The trips of a quad of which all footprints need the same line, in cycles", 14, weight="600"))
    for row, (words, wait) in enumerate((("line in the L2", near), ("line in memory", far))):
        y = top + row * 56
        parts += [svg_text(30, y + 14, words, 13), rect(place(0), y + 2, place(wait) - place(0), 16, BLUE, "none", ' fill-opacity="0.25"'),
                  svg_text(place(wait) + 6, y + 14, f"line arrives, {wait}", 12, BLUE) if wait == near else
                  svg_text(place(wait) - 6, y + 14, f"line arrives, {wait}", 12, BLUE, "end")]
        for trip in range(0, -(-wait // loop) * loop + 1, loop):
            done = trip >= wait
            parts += [dot(place(trip), y + 26, GREEN if done else VERMILION, 5),
                      svg_text(place(trip), y + 44, f"{trip}: filtered" if done else f"{trip}: miss", 12, GREEN if done else VERMILION, "middle")]
    assert place(last) < 810
    write_svg(study.picture("texture-unit"), 860, top + 110, parts)


def meeting(start, direction, objects):
    """The nearest object that a ray in the plane meets: its name and the point. An object is a line from (x, z) to (x, z)."""
    found = []
    for name, ((x0, z0), (x1, z1)) in objects.items():
        # start + z * direction = x0 + s * (x1 - x0), with z = z0 + s * (z1 - z0)
        slope = (x1 - x0) - direction * (z1 - z0)
        s = (start + direction * z0 - x0) / slope if slope else -1
        if 0 <= s <= 1:
            found.append((z0 + s * (z1 - z0), name))
    z, name = min(found)
    return name, (start + direction * z, z)


def reprojection(study):
    half, pixels, edge = 0.3, 24, 0.6  # eyes, pixels of a row, tangent at the picture's edge
    objects = {"wall": ((-9, 6), (9, 6)), "box": ((-0.2, 3), (0.9, 3)), "panel": ((-0.84, 2), (-1.66, 5))}
    centre = lambda pixel: -edge + (pixel + 0.5) * 2 * edge / pixels
    left = [meeting(-half, centre(pixel), objects) for pixel in range(pixels)]
    right = [meeting(half, centre(pixel), objects)[0] for pixel in range(pixels)]
    arrived = {}
    for pixel, (name, (x, z)) in enumerate(left):
        place = math.floor(((x - half) / z + edge) * pixels / (2 * edge))
        if 0 <= place < pixels and (place not in arrived or z < arrived[place][0]):
            arrived[place] = (z, pixel, name)
    top, scale, size, start = 300, 43, 30, 70
    at = lambda x, z: (430 + 88 * x, top - scale * z)
    parts = [DEFS, svg_text(20, 24, "From above", 14, weight="600")]
    for name, ends in objects.items():
        parts.append(path([at(max(-4.0, min(4.0, x)), z) for x, z in ends], INK, "", 4))
    parts += [svg_text(*at(3.0, 6.2), "wall", 12), svg_text(*at(0.2, 3.15), "box", 12), svg_text(*at(-1.3, 4.3), "panel", 12)]
    reused = lambda name: next(pixel for place, (_, pixel, arriving) in sorted(arrived.items()) if arriving == name == right[place])
    wrong = [place for place, (_, _, name) in arrived.items() if name != right[place]]
    for pixel, colour, more in ((reused("box"), GREEN, ""), (arrived[wrong[0]][1], VERMILION, DASHED)):
        hit = left[pixel][1]
        parts += [path([at(-half, 0), at(*hit)], colour, "", 1.5, more), path([at(*hit), at(half, 0.12)], colour, "red" if more else "green", 1.5, more), dot(*at(*hit), colour)]
    parts += [dot(*at(-half, 0), BLUE, 6), dot(*at(half, 0), BLUE, 6), svg_text(at(-half, 0)[0] - 12, top + 4, "left eye", 12, BLUE, "end"),
              svg_text(at(half, 0)[0] + 12, top + 4, "right eye", 12, BLUE)]
    tones = {"wall": "#eceff2", "box": "#9db7cc", "panel": "#cdbfa5"}
    parts += [svg_text(20, 350, "Row of the left picture: all pixels are traced; number of the pixel, shade of what it shows", 13),
              svg_text(20, 420, "The same row of the right picture: number of the left pixel that arrives, border by what happens", 13)]
    for pixel in range(pixels):
        x = start + pixel * size
        parts += [rect(x + 1, 360, size - 2, 28, tones[left[pixel][0]]), svg_text(x + size / 2, 378, pixel, 12, anchor="middle")]
        _, source, name = arrived.get(pixel, (0, "", ""))
        colour, more = (INK, DASHED) if not name else (GREEN, "") if name == right[pixel] else (VERMILION, DASHED)
        parts += [rect(x + 1.5, 431, size - 3, 28, tones[right[pixel]], colour, f' stroke-width="2"{more}'), svg_text(x + size / 2, 449, source, 12, anchor="middle")]
    for x, colour, more, words in ((20, GREEN, "", "reused"), (110, VERMILION, DASHED, "rejected: the right ray meets another surface; traced"),
                                   (480, INK, DASHED, "nothing arrives: the left eye does not see it; traced")):
        parts += [rect(x, 478, 18, 14, "#ffffff", colour, f' stroke-width="2"{more}'), svg_text(x + 26, 490, words, 12)]
    write_svg(study.picture("reprojection"), 860, 508, parts)


def far_field(study):
    width_px, degrees, ipd_m, budget_px = 960, 100, 0.064, 1
    k = width_px * ipd_m / (4 * math.tan(math.radians(degrees / 2)))
    plain, shifted = k / budget_px, k / (2 * budget_px)
    eyes, camera, split, near, far = ((60, 250), (180, 250)), (120, 250), 140, (104, 190), (215, 75)
    parts = [
        DEFS, svg_text(20, 24, "From above, not to scale", 14, weight="600"),
        path([(20, split), (300, split)], INK, "", 1.4, DASHED), svg_text(300, split - 6, "split D", 12, anchor="end"),
        svg_text(20, 62, "farther: drawn once, from c", 12, PURPLE), svg_text(300, 232, "nearer: drawn", 12, BLUE, "end"), svg_text(300, 248, "for each eye", 12, BLUE, "end"),
        path([camera, far], PURPLE, "", 1.6), *(path([eye, far], PURPLE, "", 1.2, DASHED) for eye in eyes), *(path([eye, near], BLUE, "", 1.2) for eye in eyes),
        dot(*far, PURPLE, 6), dot(*near, BLUE, 6), dot(*camera, PURPLE, 6), *(dot(*eye, BLUE, 6) for eye in eyes),
        svg_text(60, 274, "left eye", 12, BLUE, "middle"), svg_text(120, 290, "camera c", 12, PURPLE, "middle"), svg_text(180, 274, "right eye", 12, BLUE, "middle"),
        svg_text(20, 320, "An eye takes the far point from the direction", 12), svg_text(20, 336, "in which c sees it. The angle between both", 12),
        svg_text(20, 352, "lines at the point is the shift.", 12),
    ]
    left, right, top, bottom, most = 400, 830, 60, 300, 1.2
    x = lambda metres: left + (right - left) * math.log(metres / 5) / math.log(200 / 5)
    y = lambda pixels: bottom - (bottom - top) * pixels / most
    parts += [svg_text(350, 24, f"Shift by distance: {width_px} pixels, {degrees} degrees, IPD {1000 * ipd_m:g} mm", 14, weight="600"),
              svg_text(350, 46, f"shift, pixels; K = {k:.1f} pixels x metres, budget e = {budget_px} pixel", 12, FAINT)]
    for metres in (5, 10, 20, 50, 100, 200):
        parts += [path([(x(metres), top), (x(metres), bottom)], "#e3e6ea", "", 1), svg_text(x(metres), bottom + 18, metres, 12, FAINT, "middle")]
    for pixels in (0, 0.5, 1):
        parts += [path([(left, y(pixels)), (right, y(pixels))], "#e3e6ea", "", 1), svg_text(left - 8, y(pixels) + 4, f"{pixels:g}", 12, FAINT, "end")]
    curve = lambda first, shift: [(x(metres), y(shift(metres))) for metres in (first * (200 / first) ** (step / 80) for step in range(81))]
    parts += [
        path(curve(plain, lambda z: k / z), BLUE, "", 2.5), path(curve(shifted, lambda z: k * abs(1 / z - 1 / (2 * shifted))), VERMILION, "", 2.5),
        dot(x(plain), y(budget_px), BLUE), dot(x(shifted), y(budget_px), VERMILION),
        svg_text(x(plain) + 8, y(budget_px) - 8, f"plain: D = K/e = {plain:.1f} m", 12, BLUE), svg_text(x(shifted) - 6, y(budget_px) - 24, f"depth-shift: D = K/(2e) = {shifted:.1f} m", 12, VERMILION),
        svg_text(x(60), y(0.28), "K/z", 12, BLUE), svg_text(x(52), y(0.95), "K |1/z \u2212 1/(2D)|", 12, VERMILION),
        svg_text((left + right) / 2, bottom + 38, "distance z, metres (logarithmic)", 12, FAINT, "middle"),
    ]
    write_svg(study.picture("far-field"), 860, 366, parts)


def closed_loop(study):
    parts = [
        DEFS, *block(20, 30, 150, 74, "Scheduler", "next tile or pair", "of tiles"), *block(230, 30, 160, 74, "Core", "warps: half of the", "instructions, reads, rest"),
        rect(440, 16, 400, 118, "none", LINE, ' rx="4"'), svg_text(830, 128, "texture unit", 12, FAINT, "end"),
        *block(456, 30, 110, 74, "Look-up", "requests", "in order"), *block(594, 30, 100, 74, "FIFO", "until the lines", "are there"), *block(722, 30, 104, 74, "Filter", "in order"),
        *block(446, 190, 130, 60, "L1", "MSHRs, merges"), *block(446, 310, 130, 60, "L2", "banks, ports"),
        *block(690, 310, 136, 60, "DRAM", "banks or rate", fill="#f6ecd9"),
        path([(170, 60), (228, 60)]), path([(390, 60), (454, 60)]), path([(566, 60), (592, 60)]), path([(694, 60), (720, 60)]),
        path([(774, 30), (774, 8), (310, 8), (310, 28)], GREEN, "green"), svg_text(262, 124, "a warp waits for all its reads", 12, GREEN),
        path([(490, 104), (490, 188)], BLUE, "blue"), svg_text(482, 158, "lines", 12, BLUE, "end"),
        path([(490, 250), (490, 308)], BLUE, "blue"), svg_text(482, 284, "misses", 12, BLUE, "end"),
        path([(576, 330), (688, 330)], BLUE, "blue"), svg_text(632, 322, "misses", 12, BLUE, "middle"),
        path([(690, 352), (578, 352)], VERMILION, "red"), svg_text(632, 370, "data", 12, VERMILION, "middle"),
        path([(540, 310), (540, 252)], VERMILION, "red"), path([(576, 220), (644, 220), (644, 106)], VERMILION, "red"), svg_text(652, 170, "data, when DRAM delivers it", 12, VERMILION),
        path([(250, 104), (250, 400), (758, 400), (758, 372)], FAINT, "ink"), svg_text(262, 392, "colour of a tile, when it is shaded", 12, FAINT),
        path([(230, 88), (172, 88)], FAINT, "ink", 1.4, DASHED), svg_text(95, 124, "room for a tile", 12, FAINT, "middle"),
    ]
    write_svg(study.picture("closed-loop"), 860, 420, parts)


def run(study):
    for draw in (tile_orders, texture_unit, reprojection, far_field, closed_loop):
        draw(study)
