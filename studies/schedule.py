"""Frame time by scheduler on three machines, and against the bandwidth of DRAM, warps and FIFO depth: two frames of a head's path of four scenes."""

import math

SCENES = ["jungle", "crytek-sponza", "stk-cocoa-temple", "stk-black-forest"]
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


def run(study):
    present = study.present(SCENES)
    traces = {scene: study.raster(scene, "--size 480x540 --path head --frames 2") for scene in present}
    table, papers, bandwidths = [], [], []
    for machine, flags in MACHINES.items():
        rows = [row for scene in present for row in study.csv("schedule", traces[scene], flags)]
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
    against_warps(study, traces)
    study.drop(*traces.values())
    study.write(
        "schedule", f"{CAPTURE}, replay schedule TRACE {' | '.join(MACHINES.values())}",
        f"machine | scheduler | {' | '.join(f'{scene}, % faster' for scene in present)} | mean, % faster | half to twice the instructions | DRAM bytes saved % | "
        "above the bound % | bits", table)
    study.write(
        "schedule-papers", f"{CAPTURE}, replay schedule TRACE {' | '.join(MACHINES.values())}",
        "paper | ours | published, % faster | machine | ours, % faster | L2 look-ups % | latency of DRAM %", papers)
    study.write(
        "schedule-bandwidth", f"{CAPTURE}, replay schedule TRACE --bandwidth {BANDWIDTHS} --schedulers {','.join(SCHEDULERS)}",
        f"scene | GB/s | first-idle, ms | bound, ms | {' | '.join(f'{name}, % faster' for name in SCHEDULERS)} | z2-sta: DRAM bytes saved %", bandwidths)
