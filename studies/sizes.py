"""What tile orders save by picture size, ways and L2, and how well the full size follows from smaller captures: docs/results/sizes.md.

Parts: table, knees, predict, even-sets, machines; by default all of them, which takes hours. What a capture gives is kept in OUT/sizes, where a later run finds it.
"""

import json
import shutil
import tomllib

from .common import Failed, mean, read_csv
from .orders import mean_change, one

# Label, source, scene, camera. Scenes of one source share textures.
CAMERAS = [line.split() for line in """
crytek-atrium crytek-sponza crytek-sponza cam_atrium_eye
dabrovic-gallery dabrovic-sponza dabrovic-sponza cam_gallery
cocoa-jungle supertuxkart stk-cocoa-temple cam_jungle
forest-brook supertuxkart stk-black-forest cam_brook
atrium atrium atrium default
jungle jungle jungle default
chess-player chess chess_42k cam_player
meadow meadow meadow default
plant plant plant default
car car car default
lab lab lab default
music-box music-box music-box default
""".strip().splitlines()]
# The scenes of the table of sizes and of machines.
SIX = [camera[0] for camera in CAMERAS[:6]]
# Displays, and the scenes and sizes that are measured on each. Sizes are factors of width and height: 1/16, 1/4, 1/2, 1 and 2 times the display's pixels.
PANELS = {"symmetric-100": (960, 1080), "quest3": (2064, 2208)}
SCALES = {"1/16": 0.25, "1/4": 0.5, "1/2": 0.5**0.5, "1": 1.0, "2": 2**0.5}
SHOWN = ["1/4", "1/2", "1", "2"]
# Sizes of the knees, on the first display. The second one predicts the display's size.
SMALLER = ["1/16", "1/4"]
MAIN = "symmetric-100"
OF_DISPLAY = {MAIN: SIX, "quest3": SIX[:2]}
ORDERS = ["morton", "z2-lrta", "z2-sta", "zig-zag+sta", "zig-zag+sta+offset"]
# A hashed L2 shares no work between replays.
HASHED_ORDERS = ["morton", "z2-sta", "zig-zag+sta+offset"]
# The Mali-G715 has the values of the Mali-G710.
MACHINES = ["adreno-650", "adreno-740", "mali-g78", "mali-g710", "apple-m2", "xclipse-920"]
MACHINE_ORDERS = ["morton", "z2-sta", "zig-zag+sta+offset"]
# Machines and scenes by display. The ranges of the machines are replayed on the first display.
ON_MACHINES = {MAIN: (MACHINES, ["crytek-atrium", "cocoa-jungle", "atrium"]), "quest3": (["adreno-740"], ["crytek-atrium", "cocoa-jungle"])}
L2_KIB = [128, 512, 2048]
WAYS = [4, 8, 16]
HASHED = "16 ways, hashed"
ORGANISATIONS = [*(f"{ways} ways" for ways in WAYS), HASHED]
def size_px(display, scale):
    return tuple(2 * round(side * SCALES[scale] / 2) for side in PANELS[display])


def capture(study, camera, display, size):
    label, _, scene, name = camera
    width, height = size
    return study.raster(scene, "--camera", name, "--hmd", display, "--size", f"{width}x{height}", name=f"{label}-{display}-{width}")


def stored(study, name, found):
    """What `found` says, from an earlier run if it is there."""
    path = study.out / f"{name}.json"
    if not path.exists():
        study.say(name)
        path.write_text(json.dumps(found()))
    return json.loads(path.read_text())


def kept(study, camera, display, scale, kind, found, last=True):
    """What `found` says of a capture. The capture stays until the last of its measurements."""
    def measured():
        trace = capture(study, camera, display, size_px(display, scale))
        result = found(study, trace)
        if last:
            study.drop(trace)
        return result

    return stored(study, f"{camera[0]}-{display}-{scale.replace('/', '_')}{kind}", measured)


def sweep(study, trace, orders, ways, *more):
    """Rows of a sweep of the L2's size and ways."""
    file, folder = study.work / "sizes.toml", study.work / "sweep"
    sizes = [f"{kib}KiB" for kib in L2_KIB]
    axes = ["[base]", 'mode = "functional"', "[axes]", f"order = {json.dumps(orders)}", f"l2.size_bytes = {json.dumps(sizes)}", f"l2.ways = {json.dumps(ways)}", *more]
    file.write_text("\n".join(axes) + "\n")
    shutil.rmtree(folder, ignore_errors=True)
    study.replay("sweep", file, trace, "--quiet --out", folder)
    return read_csv(folder / "results.csv")


def traffic(study, trace):
    """Bytes between the L2 and memory, by organisation, L2 and order; distinct bytes too."""
    found = {}
    for suffix, rows in (("", sweep(study, trace, ORDERS, WAYS)), (", hashed", sweep(study, trace, HASHED_ORDERS, WAYS[-1:], 'l2.set_index = ["xor"]'))):
        for row in rows:
            by_size = found.setdefault(f"{row['l2_ways']} ways{suffix}", {})
            by_size.setdefault(str(int(row["l2_size_bytes"]) >> 10), {})[row["order"]] = int(row["external_bytes"])
    return {"bytes": found, "distinct_bytes": 1e6 * float(rows[0]["bound_mb_per_frame"])}


def organised(study, organisation):
    """The flag for a machine whose L2 has these ways and set index."""
    file = study.work / f"{organisation.replace(' ', '-')}.toml"
    file.write_text(f"l2.ways = {organisation.split()[0]}\nl2.set_index = \"{'xor' if organisation == HASHED else 'modulo'}\"\n")
    return "--config", file


def predicted(study, trace, size, *flags):
    """Rows of `replay predict` by L2 in KiB and order."""
    caches = ",".join(f"8/{kib}" for kib in L2_KIB)
    found = study.json(
        "predict", trace, "--to", "x".join(map(str, size)), "--orders", ",".join(HASHED_ORDERS[1:]), "--caches", caches, *flags)
    return {f"{row['caches'].split('/')[1]} {row['order']}": row for row in found["rows"]}


def from_smaller(study, camera):
    """What the smaller sizes of a camera say: predictions, the push through ways alone, and knees."""
    def found():
        traces = [capture(study, camera, MAIN, size_px(MAIN, scale)) for scale in SMALLER]
        pushed = {}
        for organisation in ORGANISATIONS:
            pushed[organisation] = predicted(study, traces[-1], size_px(MAIN, SMALLER[-1]), *organised(study, organisation))
        knees = {}
        for scale, trace in zip(SMALLER, traces):
            rows = study.json("locality", trace, "--only-l2 --mode functional --orders morton,zig-zag+sta+offset")["rows"]
            knees[scale] = {row["order"]: row for row in rows if row["stream"] == "l2"}
        full = predicted(study, traces[-1], size_px(MAIN, "1"))
        for trace in traces:
            study.drop(trace)
        return {"full": full, "pushed": pushed, "knees": knees}

    return stored(study, f"{camera[0]}-smaller", found)


def measured(study, display, camera, scale):
    """Traffic of a capture."""
    return kept(study, camera, display, scale, "", traffic)


def machine_rows(name, has_ranges):
    """A measurement of every order on a machine: change against z2-sta, with its ends over the ranges."""
    def found(study, trace):
        config = tomllib.loads(study.replay("run --print-config --quiet --preset", name).out)
        sizes = "/".join(str(level["size_bytes"] >> 10) for level in config["level"][:2])
        rows = study.json("orders", trace, "--preset", name, "--orders", ",".join(MACHINE_ORDERS), "" if has_ranges else f"--caches {sizes}")["rows"]
        return [{"order": row["order"], "value": row["change_pct"], **row.get("figures", {}).get("change_pct", {})} for row in rows]
    return found


def on_machines(study):
    """Changes by display, machine and camera."""
    found = {}
    for display, (names, labels) in ON_MACHINES.items():
        for camera in (camera for camera in CAMERAS if camera[0] in labels):
            for name in names:
                measure = machine_rows(name, display == MAIN)
                found[display, name, camera[0]] = kept(study, camera, display, "1", f"-{name}", measure, name == names[-1])
    return found


# Parts.


def saving(bytes_by_order, order):
    """Bytes saved against Morton order, percent."""
    return 100 * (1 - bytes_by_order[order] / bytes_by_order["morton"])


def ends(values):
    """Lowest, median and highest of some figures."""
    values = sorted(values)
    middle = (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2
    return [one(value) for value in (values[0], middle, values[-1])]


def table(study):
    rows, by_size, by_ways, against_sta = [], {}, {}, {}
    wanted = [(display, scale, camera) for display, labels in OF_DISPLAY.items() for scale in SHOWN for camera in CAMERAS if camera[0] in labels]
    for display, scale, camera in wanted:
        label, found = camera[0], measured(study, display, camera, scale)
        for organisation, sizes in found["bytes"].items():
            for kib, of_order in sizes.items():
                known = HASHED_ORDERS if organisation == HASHED else ORDERS
                saved = {order: saving(of_order, order) for order in known[1:]}
                over_bound = of_order["morton"] / found["distinct_bytes"]
                rows.append([label, display, "x".join(map(str, size_px(display, scale))), scale, organisation, kib, f"{over_bound:.3f}", *(one(saved.get(order), 2) for order in ORDERS[1:])])
                if organisation == HASHED:
                    change = 100 * (of_order["zig-zag+sta+offset"] / of_order["z2-sta"] - 1)
                    against_sta.setdefault((display, kib), {}).setdefault(scale, []).append(change)
                    by_size.setdefault((display, kib, scale), []).append(saved)
                if display == MAIN and scale == "1":
                    by_ways.setdefault((kib, organisation), []).append(saved)
    rows.sort(key=lambda row: (list(OF_DISPLAY).index(row[1]), SIX.index(row[0]), SHOWN.index(row[3]), row[4], int(row[5])))
    detail = "tracegen raster SCENE --camera CAMERA --hmd DISPLAY --size WxH, replay sweep: external_bytes against Morton order"
    study.write("sizes", detail, f"scene | display | size | of the display's pixels | L2 organisation | L2, KiB | Morton's bytes over the bound | {' saved % | '.join(ORDERS[1:])} saved %", rows, part="table")
    shown = ["z2-sta", "zig-zag+sta+offset"]
    heading = " | ".join(f"{order}: {end}" for order in shown for end in ("lowest", "median", "highest"))

    def ranges(groups, key):
        return [[*name, len(group), *(end for order in shown for end in ends(saved[order] for saved in group))] for name, group in sorted(groups.items(), key=key)]

    study.write("sizes-range", f"{detail}; {HASHED}", f"display | L2, KiB | of the display's pixels | scenes | {heading}",
                ranges(by_size, lambda item: (list(OF_DISPLAY).index(item[0][0]), int(item[0][1]), SHOWN.index(item[0][2]))), part="table")
    changes = []
    for (display, kib), of_scale in sorted(against_sta.items(), key=lambda item: (list(OF_DISPLAY).index(item[0][0]), int(item[0][1]))):
        of = [of_scale[scale] for scale in SHOWN]
        changes.append([display, kib, len(of[0]), *(f"{one(mean_change(group))} [{one(min(group))} to {one(max(group))}]" for group in of)])
    study.write("sizes-orders", f"{detail}; {HASHED}; bytes of zig-zag+sta+offset against those of z2-sta: geometric mean [lowest to highest]",
                f"display | L2, KiB | scenes | {' of the pixels, % | '.join(SHOWN)} of the pixels, %", changes, part="table")
    study.write("sizes-ways", f"{detail}; {MAIN} at its own size", f"L2, KiB | L2 organisation | scenes | {heading}",
                ranges(by_ways, lambda item: (int(item[0][0]), ORGANISATIONS.index(item[0][1]))), part="table")


def knees(study):
    rows = []
    for camera in CAMERAS:
        for scale, of in from_smaller(study, camera)["knees"].items():
            kib = lambda order, key: float(of[order][key] or "nan") / 1024
            pairs = [("morton", "eye_bytes", "eye_knee_bytes"), ("zig-zag+sta+offset", "row_bytes", "row_knee_bytes")]
            cells = []
            for order, form, knee in pairs:
                closed, measured_at = kib(order, form), kib(order, knee)
                cells += [f"{closed:.0f}", f"{measured_at:.0f}", f"{closed / measured_at:.2f}"]
            rows.append([camera[0], "x".join(map(str, size_px(MAIN, scale))), *cells])
    study.write("sizes-knees", "replay locality TRACE --only-l2 --mode functional: eye_bytes, eye_knee_bytes, row_bytes, row_knee_bytes",
                "scene | size | lines of an eye, KiB | half of the other eye's reuses hit from, KiB | ratio | lines of a row of pairs, KiB | half of the reuses of rows hit from, KiB | ratio of rows", rows, part="knees")


def predict(study):
    """Predictions at the display's size, with intervals from the other sources."""
    cells = []
    for camera in CAMERAS:
        label, source, *_ = camera
        truth, found = measured(study, MAIN, camera, "1"), from_smaller(study, camera)["full"]
        of_smallest = truth["bytes"][HASHED][str(L2_KIB[0])]["morton"] / truth["distinct_bytes"]
        if of_smallest < 1.01:
            study.say(f"{label}: left out, Morton fetches each line once at {L2_KIB[0]} KiB")
            continue
        for kib in L2_KIB:
            for order in HASHED_ORDERS[1:]:
                row = found[f"{kib} {order}"]
                cells.append({
                    "label": label, "source": source, "kib": kib, "order": order, "predicted": row["stretched_pct"],
                    "is_knee": row["answer"].startswith("inside"), "true": saving(truth["bytes"][HASHED][str(kib)], order)})
    outside = [cell for cell in cells if not cell["is_knee"]]
    sources = list(dict.fromkeys(cell["source"] for cell in cells))
    error = {source: max((abs(cell["true"] - cell["predicted"]) for cell in outside if cell["source"] == source), default=0.0) for source in sources}
    half_width = {source: max(error[other] for other in sources if other != source) for source in sources}
    rows = []
    for cell in cells:
        half, near = half_width[cell["source"]], cell["predicted"]
        answer = ["capture at full size", ""] if cell["is_knee"] else [f"{one(near - half)} to {one(near + half)}", "yes" if abs(cell["true"] - near) <= half else "no"]
        rows.append([cell["label"], cell["source"], cell["kib"], cell["order"], one(near), *answer, one(cell["true"])])
    detail = "replay predict with captures at 1/4 of the pixels, replay sweep at the display's size"
    study.write("sizes-prediction", detail, "scene | source | L2, KiB | order | predicted saving, % | interval, or the answer inside a knee | holds | measured, %", rows, part="predict")
    holds = [source for source in sources if error[source] <= half_width[source]]
    knee_errors = [abs(cell["true"] - cell["predicted"]) for cell in cells if cell["is_knee"]]
    study.write("sizes-coverage", detail, "sources | scenes | level at most, % | sources whose intervals all hold | share, % | mean width, points | largest width, points | cells | inside a knee | largest error outside knees, points | largest error inside, points", [[
        len(sources), len({cell["label"] for cell in cells}), f"{100 * (len(sources) - 1) / len(sources):.1f}", len(holds), f"{100 * len(holds) / len(sources):.1f}",
        f"{2 * mean(half_width.values()):.1f}", f"{2 * max(half_width.values()):.1f}", len(cells), len(knee_errors), f"{max(error.values()):.1f}", f"{max(knee_errors, default=0):.1f}"]], part="predict")


def even_sets(study):
    """The push through ways alone: reuses and traffic of the same size."""
    table = []
    for organisation in ORGANISATIONS:
        errors, apart = [], []
        for camera in CAMERAS[:6]:
            pushed = from_smaller(study, camera)["pushed"][organisation]
            for kib in L2_KIB:
                true = measured(study, MAIN, camera, "1/4")["bytes"][organisation][str(kib)]
                for order in HASHED_ORDERS[1:]:
                    row = pushed[f"{kib} {order}"]
                    own = row["external_bytes_per_frame"]
                    baseline = own / (1 - row["stretched_pct"] / 100)
                    apart += [abs(own / true[order] - 1), abs(baseline / true["morton"] - 1)]
                    errors.append(abs(row["stretched_pct"] - saving(true, order)))
        errors.sort()
        table.append([organisation, len(errors), one(errors[len(errors) // 2]), one(errors[int(0.9 * len(errors))]), one(errors[-1]), one(100 * max(apart))])
    study.write("sizes-even-sets", "replay predict and replay sweep at 1/4 of the pixels", "L2 organisation | cells | median error of the saving, points | nine of ten within, points | largest, points | largest error of the bytes, %", table, part="even-sets")


def machines(study):
    """The change of each order's bytes against Z2 STA by display and machine: geometric mean of the scenes, and the ends over scenes and corners."""
    groups = {}
    for (display, name, label), rows in on_machines(study).items():
        for row in rows:
            groups.setdefault((display, name), {}).setdefault(row["order"], []).append(row)
    table = []
    for (display, name), of_order in groups.items():
        changes = {order: mean_change(row["value"] for row in rows) for order, rows in of_order.items()}
        best = min(changes, key=changes.get)
        cells = []
        for order in MACHINE_ORDERS:
            if order == "z2-sta":
                continue
            low, high = (choose(row.get(end, row["value"]) for row in of_order[order]) for choose, end in ((min, "low"), (max, "high")))
            cells.append(f"{one(changes[order])} [{one(low)} to {one(high)}]")
        table.append([name, display, "x".join(map(str, PANELS[display])), len(of_order[best]), best, *cells])
    study.write("sizes-machines", f"replay orders TRACE --preset MACHINE: change_pct and its ends; geometric mean over the scenes [lowest to highest over the scenes, and over the corners of the ranges on {MAIN}]",
                f"machine | display | size | scenes | least bytes | {' % | '.join(order for order in MACHINE_ORDERS if order != 'z2-sta')} %", table, part="machines")


PARTS = {"table": table, "knees": knees, "predict": predict, "even-sets": even_sets, "machines": machines}
OPTIONS = {"parts": dict(nargs="*", metavar="PART", help=f"some of: {', '.join(PARTS)} (all)")}


def run(study):
    for part in study.options.parts or PARTS:
        if part not in PARTS:
            raise Failed(f"expected some of: {', '.join(PARTS)}; found '{part}'")
        PARTS[part](study)
