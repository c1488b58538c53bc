"""Prefetchers of ray units: accuracy, coverage and speed of treelet and traversal-stack prefetch, what stereo adds, and what the speed depends on."""

from concurrent.futures import ThreadPoolExecutor

from .common import geometric_mean, mean

OPTIONS = {"--size": dict(default="64x64", help="pixels per eye (64x64)")}
SCENES = ["chess", "car", "music-box", "meadow", "crytek-sponza", "stk-cocoa-temple", "stk-black-forest", "bmw_55k"]
# Scenes on which the machine is varied.
VARIED = ["music-box", "stk-black-forest"]
KINDS = {"primary": "primary", "secondary": "shadow,reflection,refraction,ambient-occlusion,diffuse"}
PREFETCHERS = ["treelet", "ttp"]
EYES = {"left": "left alone", "reference": "both"}
# The public configuration MOBILE of Vulkan-Sim (github.com/yavuz650/vulkan-sim), the simulator of both papers: 8 ray units of 128 rays
# and 64 MSHRs, 32 KiB L1 without sets, 160 cycles to a shared L2 of 1 MiB, 100 cycles of DRAM more, lines of 128 bytes, 1365 MHz.
# It tests boxes only before it pushes them, so that rays visit all entries of their stacks.
GPU = """cache.node_l1_bytes = 16384, cache.triangle_l1_bytes = 16384, cache.l1_ways = 128, cache.line_bytes = 128, cache.l2_bytes = 1048576,
    cache.l2_ways = 16, cache.l2_latency_cycles = 180, memory.latency_ns = 73, memory.bandwidth_gb_s = 56, tni.units = 8, tni.clock_mhz = 1365,
    tni.trv_pipelines = 4, tni.trv_cycles_per_wide_step = 1, tni.trv_depth_cycles = 4, tni.ist_pipelines = 4, tni.ist_depth_cycles = 8,
    tni.rays_in_flight = 128, cycles.l1_mshrs = 64, cycles.l2_mshrs = 512, cycles.prefetch.visits_dropped = true""".replace("\n", " ")
# It goes on at the first inner child, and pops leaves and the other children from the stack. Such rays drop no entries.
UNDROPPED = GPU.replace(", cycles.prefetch.visits_dropped = true", "")
WARPS = "cycles.return_group_rays = 32"
# The machine that is most like that of the papers.
LIKE_PUBLISHED = "and warps of 32 rays"
INNER_FIRST = "cwbvh8 --child-order inner-first"
# Machines, as the keys that differ from the default, and the tree of rays.
MACHINES = {
    "default": ("", "bvh2"),
    "memory of 480 ns": ("memory.latency_ns = 480", "bvh2"),
    "L1 caches of 4 KiB": ("cache.node_l1_bytes = 4096, cache.triangle_l1_bytes = 4096", "bvh2"),
    "16 rays in flight": ("tni.rays_in_flight = 16", "bvh2"),
    "512 rays in flight": ("tni.rays_in_flight = 512", "bvh2"),
    "16 rays, memory of 480 ns": ("tni.rays_in_flight = 16, memory.latency_ns = 480", "bvh2"),
    "128 MSHRs": ("cycles.l1_mshrs = 128, cycles.l2_mshrs = 512", "bvh2"),
    "treelets of 2 KiB, 4 stack entries": ("cycles.prefetch.treelet_bytes = 2048, cycles.prefetch.stack_entries = 4", "bvh2"),
    "dropped entries are visited": ("cycles.prefetch.visits_dropped = true", "bvh2"),
    "eight-wide tree": ("", "cwbvh8"),
    "as Vulkan-Sim": (GPU, "cwbvh8"),
    "and children in the order of the node": (UNDROPPED, "cwbvh8 --child-order node"),
    "and leaves on the stack": (UNDROPPED, INNER_FIRST),
    LIKE_PUBLISHED: (f"{UNDROPPED}, {WARPS}", INNER_FIRST),
    "and 4 stack entries": (f"{UNDROPPED}, {WARPS}, cycles.prefetch.stack_entries = 4", INNER_FIRST),
    "and 160x160 pixels": (f"{UNDROPPED}, {WARPS}, cycles.prefetch.stack_entries = 4", f"{INNER_FIRST} --size 160x160"),
    "as Vulkan-Sim, 32 rays, 4 stack entries": (f"{GPU}, cycles.prefetch.stack_entries = 4".replace("in_flight = 128", "in_flight = 32"), "cwbvh8"),
}
PUBLISHED = {"treelet": ["1.32", "-", "-"], "ttp": ["1.48", "98.9", "31.5"]}


class Run:
    """A prefetcher on a trace, beside none, by the eyes that are traced."""

    def __init__(self, report, base):
        self.eyes = {eye: (report["result"]["cycles"][eye], base["result"]["cycles"][eye]) for eye in EYES}

    def speed(self, eye):
        own, none = self.eyes[eye]
        return none["cycles"] / own["cycles"]

    def counted(self, key, of, eye):
        lines = self.eyes[eye][0]["prefetch"]
        return 100 * lines[key] / max(1, lines[of])

    def accuracy(self, eye):
        return self.eyes[eye][0]["prefetch"]["accuracy_pct"]

    def coverage(self, eye):
        """As published: by how much fewer lines rays fetch into the L1 caches."""
        own, none = self.eyes[eye]
        return 100 * (1 - own["l1_misses"] / max(1, none["l1_misses"]))

    def dram(self, eye):
        own, none = self.eyes[eye]
        return 100 * (own["dram_lines"] / max(1, none["dram_lines"]) - 1)

    def cells(self, eye):
        figures = [self.accuracy(eye), self.coverage(eye), *(self.counted(*key, eye) for key in (
            ("late", "issued"), ("dropped", "requested"))), self.dram(eye), self.counted("of_other_eye", "requested", eye)]
        issued = self.eyes[eye][0]["prefetch"]["issued"]
        return [f"{issued / 1e3:.1f}", *(f"{value:.1f}" for value in figures), f"{self.speed(eye):.3f}"]


def measure(study, trace, kinds, machine=""):
    """The runs of all prefetchers."""
    name = f"{trace.stem}-{abs(hash((kinds, machine)))}.toml"
    (study.work / name).write_text("".join(f"{line.strip()}\n" for line in machine.split(",")))
    words = ["reproject --timing cycle --preset sgrt-paper --reuse primary --threads 1", "--config", study.work / name, *(["--rays", kinds] if kinds else [])]
    base = study.json(*words, trace)
    return {prefetcher: Run(study.json(*words, "--prefetch", prefetcher, trace), base) for prefetcher in PREFETCHERS}


def run(study):
    size, scenes = study.options.size, study.present(SCENES)
    capture = lambda scene, tree: study.rays(scene, f"{'' if '--size' in tree else f'--size {size}'} --all-columns --bounces 1 --bvh {tree}",
                                              name=f"{scene}-{tree.replace(' ', '')}")
    table, like = [], []
    machines = {machine: [] for machine in MACHINES}
    with ThreadPoolExecutor(2) as pool:
        for scene in scenes:
            trees = {tree for _, tree in MACHINES.values()} if scene in VARIED else {"bvh2", MACHINES[LIKE_PUBLISHED][1]}
            traces = {tree: capture(scene, tree) for tree in sorted(trees)}
            found = pool.map(lambda kind: measure(study, traces["bvh2"], KINDS[kind]), KINDS)
            for kind, runs in zip(KINDS, found):
                table += [[scene, kind, name, prefetcher, *runs[prefetcher].cells(eye)] for eye, name in EYES.items() for prefetcher in PREFETCHERS]
            names = MACHINES if scene in VARIED else [LIKE_PUBLISHED]
            of_names = list(pool.map(lambda of: measure(study, traces[of[1]], "", of[0]), [MACHINES[name] for name in names]))
            cells = {name: runs.cells("reference") for name, runs in of_names[list(names).index(LIKE_PUBLISHED)].items()}
            like.append([scene, *(cells[name][at] for name in PREFETCHERS for at in (1, 2, -1))])
            if scene in VARIED:
                for machine, runs in zip(names, of_names):
                    machines[machine].append(runs)
            study.say(scene)
            study.drop(*traces.values())
    detail = f"tracegen rays SCENE --size {size} --all-columns --bounces 1, replay reproject --timing cycle --preset sgrt-paper --reuse primary --rays KIND --prefetch NAME --json"
    study.write("ray-prefetch", detail, "scene | rays | eyes | prefetcher | lines issued k | accuracy % | coverage % | late % | dropped % | more DRAM bytes % | "
                "of the other eye % | speed", table)
    summary = []
    for kind in KINDS:
        for name in EYES.values():
            for prefetcher in PREFETCHERS:
                rows = [row for row in table if row[1:4] == [kind, name, prefetcher]]
                means = [f"{mean(float(row[at]) for row in rows):.1f}" for at in (5, 6, 7, 8, 9, 10)]
                summary.append([kind, name, prefetcher, *means, f"{geometric_mean(float(row[11]) for row in rows):.3f}"])
    study.write("ray-prefetch-summary", detail, "rays | eyes | prefetcher | accuracy % | coverage % | late % | dropped % | more DRAM bytes % | "
                "of the other eye % | speed", summary, f"means over {len(scenes)} scenes")
    rows = []
    for prefetcher in PREFETCHERS:
        rows.append(["published", prefetcher, *PUBLISHED[prefetcher], "-", "-", "-"])
        for machine, all_runs in machines.items():
            runs = [of[prefetcher] for of in all_runs]
            idle = mean(run.eyes["reference"][1]["idle"]["dram"] + run.eyes["reference"][1]["idle"]["l2"] for run in runs)
            rows.append([machine, prefetcher, f"{geometric_mean(run.speed('reference') for run in runs):.3f}",
                         *(f"{mean(figure(run, 'reference') for run in runs):.1f}" for figure in (Run.accuracy, Run.coverage, Run.dram)),
                         f"{mean(run.counted('dropped', 'requested', 'reference') for run in runs):.1f}", f"{idle:.1f}"])
    study.write("ray-prefetch-machines", f"{detail.replace(' --rays KIND', '')} --config FILE", "machine | prefetcher | speed | accuracy % | coverage % | "
                "more DRAM bytes % | dropped % | idle for lines without prefetcher %", rows, "both eyes, all rays, " + ", ".join(VARIED))
    study.write("ray-prefetch-like-published", f"{detail.replace(' --rays KIND', '')} --config FILE, --bvh {MACHINES[LIKE_PUBLISHED][1]}",
                "scene | " + " | ".join(f"{name}: {figure}" for name in PREFETCHERS for figure in ("accuracy %", "coverage %", "speed")), like, "both eyes, all rays")
