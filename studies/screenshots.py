"""Every kind of page from small inputs, with screenshots at three widths, dark and as printed, and checks of its layout: OUT/screenshots.

Checks what a machine can check: no page is wider than its window, no two texts of a chart overlap, no text is smaller than 9 px, and no heading ends a
printed page. With --axe, also the accessibility rules of axe-core. Without Chromium the pages are only written. Exit code 1 if there are problems.
"""

import html
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from .common import ROOT

OPTIONS = {
    "--pages": dict(type=Path, help="check the pages of this folder, and write none"),
    "--axe": dict(type=Path, help="axe.min.js of axe-core: report its serious and critical findings"),
}
# Inputs below OUT/screenshots, and the commands that make them. A command for a file that is there already is left out.
GOLDEN = ["atrium.textrace", "jungle.textrace", "chess-rays.raytrace", "teapot-rays.raytrace"]
INPUTS = {
    "inputs/atrium.textrace": "raster -q atrium --size 240x270 --geometry --image inputs/atrium.png -o inputs/atrium.textrace",
    "inputs/head.textrace": "raster -q atrium --size 120x135 --path head --frames 4 --no-plain -o inputs/head.textrace",
    "inputs/truth.textrace": "verify -q atrium --trace inputs/atrium.textrace --write-reference inputs/truth.textrace",
    # Goes on where an interrupted run was.
    "": "techniques -q plant --size 120x135 --path head --frames 3 --repeats 2 --trace-frames 1 -o inputs/techniques",
}
PAGES = [
    "report inputs/atrium.textrace --image atrium=inputs/atrium.png -o pages/report.html",
    "report inputs/atrium.textrace --as atrium=crytek-sponza --orders all -o pages/report-orders.html",
    "paper golden/atrium.textrace golden/jungle.textrace --functional --html pages/paper.html",
    "view inputs/atrium.textrace --frame tile-based --image inputs/atrium.png -o pages/view.html",
    "view golden/chess-rays.raytrace -o pages/view-rays.html",
    "sweep inputs/sweep.toml golden/atrium.textrace -o sweep",
    "locality inputs/atrium.textrace --orders all --html pages/locality.html",
    "orders inputs/atrium.textrace --html pages/orders.html",
    "reproject golden/chess-rays.raytrace golden/teapot-rays.raytrace --as chess-rays=chess --curve --sensitivity --html pages/reproject.html",
    "readings golden/chess-rays.raytrace golden/teapot-rays.raytrace --as chess --as teapot --html pages/readings.html",
    "techniques inputs/techniques --html pages/techniques.html",
    "accuracy inputs/atrium.textrace --truth inputs/truth.textrace inputs/head.textrace --rays golden/chess-rays.raytrace "
    "--techniques inputs/techniques -o accuracy",
]
# Pages that their command writes among other files.
COPIES = {"sweep/report.html": "pages/sweep.html", "accuracy/accuracy.html": "pages/accuracy.html"}
PLAN = """traces = []
[axes]
order = ["morton", "z2-lrta", "z2-sta"]
l1.size_bytes = ["4KiB", "8KiB", "16KiB", "32KiB"]
l2.size_bytes = ["32KiB", "128KiB", "512KiB"]
l1.replacement = ["lru", "random"]
[one-at-a-time]
cores = [1, 4]
"""
WIDTHS_PX = (1280, 800, 400)
SMALLEST_TEXT_PX = 9
TALLEST_PX = 16000
# Reports the page's size, texts of one chart that overlap, and texts outside of their chart. A text's box
# is higher than its glyphs, so two rows of it may touch.
CHECK = """<script>
addEventListener("load", () => {
  const overlaps = [], outside = [];
  for (const svg of document.querySelectorAll("svg")) {
    const frame = svg.getBoundingClientRect();
    const boxes = [...svg.querySelectorAll("text")].map(t => [t.textContent.trim(), t.getBoundingClientRect()])
      .filter(([text, b]) => text && b.width > 0);
    boxes.forEach(([text, b], i) => {
      if (b.left < frame.left - 1 || b.right > frame.right + 1 || b.top < frame.top - 1 || b.bottom > frame.bottom + 1)
        outside.push(svg.getAttribute("aria-label") + ": " + text);
      for (const [other, c] of boxes.slice(0, i))
        if (Math.min(b.right, c.right) - Math.max(b.left, c.left) > 1 && Math.min(b.bottom, c.bottom) - Math.max(b.top, c.top) > 3)
          overlaps.push(svg.getAttribute("aria-label") + ": " + other + " / " + text);
    });
  }
  const small = new Set();
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node; (node = walk.nextNode());) {
    const of = node.parentElement, text = node.textContent.trim();
    if (!text || of.closest("script, style, noscript, option") || !of.getClientRects().length) continue;
    const matrix = of.getScreenCTM && of.getScreenCTM();
    const px = parseFloat(getComputedStyle(of).fontSize) * (matrix ? Math.hypot(matrix.a, matrix.b) : 1);
    if (px < SMALLEST - 0.05) small.add(px.toFixed(1) + " px: " + text.slice(0, 40));
  }
  const root = document.documentElement;
  const pre = document.createElement("pre");
  pre.id = "check";
  pre.textContent = JSON.stringify({width: root.scrollWidth, window: innerWidth, height: root.scrollHeight, overlaps, outside, small: [...small]});
  document.body.replaceChildren(pre);
});
</script>"""


def chromium(program, profile, *arguments):
    command = [program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
               f"--user-data-dir={profile}", "--force-color-profile=srgb", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False).stdout


AXE = """<script>
addEventListener("load", async () => {
  const found = await axe.run(document, {resultTypes: ["violations"]});
  const of = found.violations.filter(v => ["serious", "critical"].includes(v.impact));
  const pre = document.createElement("pre");
  pre.id = "axe";
  pre.textContent = JSON.stringify(of.map(v => `${v.impact} ${v.id}, ${v.nodes.length} times: ${v.nodes[0].target[0]}`));
  document.body.replaceChildren(pre);
});
</script>"""


def dom(program, profile, page, folder, width, added, name, *flags):
    """Loads a page with a script added, and returns what the script left in its element."""
    copy = folder / f"{name}-{page.name}"
    copy.write_text(page.read_text() + added)
    found = chromium(program, profile, f"--window-size={width},1000", "--virtual-time-budget=20000", *flags, "--dump-dom", copy.resolve().as_uri())
    return json.loads(html.unescape(found.split(f'<pre id="{name}">')[1].split("</pre>")[0]))


def check(program, profile, page, folder, width):
    return dom(program, profile, page, folder, width, CHECK.replace("SMALLEST", str(SMALLEST_TEXT_PX)), "check")


def stranded(page, pdf):
    """Headings that end a printed page, where `pdftotext` (poppler-utils) is installed."""
    if not shutil.which("pdftotext"):
        print("  headings of the printed page: not checked without pdftotext")
        return []
    titles = re.findall(r"<h2[^>]*>(.*?)</h2>", page.read_text())
    headings = {html.unescape(re.sub(r"<[^>]+>", "", title)).strip() for title in titles}
    text = subprocess.run(["pdftotext", "-layout", pdf, "-"], capture_output=True, text=True, check=True).stdout
    lasts = [sheet.strip().splitlines()[-1].strip() for sheet in text.split("\f") if sheet.strip()]
    return [f"heading at the end of a printed page: {last}" for last in lasts if last in headings]


def write_pages(study):
    out = study.out
    for folder in ("pages", "inputs", "golden"):
        (out / folder).mkdir(exist_ok=True)
    for name in GOLDEN:
        shutil.copy(ROOT / "traces" / name, out / "golden" / name)
    (out / "inputs/sweep.toml").write_text(PLAN)
    study.say("capture inputs")
    for file, command in INPUTS.items():
        if not (out / file).is_file():
            study.tracegen(command, folder=out)
    study.say("write pages")
    for command in PAGES:
        study.replay("-q", command, folder=out)
    for source, page in COPIES.items():
        shutil.copy(out / source, out / page)
    return out / "pages"


def problems_of(program, profile, page, folder, out, axe):
    """Screenshots of a page, and what is wrong with it at each width and as printed."""
    for width in WIDTHS_PX:
        found = check(program, profile, page, folder, width)
        problems = [f"text over text: {text}" for text in found["overlaps"]]
        problems += [f"text outside of its chart: {text}" for text in found["outside"]]
        if small := sorted(found["small"], key=lambda text: float(text.split()[0])):
            problems.append(f"{len(small)} texts smaller than {SMALLEST_TEXT_PX} px, the smallest {small[0]}")
        if found["width"] > found["window"]:
            problems.append(f"{found['width']} px wide")
        yield from (f"at {width} px: {problem}" for problem in problems)
        height = min(found["height"] + 20, TALLEST_PX)
        chromium(program, profile, f"--window-size={width},{height}", f"--screenshot={out / f'{page.stem}-{width}.png'}", page.as_uri())
    chromium(program, profile, "--force-dark-mode", "--blink-settings=preferredColorScheme=0", f"--window-size={WIDTHS_PX[0]},{TALLEST_PX // 8}",
             f"--screenshot={out / f'{page.stem}-dark.png'}", page.as_uri())
    if axe:
        script = f"<script>{axe.read_text()}</script>{AXE}"
        for theme, flags in (("light", ()), ("dark", ("--force-dark-mode", "--blink-settings=preferredColorScheme=0"))):
            yield from (f"axe, {theme}: {text}" for text in dom(program, profile, page, folder, WIDTHS_PX[0], script, "axe", *flags))
    pdf = out / f"{page.stem}.pdf"
    chromium(program, profile, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    yield from stranded(page, pdf)


def run(study):
    pages = (study.options.pages or write_pages(study)).resolve()
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if not program:
        study.say("no Chromium here: no screenshots and no checks")
        return 0
    study.say("take screenshots and check")
    bad = 0
    with tempfile.TemporaryDirectory() as profile:
        for page in sorted(pages.glob("*.html")):
            print(f"{page.stem}: {page.stat().st_size // 1024} KiB")
            for problem in problems_of(program, profile, page, study.work, study.out, study.options.axe):
                bad += 1
                print(f"  {problem}", flush=True)
    print(f"{bad} problems")
    study.say(f"done: {study.out}")
    return int(bad > 0)
