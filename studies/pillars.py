"""README.md's table of what each part of Parallax measures: one row for each kind of result, from the results files of the studies behind them."""

from .common import read_csv

MASK, MULTIVIEW, RINGS = "hidden-area-mask", "multiview", "foveation-rings"
SCENES = ("atrium", "jungle", "plant")


def ends(values, unit="%", digits=1):
    values = [float(value) for value in values]
    low, high = (f"{value:.{digits}f}" for value in (min(values), max(values)))
    return f"{low if low == high else f'{low} to {high}'}{' ' + unit if unit else ''}"


def techniques(study, name, key):
    """The change of a count by a technique in percent, and its image error, over three scenes."""
    rows = [next(row for row in read_csv(study.results / f"techniques-{scene}.csv") if row["technique"] == name) for scene in SCENES]
    return ends(100 * (1 - float(row[key])) for row in rows), ends((row["FLIP, mean"] for row in rows), "", 3)


def run(study):
    table = lambda name: read_csv(study.results / f"{name}.csv")
    rows = []

    def add(what, saves, error, measured, page):
        rows.append([f"[{what}](docs/results/{page}.md)", saves, error, measured])

    paper = table("paper-means")
    add("Z2 STA", f"{ends(row['STA saved %'].split()[0] for row in paper)} of texture bytes", "none", f"{len(paper)} cases", "z2-comparison")
    quest = next(row for row in table("sizes-machines") if row["machine"] == "adreno-740" and row["display"] == "quest3")
    low, high = quest["zig-zag+sta+offset %"].split("[")[1].rstrip("]").split(" to ")
    add("zig-zag+sta+offset", f"{ends((-float(high), -float(low)))} of texture bytes", "none", f"{quest['scenes']} scenes", "sizes")
    for name, key, what in ((MASK, "fragments", "fragments"), (MULTIVIEW, "draws", "draw calls"), (RINGS, "fragments", "fragments")):
        saved, flip = techniques(study, name, key)
        add(name, f"{saved} of {what}", flip if float(flip.split()[-1]) else "none", f"{len(SCENES)} scenes", "techniques")
    reuse = [row for row in table("reprojection") if row["run"] == "chosen"]
    for key, change, sign in (("performance", "{} more frames/s", 1), ("energy", "{} of the energy", -1)):
        add("reprojection", change.format(ends(sign * 100 * (float(row[f"relative_{key}"]) - 1) for row in reuse)),
            ends((row["flip_mean"] for row in reuse), "", 4), f"{len(reuse)} scenes", "reprojection")
    programs = [row for row in table("applications") if row["Z2 STA saves %"] not in ("", "-")]
    add("Z2 STA, programs", f"{ends(row['Z2 STA saves %'] for row in programs)} of texture bytes", "none", f"{len(programs)} programs", "applications")
    study.write("pillars", "from paper-means, sizes-machines, techniques-*, reprojection and applications", "what | saves, lowest to highest | FLIP error | measured on", rows)
