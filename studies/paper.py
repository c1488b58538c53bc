"""Savings beside the Z2 paper's: every scene and cache configuration, the paper's way of counting, and choices that it leaves open."""

from .common import mean, read_csv, saved

# In the order of the document: name of the trace, scene and flags of its capture, title, scene of the paper.
CAPTURES = [
    ("crytek-sponza", "crytek-sponza", "", "Crytek Sponza", "the same"),
    ("atrium", "atrium", "", "atrium", "Crytek Sponza"),
    ("dabrovic-sponza", "dabrovic-sponza", "", "Dabrovic Sponza", "L-Bench, no shadows"),
    ("atrium-plain", "atrium-plain", "", "atrium-plain", "L-Bench, no shadows"),
    ("dabrovic-sponza-shadows", "dabrovic-sponza", "--shadows", "Dabrovic Sponza, shadows", "L-Bench, shadows"),
    ("atrium-shadows", "atrium-shadows", "", "atrium-shadows", "L-Bench, shadows"),
    ("cocoa-temple", "stk-cocoa-temple", "", "cocoa temple", "T-Rex"),
    ("jungle", "jungle", "", "jungle", "T-Rex"),
]
# Traces that are also replayed with linear shadow maps.
WITH_SHADOWS = ["dabrovic-sponza-shadows", "atrium-shadows", "jungle"]
ORDERS = {"morton": "Morton", "z2-lrta": "LRTA", "z2-sta": "STA"}
RATES = ["l1_footprint_miss_pct", "l2_line_miss_pct", "tmu_util_pct"]
DETAIL = "tracegen raster SCENE -o SCENE.textrace, --shadows for two Dabrovic rows"
DK2_DETAIL = "tracegen raster crytek-sponza/sponza.gltf --hmd dk2 -o crytek-sponza.textrace"


def paper(study, *words):
    """The table of `replay paper`."""
    table = study.work / "paper.csv"
    study.replay("paper", *words, "--csv", table)
    return read_csv(table)


def point(trace, layout, row):
    return [
        trace, layout, row["l1_kib"], row["l2_kib"], row["order"], *(f"{float(row[key]):.3f}" for key in RATES), row["external_bytes"],
        f"{float(row['reduction_pct']):.3f}", *(row[f"paper_{key}"] for key in RATES),
        f"{float(row['paper_reduction_pct']):.2f}" if row["paper_reduction_pct"] else ""]


def means(rows):
    """Mean over cache configurations, and the paper's: savings and utilisation of both orders."""
    for key, digits in (("reduction_pct", 1), ("tmu_ratio", 2)):
        for order in ("z2-lrta", "z2-sta"):
            ours, papers = (mean(float(row[name]) for row in rows if row["order"] == order) for name in (key, f"paper_{key}"))
            yield f"{ours:.{digits}f} ({papers:.{digits}f})"


def savings(study, captures):
    traces = {name: study.raster(scene, flags, name=name) for name, scene, flags, *_ in captures}
    by_layout = {
        "morton": paper(study, *traces.values()),
        "linear": paper(study, *(traces[name] for name in WITH_SHADOWS if name in traces), "--shadow-map-order linear"),
    }
    points, table = [], []
    for trace, _, _, title, stands_for in captures:
        for layout, rows in by_layout.items():
            own = [row for row in rows if row["trace"] == trace]
            points += [point(trace, layout, row) for row in own]
            if own:
                table.append([title if layout == "morton" else "the same, linear maps", stands_for, *means(own)])
    more = ["command: replay paper *.textrace --csv FILE",
            f"command: replay paper {' '.join(f'{name}.textrace' for name in WITH_SHADOWS)} --shadow-map-order linear --csv FILE"]
    study.write(
        "paper-savings", DETAIL,
        "scene | shadow_map_order | l1_kib | l2_kib | order | l1_footprint_miss_pct | l2_line_miss_pct | tmu_util_pct | external_bytes | saved_pct | "
        "paper_l1_footprint_miss_pct | paper_l2_line_miss_pct | paper_tmu_util_pct | paper_saved_pct", points, *more)
    study.write("paper-means", DETAIL, "scene | stands for | LRTA saved % | STA saved % | LRTA TMU | STA TMU", table, *more)


def preset(study, rows):
    table = []
    for row in rows:
        rates = lambda start, digits: " / ".join(f"{float(row[start + key]):.{digits}f}" for key in RATES)
        reductions = [row[key] for key in ("paper_reduction_pct", "z2_paper_product_reduction_pct", "z2_paper_reduction_pct", "reduction_pct")]
        table.append([f"{row['l1_kib']}/{row['l2_kib']} {ORDERS[row['order']]}", rates("paper_", 1), rates("z2_paper_", 1),
                      *(f"{float(value):.1f}" if row["order"] != "morton" else "" for value in reductions)])
    study.write(
        "paper-preset", DK2_DETAIL,
        "caches, order | paper | preset | paper saved | preset saved, L1 x L2 | bytes saved, preset | bytes saved, default model", table,
        "command: replay paper crytek-sponza.textrace --preset z2-paper --base-align 64KiB --csv FILE")


def choices(study, trace, rows):
    table = []
    for align, title, bias in (("64", "64 bytes", 0), ("64KiB", "64 KiB", 0), ("64KiB", "64 KiB", -1), ("64KiB", "64 KiB", -2)):
        morton, lrta, sta = (study.result(trace, order, f"--mode functional --base-align {align} --lod-bias={bias}") for order in ORDERS)
        table.append([title, bias, *(f"{100 * of['l1']['footprint_miss_rate']:.2f}" for of in (morton, sta)), f"{100 * morton['l2']['line_miss_rate']:.1f}",
                      *(saved(of["external_bytes"], morton["external_bytes"]) for of in (lrta, sta))])
    published = {row["order"]: row for row in rows if (row["l1_kib"], row["l2_kib"]) == ("8", "128")}
    of = lambda order, key, digits: f"{float(published[order][f'paper_{key}']):.{digits}f}"
    table.append(["paper", "", *(of(order, RATES[0], 2) for order in ("morton", "z2-sta")), of("morton", RATES[1], 1),
                  *(of(order, "reduction_pct", 1) for order in ("z2-lrta", "z2-sta"))])
    study.write(
        "open-choices", DK2_DETAIL,
        "textures begin at | LOD bias | L1 miss %, Morton | L1 miss %, STA | L2 miss %, Morton | LRTA saved % | STA saved %", table,
        "command: replay run crytek-sponza.textrace --mode functional --base-align BYTES --lod-bias BIAS --order ORDER --json")


def run(study):
    study.scene("crytek-sponza")
    scenes = set(study.present(dict.fromkeys(scene for _, scene, *_ in CAPTURES)))
    savings(study, [capture for capture in CAPTURES if capture[1] in scenes])
    dk2 = study.raster("crytek-sponza", "--hmd dk2", name="dk2/crytek-sponza")
    rows = paper(study, dk2, "--preset z2-paper --base-align 64KiB")
    preset(study, rows)
    choices(study, dk2, rows)
