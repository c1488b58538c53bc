"""README.md's picture, and a table of docs/results/z2-comparison.md, from one built-in scene. Needs Pillow (Debian: python3-pil). The same Mesa gives the same figures."""

import base64
import io

from PIL import Image

from .common import FAINT, INK, saved, svg_text, write_svg

TITLES = {
    "scanline": "Scanline", "zig-zag": "Zig-zag", "morton": "Morton (Z order)", "hilbert": "Hilbert",
    "z2-lrta": "Z2 LRTA", "z2-sta": "Z2 STA", "random": "Random (control)",
}
DRAWN = [order for order in TITLES if order != "random"]
# Okabe and Ito's blue for the stereo orders, grey for the others.
BLUE, GREY = "#0072b2", "#8a9099"
# White, yellow, orange, vermilion, dark red: few to many misses.
RAMP = [(255, 255, 255), (253, 222, 150), (230, 159, 0), (213, 94, 0), (90, 20, 10)]
PANEL_WIDTH, PANEL_HEIGHT, GAP, LEFT, TOP = 373, 210, 20, 20, 72


def row(order, found, base):
    return [
        TITLES[order], f"{100 * found['l1']['footprint_miss_rate']:.2f}", f"{100 * found['l2']['line_miss_rate']:.1f}", f"{found['external_bytes'] / 1e6:.2f}",
        "-" if order == "morton" else saved(found["external_bytes"], base), f"{100 * found['tmu']['utilization']:.1f}", f"{found['cycles'] / 1e6:.2f}"]


def uri(image, kind, **options):
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return f"data:image/{kind.lower()};base64," + base64.b64encode(buffer.getvalue()).decode()


def colour(share):
    place = min(max(share, 0), 1) * (len(RAMP) - 1)
    low = min(int(place), len(RAMP) - 2)
    return tuple(round(a + (b - a) * (place - low)) for a, b in zip(RAMP[low], RAMP[low + 1]))


def heat_map(result, most):
    maps = result["tile_maps"]
    (columns, rows), eyes = maps[0]["tiles"], len(maps)
    image = Image.new("RGB", (columns * eyes, rows))
    for eye, tiles in enumerate(maps):
        for index, misses in enumerate(tiles["l2_misses"]):
            image.putpixel((eye * columns + index % columns, index // columns), colour(misses / most))
    return uri(image, "PNG", optimize=True)


def panel(index, title, caption, picture, style=""):
    x, foot = LEFT + index * (PANEL_WIDTH + GAP), TOP + PANEL_HEIGHT
    middle = x + PANEL_WIDTH / 2
    place = f'x="{x}" y="{TOP}" width="{PANEL_WIDTH}" height="{PANEL_HEIGHT}"'
    return [
        svg_text(x, 40, title, 15, weight="600"), svg_text(x, 59, caption, 12, FAINT),
        f'<image {place} preserveAspectRatio="none" href="{picture}"{style}/>',
        f'<rect {place} fill="none" stroke="#c9ced4"/>',
        f'<line x1="{middle}" y1="{TOP}" x2="{middle}" y2="{foot}" stroke="#ffffff" stroke-width="3"/>',
        *(svg_text(x + share * PANEL_WIDTH, foot + 16, f"{eye} eye", 11, FAINT, "middle") for share, eye in ((0.25, "left"), (0.75, "right"))),
    ]


def bars(top, sizes):
    label_width, value_width = 150, 175
    x, width = LEFT + label_width, 1200 - 2 * LEFT - label_width - value_width
    out = [svg_text(LEFT, top, "Texture data from DRAM by tile order", 15, weight="600"),
           svg_text(LEFT, top + 19, "MB per stereo frame; in brackets the change against Morton order", 12, FAINT)]
    for number, order in enumerate(DRAWN):
        y, length = top + 34 + number * 27, width * sizes[order] / max(sizes[order] for order in DRAWN)
        stereo = order.startswith("z2")
        fill, weight = (BLUE, "600") if stereo else (GREY, "normal")
        change = "" if order == "morton" else f" ({100 * (sizes[order] / sizes['morton'] - 1):+.1f} %)".replace("-", "\u2212")
        out += [svg_text(x - 10, y + 14, TITLES[order], 13, INK, "end", weight),
                f'<rect x="{x}" y="{y}" width="{length:.1f}" height="19" rx="2" fill="{fill}"/>',
                svg_text(round(x + length + 8, 1), y + 14, f"{sizes[order] / 1e6:.2f} MB{change}", 13, weight=weight)]
    return out


def legend(y, most):
    start = LEFT + 1.5 * (PANEL_WIDTH + GAP) + PANEL_WIDTH / 2 - 110
    stops = "".join(f'<stop offset="{i / (len(RAMP) - 1)}" stop-color="rgb{c}"/>' for i, c in enumerate(RAMP))
    return [f'<defs><linearGradient id="ramp">{stops}</linearGradient></defs>',
            f'<rect x="{start}" y="{y}" width="220" height="9" fill="url(#ramp)" stroke="#c9ced4"/>',
            svg_text(start - 8, y + 9, "0", 11, FAINT, "end"),
            svg_text(start + 228, y + 9, f"{most} or more L2 misses per tile of 16x16 pixels", 11, FAINT)]


def draw(path, frame, eye_size_px, results):
    everything = sorted(misses for order in ("morton", "z2-sta") for tiles in results[order]["tile_maps"] for misses in tiles["l2_misses"])
    # The busiest hundredth of the tiles shares the darkest colour.
    most = -(-everything[len(everything) * 99 // 100] // 10) * 10
    frame = Image.open(frame).convert("RGB").resize((2 * PANEL_WIDTH, 2 * PANEL_HEIGHT), Image.LANCZOS)
    eye, pixelated = "x".join(map(str, eye_size_px)), ' style="image-rendering:pixelated"'
    parts = [
        *panel(0, "Captured stereo frame", f"built-in scene atrium, 2 x {eye} pixels", uri(frame, "JPEG", quality=82)),
        *panel(1, "L2 misses, Morton order", "each eye alone: both fetch the same texture lines", heat_map(results["morton"], most), pixelated),
        *panel(2, "L2 misses, Z2 STA order", "tiles of both eyes together: lines are fetched once", heat_map(results["z2-sta"], most), pixelated),
        *legend(310, most), *bars(358, {order: result["external_bytes"] for order, result in results.items()}),
    ]
    write_svg(path, 1200, 358 + 34 + 27 * len(DRAWN) + 12, parts)


def run(study):
    frame = study.work / "atrium.png"
    trace = study.raster("atrium", "--image", frame)
    maps = study.config("tile_maps = true")
    documents = {order: study.json("run --order", order, trace, *maps) for order in TITLES}
    results = {order: document["result"] for order, document in documents.items()}
    study.write(
        "overview", "tracegen raster atrium -o atrium.textrace; replay run atrium.textrace --order ORDER",
        "tile order | L1 misses, % of footprints | L2 misses, % of lines | texture MB per frame from DRAM | saved against Morton % | "
        "texture unit in use % | million cycles", [row(order, result, results["morton"]["external_bytes"]) for order, result in results.items()])
    draw(study.picture("overview"), frame, documents["morton"]["trace"]["eye_size_px"], results)
