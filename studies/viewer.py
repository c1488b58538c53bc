"""results/viewer.csv: size of the page of `replay view`, time to write it, and the main thread's time for each picture while it plays.

Needs Chromium and Linux. A picture's time is that of the script, and with the layout and the paint that follow it; both include waits for a processor
that other programs use. The processor time of the main thread, a mean, does not. The page plays every order of a frame in 10 s, with the content of
the L2 on the maps. The pages stay in OUT/viewer. The row of a recorded page needs npm (docs/use/applications.md).
"""

import http.server
import json
import shutil
import statistics
import subprocess
import tempfile
import threading
import time
from pathlib import Path

from . import apps
from .common import Absent, Failed, machine

PLAY_S = 10
WINDOW_PX = (1280, 1400)
WAIT_S = 120
# Plays once and posts the times. A message that is sent in an animation frame arrives after its layout and paint.
PLAY = """<script type="module">
const root = document.getElementById("view"), script = [], whole = [], port = new MessageChannel();
const metric = document.getElementById("view-metric"), play = document.getElementById("view-play");
const shown = [...metric.options].findIndex(of => of.textContent === "in the L2 now");
const began = [];
port.port1.onmessage = () => whole.push(performance.now() - began.shift());
const at = [];
const send = () => fetch("/", { method: "POST", body: JSON.stringify({ script, whole, at }) });
const record = event => {
  script.push(event.detail);
  at.push(Date.now() / 1000);
  began.push(performance.now() - event.detail);
  port.port2.postMessage(0);
};
setTimeout(() => {
  if (shown >= 0) metric.value = shown, metric.onchange();
  root.addEventListener("drawn", record);
  if (play.hidden) {
    // A page without animation: its picture changes with the pointer and the choices.
    let count = 0;
    const next = () => count++ < 300 ? (dispatchEvent(new Event("resize")), setTimeout(next, 20)) : send();
    return next();
  }
  play.click();
  const wait = () => play.textContent === "Play" ? send() : setTimeout(wait, 200);
  setTimeout(wait, 1000);
}, 1500);
</script>"""
COLUMNS = (
    "page | input | pixels per eye | tiles | orders | page MB | s to write | pictures | script ms, median | script ms, 95 % | main thread ms, median | "
    "main thread ms, 95 % | processor ms, mean")


def main_thread(browser):
    """The page's main thread: its processor time is the first number in this file. The page is the renderer that has worked most."""
    def group(folder):
        return int((folder / "stat").read_text().rsplit(")", 1)[1].split()[2])

    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if "--type=renderer" in (folder / "cmdline").read_text() and group(folder) == browser.pid:
                found.append((int((folder / "schedstat").read_text().split()[0]), folder / "schedstat"))
        except (OSError, ProcessLookupError):
            pass
    return max(found)[1] if found else None


def played(program, page, folder):
    """The times of each picture, `script` and `whole`, and the mean of the `processor`'s, in ms."""
    found, done = {}, threading.Event()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200 if self.path == "/" else 404)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            if self.path == "/":
                self.wfile.write(page.read_bytes() + PLAY.encode())

        def do_POST(self):
            found.update(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()
            done.set()

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    command = [program, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}", "--window-size={},{}".format(*WINDOW_PX),
               "--remote-debugging-port=0", f"http://127.0.0.1:{server.server_port}/"]
    browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    samples, thread, end = [], None, time.time() + WAIT_S
    try:
        while not done.wait(0.02):
            if time.time() > end:
                raise Failed(f"{page}: no times after {WAIT_S} s")
            thread = thread if len(samples) > 10 else main_thread(browser) or thread
            if thread:
                samples.append((time.time(), int(thread.read_text().split()[0]) / 1e6))
    finally:
        browser.terminate()
        browser.wait()
        server.shutdown()
    first, last = (min(samples, key=lambda of: abs(of[0] - at))[1] for at in (found["at"][0], found["at"][-1]))
    found["processor"] = (last - first) / (len(found["at"]) - 1)
    return found


def inputs(study):
    """Each page's name, its input in words, and the arguments of `replay view`."""
    scene, picture = "crytek-sponza", study.out / "crytek-sponza.png"
    try:
        trace = study.raster(scene, "--hmd quest2 --geometry --image", picture)
        yield "Crytek Sponza", "tracegen raster --hmd quest2 --geometry", [trace, "--frame tile-based", "--image", picture]
    except Absent as error:
        study.say(f"skipped: {error} is absent")
    try:
        site = study.out / "site"
        site.mkdir(exist_ok=True)
        apps.install(site)
        trace, picture = study.traces / "three.textrace", study.out / "three.png"
        if not trace.exists():
            study.tracegen("page", site / "three.html", "--query ?mode=stereo --frames 10..12 --image", picture, "-o", trace, folder=site)
        yield "three.js StereoEffect", "tracegen page --frames 10..12", [trace, "--image", picture]
    except (Absent, Failed, OSError) as error:
        study.say(f"skipped: the recorded page: {error}")
    yield "chess, rays", "tracegen rays --size 960x1080", [study.rays("chess", "--size 960x1080")]


def about(data):
    frame = data["frames"][0]
    first = frame["passes"][0]
    size = first.get("size_px") or [16 * tiles for tiles in first["tiles"]]
    return "{}x{}".format(*size), sum(a * b for a, b in (of["tiles"] for of in frame["passes"])), len(data["runs"])


def run(study):
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if not program:
        raise Absent("chromium")
    rows = []
    for name, source, arguments in inputs(study):
        study.say(name)
        page = study.out / f"{name.split(',')[0].split(' ')[0].lower()}.html"
        written = study.replay("-q view", *arguments, "-o", page)
        text = page.read_text()
        data = json.loads(text.split('id="view-data"')[1].split(">", 1)[1].split("</script>")[0])
        with tempfile.TemporaryDirectory() as folder:
            times = played(program, page, folder)
        high = lambda values: statistics.quantiles(values, n=20)[-1]
        measured = [f"{of(times[key]):.1f}" for key in ("script", "whole") for of in (statistics.median, high)]
        size = f"{len(text.encode()) / 1e6:.2f}"
        rows.append([name, source, *about(data), size, f"{written.wall_s:.1f}", len(times["script"]), *measured, f"{times['processor']:.1f}"])
        print(rows[-1], flush=True)
    study.write("viewer", f"{WINDOW_PX[0]} px wide, {PLAY_S} s an order, no GPU", COLUMNS, rows, machine())
