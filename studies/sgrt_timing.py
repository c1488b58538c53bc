"""The cycle-level model of the T&I units against the closed form, its speed, and published rates of other units."""

import json

from .common import SGRT_SCENES

EYES = ["left", "right"]
# Primary hits are reused, and what detection reads goes through DRAM.
COMMAND = "reproject --timing cycle --preset sgrt-paper --reuse primary --rule depth+row+object+opaque+triangles"
# Scenes that are off by more than 10 %, and machines that show why.
BEYOND = ["music-box", "meadow"]
FAST_DRAM = ["memory.latency_ns = 2", "memory.bandwidth_gb_s = 2048"]
MACHINES = {
    "16 tile buffers": ["cycles.tile_buffers = 16"],
    "DRAM without delay": FAST_DRAM,
    "both": ["cycles.tile_buffers = 16", *FAST_DRAM],
    "512 rays in flight": ["tni.rays_in_flight = 512"],
}
# Published rates (docs/models/sgrt.md): RayCore's 239 Mray/s and 1 W of 6 units at 28 nm (Nah et al. 2014), GR6500's 300 Mray/s and
# 24 G node tests per second at 600 MHz (Imagination).
PUBLISHED = [["RayCore, 28 nm", 6, 239, "-", f"{1e9 / 239e6:.2f}"], ["PowerVR GR6500", "-", 300, 80, "-"]]


def millions(count):
    return f"{count / 1e6:.3f}"


def tenths(*values):
    return [f"{value:.1f}" for value in values]


def timing(scene, report):
    """A row for each eye."""
    for eye in EYES:
        cycles = report["result"]["cycles"][eye]
        yield [
            scene, eye, *(millions(cycles[key]) for key in ("rays_left", "cycles", "closed_form_cycles")), *tenths(cycles["closed_form_error_pct"]),
            cycles["closed_form_bottleneck"], *tenths(cycles["traversal_utilisation_pct"], cycles["intersection_utilisation_pct"]),
            *tenths(*(cycles["idle"][cause] for cause in ("no_ray", "mshr", "dram", "l2", "latency"))), f"{cycles['mean_ray_cycles']:.0f}",
            *tenths(*(cycles[f"{cache}_hit_pct"] for cache in ("node_l1", "triangle_l1", "l2")))]


def performance(scene, report):
    """A row for each rule."""
    for rule, outcome in (("none", report["plain"]), ("strict", report["result"])):
        cycles = outcome["cycles"]
        pairs = [(cycles[f"closed_form_{what}"], outcome[what]) for what in ("relative_performance", "relative_energy")]
        yield [scene, rule, *(f"{value:.3f}" for pair in pairs for value in pair),
               *tenths(*(cycles[run]["closed_form_error_pct"] for run in ("reference", "reprojected")))]


def speed(scene, report, seconds):
    runs, plain = report["result"]["cycles"], report["plain"]["cycles"]
    # The reference and each eye alone once; per rule, reprojection with both kinds of G-buffer.
    simulated = [runs["reference"], runs["left"], runs["right"], *[runs["reprojected"]] * 2, *[plain["reprojected"]] * 2]
    rays, requests = (sum(of[key] for of in simulated) for key in ("rays_left", "requests"))
    return [scene, millions(rays), *tenths(requests / rays, seconds), f"{rays / seconds / 1e6:.2f}", f"{seconds / rays * 1e6:.2f}"]


def unit(scene, report):
    """Rates as they are published. A step of ours tests two boxes."""
    found, model = report["result"], report["config"]["model"]["tni"]
    work, energy = found["reference_work"], found["reference_energy"]
    rays, seconds = work["rays"], found["cycles"]["reference"]["cycles"] / (model["clock_mhz"] * 1e6)
    return [f"ours, 45 nm: {scene}", model["units"], f"{rays / seconds / 1e6:.0f}", f"{2 * work['steps'] / rays:.0f}",
            f"{(energy['tni_pj'] + energy['caches_pj']) / rays / 1e3:.2f}"]


def run(study):
    reports, seconds, traces = {}, {}, {}
    for scene in SGRT_SCENES:
        traces[scene] = study.rays(scene, "--size 512x512 --visits")
        done = study.replay(COMMAND, "--threads 1 --json --quiet", traces[scene])
        reports[scene], seconds[scene] = json.loads(done.out), done.processor_s
    causes = []
    for machine, lines in {"default": None, **MACHINES}.items():
        found = [study.json(COMMAND, traces[scene], *study.config(*lines)) if lines else reports[scene] for scene in BEYOND]
        causes.append([machine, *tenths(*(report["result"]["cycles"][eye]["closed_form_error_pct"] for report in found for eye in EYES))])
    command = f"replay {COMMAND}"
    study.write(
        "sgrt-timing", f"tracegen rays SCENE --size 512x512 --visits, {command} --json",
        "scene | eye | rays M | unit cycles M | closed form M | off by % | its bottleneck | traversal used % | intersection used % | idle %: no ray | "
        "MSHRs full | DRAM | L2 | pipeline latency | cycles per ray | node L1 hits % | triangle L1 hits % | L2 hits %",
        [row for scene, report in reports.items() for row in timing(scene, report)])
    study.write(
        "sgrt-timing-performance", f"{command} --json",
        "scene | rule | performance: closed form | performance: cycle level | energy: closed form | energy: cycle level | "
        "closed form off by %: both eyes in full | closed form off by %: with reprojection",
        [row for scene, report in reports.items() for row in performance(scene, report)])
    study.write(
        "sgrt-timing-causes", f"{command} --config FILE --json",
        " | ".join(["machine: closed form off by %", *(f"{scene}, {eye}" for scene in BEYOND for eye in EYES)]), causes)
    study.write(
        "sgrt-timing-speed", f"{command} --threads 1 --json, the whole command",
        "scene | rays simulated M | requests per ray | processor seconds | M rays per second | seconds per million rays",
        [speed(scene, reports[scene], seconds[scene]) for scene in SGRT_SCENES])
    study.write(
        "sgrt-published-units", f"{command} --json", "unit | units | Mray/s | box tests per ray | nJ per ray, units and their caches",
        [*PUBLISHED, *(unit(*pair) for pair in reports.items())])
