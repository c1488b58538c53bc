"""Frame time by scheduler on three machines, and against the bandwidth of DRAM, warps and FIFO depth: two frames of a head's path of five scenes, and of three
recorded programs.

Programs are pages that the study `apps` installs.
"""

import math

from .apps import install

OPTIONS = {"--part": dict(choices=["machines", "bandwidth", "warps"], help="one of the three comparisons (all)")}
SCENES = ["jungle", "crytek-sponza", "dabrovic-sponza", "stk-cocoa-temple", "stk-black-forest"]
# Page and query of each program.
PROGRAMS = {
    "three.js": ("three.html", "?mode=stereo"),
    "three.js, shadows": ("three.html", "?mode=stereo&shadows=1"),
    "Babylon.js": ("babylon.html", "?mode=vr"),
}
BANDWIDTH_SCENES = ["jungle", "crytek-sponza", "stk-black-forest"]
MACHINES = {
    "mali-g710": "--preset mali-g710",
    "Z2 paper's caches, 4 GB/s": "--bandwidth 4",
    "four cores, 4 GB/s": "--cores 4 --tile-px 32 --line 64 --l1 32KiB --l2 1MiB --bandwidth 4",
}
BANDWIDTHS = "1,2,4,8,16,64"
SCHEDULERS = ["z2-lrta", "z2-sta", "hot-cold", "pair-pressure"]
WARPS_SCENES = ["jungle", "crytek-sponza", "stk-cocoa-temple"]
WARPS, FIFO_QUADS = (4, 8, 32), (4, 16, 64)
WARPS_SCHEDULERS = ["boustro", "z2-lrta", "z2-sta", "pair-pressure"]
CAPTURE = "tracegen raster SCENE --size 480x540 --path head --frames 2"
# Published in mono, each over its own baseline: (paper, our scheduler, our baseline, speed).
PAPERS = [
    ("DTexL, MICRO 2022", "quads-grouped", "quads-in-turn", "+19.3"),
    ("LIBRA, MICRO 2024", "hot-cold", "first-idle", "+20.9"),
    ("WaSP, arXiv 2404.06156", "priority-warps", "first-idle", "+3.9"),
    ("Z2 LRTA, CVM 2017 (texture unit)", "z2-lrta", "first-idle", "+3.6 to +4.9"),
    ("Z2 STA, CVM 2017 (texture unit)", "z2-sta", "first-idle", "+3.6 to +4.9"),
]


def mean(ratios):
    return 100 * (math.exp(sum(map(math.log, ratios)) / len(ratios)) - 1)


def spread(row):
    return f"{float(row['faster_pct']):.1f} [{float(row['faster_pct_low']):.1f} to {float(row['faster_pct_high']):.1f}]"


def against_warps(study, traces):
    """Frame time against warps in flight and FIFO depth."""
    machine = MACHINES["Z2 paper's caches, 4 GB/s"]
    flags, table = f"{machine} --schedulers {','.join(WARPS_SCHEDULERS)}", []
    for scene in study.present(WARPS_SCENES):
        for warps in WARPS:
            for fifo in FIFO_QUADS:
                rows = study.csv("schedule", traces[scene], flags, f"--warps {warps} --fifo-quads {fifo}")
                by = {row["scheduler"]: row for row in rows}
                first = by["first-idle"]
                waits = sum(float(first[key]) for key in ("mshr_pct", "dram_pct", "l2_pct"))
                table.append([scene, warps, fifo, f"{float(first['ms']):.2f}", f"{waits:.0f}", *(spread(by[name]) for name in WARPS_SCHEDULERS)])
        study.say(f"{scene}: warps and FIFO depth")
    study.write(
        "schedule-warps", f"{CAPTURE}, replay schedule TRACE {flags} --warps {' | '.join(map(str, WARPS))} --fifo-quads {' | '.join(map(str, FIFO_QUADS))}",
        f"scene | warps | FIFO, quads | first-idle, ms | first-idle: waits for lines % | {' | '.join(f'{name}, % faster' for name in WARPS_SCHEDULERS)}", table)


def recorded(study):
    """Traces of the programs."""
    site, traces = study.out / "site", {}
    install(site)
    for name, (page, query) in PROGRAMS.items():
        trace = study.traces / f"{page}{query.replace('?', '-').replace('&', '-')}.textrace"
        if not trace.exists():
            trace.parent.mkdir(parents=True, exist_ok=True)
            study.tracegen("page", page, "--query", query, "--frames 10..12 --quiet -o", trace.resolve(), folder=site)
        traces[name] = trace
    return traces


def by_machine(study, traces):
    """Every scheduler on every machine, and the papers' gains."""
    table, papers = [], []
    for machine, flags in MACHINES.items():
        rows = [row for trace in traces.values() for row in study.csv("schedule", trace, flags)]
        study.say(machine)
        named = {}
        for row in rows:
            named.setdefault(row["scheduler"], []).append(row)
        baseline = named["first-idle"]
        bytes_of = lambda row: float(row["read_mb"]) + float(row["written_mb"])
        for scheduler, of in named.items():
            faster = [mean([1 + float(row[key]) / 100 for row in of]) for key in ("faster_pct", "faster_pct_low", "faster_pct_high")]
            saved = -mean([bytes_of(row) / bytes_of(before) for row, before in zip(of, baseline)])
            gap = mean([float(row["ms"]) / float(row["bound_ms"]) for row in of])
            table.append([machine, scheduler, *(f"{float(row['faster_pct']):.1f}" for row in of), f"{faster[0]:.1f}", f"{faster[1]:.1f} to {faster[2]:.1f}",
                          f"{saved:.1f}", f"{gap:.1f}", of[0]["bits"]])
        for paper, ours, over, published in PAPERS:
            pairs = list(zip(named[ours], named[over]))
            speed = mean([float(before["ms"]) / float(row["ms"]) for row, before in pairs])
            look_ups = mean([float(row["l2_look_ups_m"]) / float(before["l2_look_ups_m"]) for row, before in pairs])
            latency = mean([float(row["latency_cycles"]) / float(before["latency_cycles"]) for row, before in pairs])
            papers.append([paper, f"{ours} over {over}", published, machine, f"{speed:+.1f}", f"{look_ups:+.1f}", f"{latency:+.1f}"])
    detail = f"{CAPTURE}, tracegen page PAGE --frames 10..12, replay schedule TRACE {' | '.join(MACHINES.values())}"
    study.write(
        "schedule", detail, f"machine | scheduler | {' | '.join(f'{scene}, % faster' for scene in traces)} | mean, % faster | half to twice the instructions | "
        "DRAM bytes saved % | above the bound % | bits", table)
    study.write("schedule-papers", detail, "paper | ours | published, % faster | machine | ours, % faster | L2 look-ups % | latency of DRAM %", papers)


def against_bandwidth(study, traces):
    """Frame time against the bandwidth of DRAM."""
    bandwidths = []
    for scene in study.present(BANDWIDTH_SCENES):
        rows = study.csv("schedule", traces[scene], "--bandwidth", BANDWIDTHS, "--schedulers", ",".join(SCHEDULERS))
        study.say(scene)
        by = {(row["bandwidth_gb_s"], row["scheduler"]): row for row in rows}
        for bandwidth in BANDWIDTHS.split(","):
            of = lambda scheduler: by[bandwidth, scheduler]
            first = of("first-idle")
            bytes_all, bytes_sta = ([float(of(name)[key]) for key in ("read_mb", "written_mb")] for name in ("first-idle", "z2-sta"))
            bandwidths.append([scene, bandwidth, f"{float(first['ms']):.2f}", f"{float(first['bound_ms']):.2f}", *(spread(of(name)) for name in SCHEDULERS),
                               f"{100 * (1 - sum(bytes_sta) / sum(bytes_all)):.1f}"])
    study.write(
        "schedule-bandwidth", f"{CAPTURE}, replay schedule TRACE --bandwidth {BANDWIDTHS} --schedulers {','.join(SCHEDULERS)}",
        f"scene | GB/s | first-idle, ms | bound, ms | {' | '.join(f'{name}, % faster' for name in SCHEDULERS)} | z2-sta: DRAM bytes saved %", bandwidths)


def run(study):
    scenes = {scene: study.raster(scene, "--size 480x540 --path head --frames 2") for scene in study.present(SCENES)}
    parts = {"machines": lambda: by_machine(study, scenes | recorded(study)), "bandwidth": lambda: against_bandwidth(study, scenes),
             "warps": lambda: against_warps(study, scenes)}
    for part in [study.options.part] if study.options.part else parts:
        parts[part]()
    study.drop(*scenes.values())
