"""Screenshots of pages at two widths and as printed, and the checks that a browser can make.

Usage: screenshots.py CHROMIUM PAGES OUT
"""

import html
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

WIDTHS_PX = (1280, 800)
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
  const root = document.documentElement;
  const pre = document.createElement("pre");
  pre.id = "check";
  pre.textContent = JSON.stringify({width: root.scrollWidth, window: innerWidth, height: root.scrollHeight, overlaps, outside});
  document.body.replaceChildren(pre);
});
</script>"""


def chromium(program, profile, *arguments):
    command = [program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
               f"--user-data-dir={profile}", "--force-color-profile=srgb", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False).stdout


def check(program, profile, page, folder, width):
    copy = folder / f"check-{page.name}"
    copy.write_text(page.read_text() + CHECK)
    dom = chromium(program, profile, f"--window-size={width},1000", "--virtual-time-budget=2000", "--dump-dom", copy.resolve().as_uri())
    text = dom.split('<pre id="check">')[1].split("</pre>")[0]
    return json.loads(text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))


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


def main():
    program, pages, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    bad = 0
    with tempfile.TemporaryDirectory() as profile, tempfile.TemporaryDirectory() as folder:
        for page in sorted(pages.glob("*.html")):
            print(f"{page.stem}: {page.stat().st_size // 1024} KiB")
            for width in WIDTHS_PX:
                found = check(program, profile, page, pathlib.Path(folder), width)
                problems = [f"text over text: {text}" for text in found["overlaps"]]
                problems += [f"text outside of its chart: {text}" for text in found["outside"]]
                if found["width"] > found["window"]:
                    problems.append(f"{found['width']} px wide")
                for problem in problems[:8]:
                    print(f"  at {width} px: {problem}")
                bad += len(problems)
                shot = (out / f"{page.stem}-{width}.png").resolve()
                height = min(found["height"] + 20, TALLEST_PX)
                chromium(program, profile, f"--window-size={width},{height}", f"--screenshot={shot}", page.resolve().as_uri())
            pdf = (out / f"{page.stem}.pdf").resolve()
            chromium(program, profile, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.resolve().as_uri())
            problems = stranded(page, pdf)
            for problem in problems:
                print(f"  {problem}")
            bad += len(problems)
    print(f"{bad} problems")
    sys.exit(1 if bad else 0)


main()
