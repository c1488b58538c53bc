"""Draws README.md's picture and writes its table: `overview.py FOLDER TABLE.csv PICTURE.svg`, called by overview.sh.

FOLDER holds atrium.png and a JSON result with tile maps for each order.
"""

import base64
import csv
import io
import json
import sys

from PIL import Image

TITLES = {
    "scanline": "Scanline", "zig-zag": "Zig-zag", "morton": "Morton (Z order)", "hilbert": "Hilbert",
    "z2-lrta": "Z2 LRTA", "z2-sta": "Z2 STA", "random": "Random (control)",
}
DRAWN = [order for order in TITLES if order != "random"]
# Okabe and Ito's blue for the stereo orders, grey for the others.
BLUE, GREY, INK, FAINT = "#0072b2", "#8a9099", "#1d2229", "#5b636d"
# White, yellow, orange, vermilion, dark red: few to many misses.
RAMP = [(255, 255, 255), (253, 222, 150), (230, 159, 0), (213, 94, 0), (90, 20, 10)]
PANEL_WIDTH, PANEL_HEIGHT, GAP, LEFT = 373, 210, 20, 20

folder, table_path, picture_path = sys.argv[1:]
documents = {order: json.load(open(f"{folder}/{order}.json")) for order in TITLES}
results = {order: document["result"] for order, document in documents.items()}
base = results["morton"]["external_bytes"]


def saved_pct(order):
    return 100 * (1 - results[order]["external_bytes"] / base)


def uri(image, kind, **options):
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return f"data:image/{kind.lower()};base64," + base64.b64encode(buffer.getvalue()).decode()


def colour(share):
    place = min(max(share, 0), 1) * (len(RAMP) - 1)
    low = min(int(place), len(RAMP) - 2)
    return tuple(round(a + (b - a) * (place - low)) for a, b in zip(RAMP[low], RAMP[low + 1]))


def heat_map(order, most):
    maps = results[order]["tile_maps"]
    (columns, rows), eyes = maps[0]["tiles"], len(maps)
    image = Image.new("RGB", (columns * eyes, rows))
    for eye, tiles in enumerate(maps):
        for index, misses in enumerate(tiles["l2_misses"]):
            image.putpixel((eye * columns + index % columns, index // columns), colour(misses / most))
    return image


def write_table():
    with open(table_path, "w", newline="") as file:
        file.write("# command: scripts/overview.sh  (tracegen raster atrium -o atrium.textrace; replay run atrium.textrace --order ORDER)\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["tile order", "L1 misses, % of footprints", "L2 misses, % of lines", "texture MB per frame from DRAM", "saved against Morton %",
                        "texture unit in use %", "million cycles"])
        for order, title in TITLES.items():
            found = results[order]
            saved = "-" if order == "morton" else f"{saved_pct(order):.1f}"
            table.writerow([title, f"{100 * found['l1']['footprint_miss_rate']:.2f}", f"{100 * found['l2']['line_miss_rate']:.1f}",
                            f"{found['external_bytes'] / 1e6:.2f}", saved, f"{100 * found['tmu']['utilization']:.1f}", f"{found['cycles'] / 1e6:.2f}"])


def text(x, y, words, size=13, fill=INK, weight="normal", anchor="start"):
    return f'<text x="{x}" y="{y}" font-size="{size}" fill="{fill}" font-weight="{weight}" text-anchor="{anchor}">{words}</text>'


def panel(index, title, caption, picture, pixelated=False):
    x = LEFT + index * (PANEL_WIDTH + GAP)
    style = ' style="image-rendering:pixelated"' if pixelated else ""
    middle = x + PANEL_WIDTH / 2
    return [
        text(x, 40, title, 15, weight="600"), text(x, 59, caption, 12, FAINT),
        f'<image x="{x}" y="72" width="{PANEL_WIDTH}" height="{PANEL_HEIGHT}" preserveAspectRatio="none" href="{picture}"{style}/>',
        f'<rect x="{x}" y="72" width="{PANEL_WIDTH}" height="{PANEL_HEIGHT}" fill="none" stroke="#c9ced4"/>',
        f'<line x1="{middle}" y1="72" x2="{middle}" y2="{72 + PANEL_HEIGHT}" stroke="#ffffff" stroke-width="3"/>',
        text(x + PANEL_WIDTH / 4, 72 + PANEL_HEIGHT + 16, "left eye", 11, FAINT, anchor="middle"),
        text(x + 3 * PANEL_WIDTH / 4, 72 + PANEL_HEIGHT + 16, "right eye", 11, FAINT, anchor="middle"),
    ]


def bars(top):
    label_width, value_width = 150, 175
    x, width = LEFT + label_width, 1200 - 2 * LEFT - label_width - value_width
    most = max(results[order]["external_bytes"] for order in DRAWN)
    out = [text(LEFT, top, "Texture data from DRAM by tile order", 15, weight="600"),
           text(LEFT, top + 19, "MB per stereo frame; in brackets the change against Morton order", 12, FAINT)]
    for row, order in enumerate(DRAWN):
        y = top + 34 + row * 27
        stereo = order.startswith("z2")
        bytes_read = results[order]["external_bytes"]
        length = width * bytes_read / most
        change = "" if order == "morton" else f" ({-saved_pct(order):+.1f} %)".replace("-", "\u2212")
        out += [text(x - 10, y + 14, TITLES[order], 13, weight="600" if stereo else "normal", anchor="end"),
                f'<rect x="{x}" y="{y}" width="{length:.1f}" height="19" rx="2" fill="{BLUE if stereo else GREY}"/>',
                text(round(x + length + 8, 1), y + 14, f"{bytes_read / 1e6:.2f} MB{change}", 13, weight="600" if stereo else "normal")]
    return out


def legend(y, most):
    x, width = LEFT + PANEL_WIDTH + GAP, 2 * PANEL_WIDTH + GAP
    stops = "".join(f'<stop offset="{i / (len(RAMP) - 1)}" stop-color="rgb{c}"/>' for i, c in enumerate(RAMP))
    start = x + width / 2 - 110
    return [f'<defs><linearGradient id="ramp">{stops}</linearGradient></defs>',
            f'<rect x="{start}" y="{y}" width="220" height="9" fill="url(#ramp)" stroke="#c9ced4"/>',
            text(start - 8, y + 9, "0", 11, FAINT, anchor="end"),
            text(start + 228, y + 9, f"{most} or more L2 misses per tile of 16x16 pixels", 11, FAINT)]


def write_picture():
    everything = sorted(misses for order in ("morton", "z2-sta") for tiles in results[order]["tile_maps"] for misses in tiles["l2_misses"])
    # The busiest hundredth of the tiles shares the darkest colour.
    most = -(-everything[len(everything) * 99 // 100] // 10) * 10
    frame = Image.open(f"{folder}/atrium.png").convert("RGB")
    frame = frame.resize((2 * PANEL_WIDTH, 2 * PANEL_HEIGHT), Image.LANCZOS)
    eye = " x ".join(map(str, documents["morton"]["trace"]["eye_size_px"]))
    parts = [
        *panel(0, "Captured stereo frame", f"built-in scene atrium, 2 x {eye.replace(' ', '')} pixels", uri(frame, "JPEG", quality=82)),
        *panel(1, "L2 misses, Morton order", "each eye alone: both fetch the same texture lines", uri(heat_map("morton", most), "PNG", optimize=True), True),
        *panel(2, "L2 misses, Z2 STA order", "tiles of both eyes together: lines are fetched once", uri(heat_map("z2-sta", most), "PNG", optimize=True), True),
        *legend(310, most), *bars(358),
    ]
    height = 358 + 34 + 27 * len(DRAWN) + 12
    with open(picture_path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1200 {height}" width="1200" height="{height}" '
                   'font-family="system-ui, -apple-system, \'Segoe UI\', \'Helvetica Neue\', Arial, sans-serif">\n'
                   f'<rect width="1200" height="{height}" rx="8" fill="#ffffff"/>\n' + "\n".join(parts) + "\n</svg>\n")


write_table()
write_picture()
