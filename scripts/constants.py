#!/usr/bin/env python3
"""Tables of both papers' models: `scripts/constants.py REPLAY` writes results/z2-constants.csv and results/sgrt-constants.csv.

Values come from `replay ... --print-config`; what they mean and where they come from stands here. A key of the SGRT model without a row is an error.
"""

import csv
import subprocess
import sys
import tomllib
from pathlib import Path

RESULTS = Path(__file__).resolve().parents[1] / "results"
OURS, PLACEHOLDER = "not in the paper: default of this project", "placeholder; not published"
CALIBRATED = "not in the paper: calibrated (texture-unit.md)"

# Key: meaning, source.
Z2 = {
    "cores": ("shader cores", "section 4.1"),
    "level.0.size_bytes": ("L1 of each core; the experiment also has 16384", "section 4.1"),
    "level.1.size_bytes": ("L2 that the cores share; the experiment also has 262144", "section 4.1"),
    "level.0.ways": ("ways of both caches", "section 4.1"),
    "line_bytes": ("line of both caches", "section 4.1"),
    "level.0.replacement": ("replacement policy", "section 4.1"),
    "level.1.hit_cycles": ("L1 miss penalty: cycles from the L2 to the L1", "section 4.1"),
    "memory_cycles": ("L2 miss penalty: cycles from memory to the L2; the L1's penalty is added", "section 4.1; the sum is our reading"),
    "tmu.allocation": ("a line takes its way when it arrives", "section 4.1: replacement after the miss penalty"),
    "sampling.filter": ("filter of each sampler; the built-in scenes are trilinear", OURS),
    "assign": ("assignment of tiles to cores", OURS),
    "layout.block_order": ("order of the blocks within a mip level", OURS),
    "layout.base_align_bytes": ("alignment of each texture's first byte", "not in the paper; the preset's value was found by search"),
    "layout.shadow_map_order": ("order of a shadow map's texels", "not in the paper; the preset's value is nearest to Table 2"),
    "tmu.model": ("thread model", "section 4.1 names looping for the next chance"),
    "tmu.loop_cycles": ("cycles until a thread that missed is back", CALIBRATED),
    "tmu.threads": ("threads (quads) of a core", OURS),
    "tmu.retry_footprints": ("footprints that one issue slot tries again; unused by the preset", CALIBRATED),
    "tmu.fetches_per_trip": ("lines that a thread requests per trip; unused by the preset", CALIBRATED),
}
SGRT = {
    "tni.units": ("T&I units", "derived from the paper's frame rates"),
    "tni.clock_mhz": ("clock of the units, MHz", "derived from the paper's frame rates"),
    "tni.trv_pipelines": ("traversal pipelines per unit", "derived from the paper's frame rates"),
    "tni.trv_cycles_per_step": ("issue cycles per step (both children's boxes)", "T&I unit 2.0 tests two boxes (paper, reference 9)"),
    "tni.trv_cycles_per_wide_step": ("issue cycles per step of an eight-wide tree", "four times the boxes"),
    "tni.trv_depth_cycles": ("stages of a traversal pipeline", PLACEHOLDER),
    "tni.ist_pipelines": ("intersection pipelines per unit", PLACEHOLDER),
    "tni.ist_cycles_per_test": ("issue cycles per triangle test", PLACEHOLDER),
    "tni.ist_depth_cycles": ("stages of an intersection pipeline", PLACEHOLDER),
    "tni.rays_in_flight": ("rays in flight per unit", PLACEHOLDER),
    "tni.rays_per_cycle": ("rays handed to or from a unit per cycle", PLACEHOLDER),
    "cache.node_l1_bytes": ("node cache per unit", PLACEHOLDER),
    "cache.triangle_l1_bytes": ("triangle cache per unit", PLACEHOLDER),
    "cache.l1_ways": ("ways of both", PLACEHOLDER),
    "cache.l2_bytes": ("cache that all units share", PLACEHOLDER),
    "cache.l2_ways": ("ways of the shared cache", PLACEHOLDER),
    "cache.line_bytes": ("line of all ray caches", PLACEHOLDER),
    "cache.l2_latency_cycles": ("cycles from an L1 miss to data out of the L2", PLACEHOLDER),
    "cache.node_l1_hit_rate": ("hit rate of node visits: primary, shadow, secondary rays; unused with --visits", PLACEHOLDER),
    "cache.triangle_l1_hit_rate": ("hit rate of triangle visits, the same classes", PLACEHOLDER),
    "cache.l2_hit_rate": ("hit rate of L1 misses, the same classes", PLACEHOLDER),
    "memory.bandwidth_gb_s": ("peak bandwidth, GB/s", "LPDDR4-3200, 64 bits"),
    "memory.latency_ns": ("latency of a read, ns", PLACEHOLDER),
    "memory.shading_bytes": ("attributes and texels per shaded hit", PLACEHOLDER),
    "memory.frame_buffer_bytes": ("frame buffer per pixel", "RGBA, 8 bits each"),
    "srp.cores": ("SRP cores", "derived: the cores must not limit 131 frames per second"),
    "srp.lanes_per_core": ("lanes per core", "derived: the same"),
    "srp.clock_mhz": ("clock of the cores, MHz", "derived: the same"),
    "srp.ray_generation_cycles": ("lane cycles per ray generated", PLACEHOLDER),
    "srp.shading_cycles": ("lane cycles per shaded hit or miss", PLACEHOLDER),
    "srp.alpha_test_cycles": ("lane cycles per alpha look-up", PLACEHOLDER),
    "srp.reproject_cycles": ("lane cycles per left pixel", "with the next two about 10 % of a frame's kernels (section III)"),
    "srp.detect_cycles": ("lane cycles per right pixel", "the same"),
    "srp.reuse_cycles": ("lane cycles per reused pixel", "the same"),
    "srp.row_test_cycles": ("lane cycles per left pixel of the row that a right pixel is tested against; 0: only what arrived", OURS),
    "srp.compaction": ("pixels are compacted by kernel (inspector-executor)", "section III"),
    "gbuffer.shadow_bytes": ("shadow outcomes, only for rules that read them", OURS),
    "gbuffer.detect_position_bytes": ("position in the copy that detection reads; 4 is a depth", OURS),
    "gbuffer.rows": ("where that copy waits for the right eye", "section III: DRAM"),
    "gbuffer.color_bytes": ("colour in a G-buffer record", "fields: figure 2; bytes: ours"),
    "gbuffer.normal_bytes": ("normal", "fields: figure 2; bytes: ours"),
    "gbuffer.texcoord_bytes": ("texture coordinates", "fields: figure 2; bytes: ours"),
    "gbuffer.position_bytes": ("position", "fields: figure 2; bytes: ours"),
    "gbuffer.object_bytes": ("object number, only for rules that read it", OURS),
    "gbuffer.triangle_bytes": ("triangle number, only for rules that read it", OURS),
    "energy.step_pj": ("energy per step", "45 nm arithmetic"),
    "energy.wide_step_pj": ("energy per eight-wide step", "four times a step"),
    "energy.triangle_test_pj": ("energy per triangle test", "45 nm arithmetic"),
    "energy.ray_pj": ("energy per ray handed over", PLACEHOLDER),
    "energy.srp_lane_cycle_pj": ("energy per lane cycle", PLACEHOLDER),
    "energy.l1_pj_per_byte": ("energy per byte, node and triangle caches", "45 nm, 8 KB SRAM"),
    "energy.l2_pj_per_byte": ("energy per byte, shared cache", "placeholder: four times the L1"),
    "energy.sram_pj_per_byte": ("energy per byte, tile G-buffer", "45 nm, 8 KB SRAM"),
    "energy.dram_pj_per_byte": ("energy per byte, DRAM", "45 nm: 1.3 nJ per 64 bits, the lower end"),
    "energy.static_mw": ("leakage and clocks, mW", PLACEHOLDER),
    "cycles.warp_rays": ("rays in lock step, only for `--timing cycle`; 1: single rays", "MIMD units (paper, reference 8)"),
    "cycles.l1_mshrs": ("lines in flight per node or triangle cache, only for `--timing cycle`", PLACEHOLDER),
    "cycles.l2_mshrs": ("lines in flight into the L2, only for `--timing cycle`", PLACEHOLDER),
    "cycles.tile_buffers": ("tiles from dispatch to the end of shading, only for `--timing cycle`", PLACEHOLDER),
    "cycles.in_order_return": ("a unit returns rays in order of dispatch, only for `--timing cycle`", PLACEHOLDER),
}


def config(*arguments):
    return tomllib.loads(subprocess.check_output([sys.argv[1], *arguments, "--print-config"], text=True))


def value(found, key):
    for part in key.split("."):
        found = found[int(part)] if part.isdigit() else found[part]
    if isinstance(found, bool):
        return str(found).lower()
    return ", ".join(f"{v}" for v in found.values()) if isinstance(found, dict) else found


def write(name, command, rows, columns):
    """Columns: heading and configuration of each."""
    with open(RESULTS / name, "w", newline="") as file:
        file.write(f"# command: scripts/constants.py REPLAY  ({command})\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["key", *columns, "meaning", "source"])
        for key, (meaning, source) in rows.items():
            shown = key.replace("level.0", "l1").replace("level.1", "l2")
            table.writerow([f"`{shown}`", *(value(found, key) for found in columns.values()), meaning, source])


def main():
    write("z2-constants.csv", "replay run --print-config, replay run --preset z2-paper --print-config", Z2,
          {"default": config("run"), "`--preset z2-paper`": config("run", "--preset", "z2-paper")})
    sgrt = config("reproject")
    keys = {f"{table}.{key}" for table, keys in sgrt.items() for key in keys}
    if keys != set(SGRT):
        sys.exit(f"constants.py: keys without a row, or rows without a key: {sorted(keys ^ set(SGRT))}")
    write("sgrt-constants.csv", "replay reproject --print-config", SGRT, {"value": sgrt})


if __name__ == "__main__":
    main()
