"""How far captures of the drivers are apart: lavapipe, OSMesa's llvmpipe and softpipe, and the reference in double precision; four scenes at 2 x 512x512."""

SCENES = {"crytek-sponza": "Crytek Sponza", "stk-cocoa-temple": "cocoa temple", "atrium": "atrium", "jungle": "jungle"}
ORDERS = {"morton": "Morton", "z2-sta": "Z2 STA"}
SIZE = "--size 512x512"


def compare(study, scene):
    """What `replay compare` finds between lavapipe and each of the others."""
    traces = {
        "osmesa": study.raster(scene, SIZE, "--backend osmesa", name=f"{scene}.osmesa"),
        "softpipe": study.raster(scene, SIZE, "--backend osmesa", name=f"{scene}.softpipe", GALLIUM_DRIVER="softpipe"),
        "reference": study.traces / f"{scene}.reference.textrace",
    }
    lavapipe = study.raster(scene, SIZE)
    study.tracegen("verify --quiet", study.scene(scene), "--trace", lavapipe, "--write-reference", traces["reference"])
    found = {other: study.json("compare --mode functional", lavapipe, trace) for other, trace in traces.items()}
    study.drop(lavapipe, *traces.values())
    return found


def replayed(document, order):
    return next(row for row in document["replayed"] if row["order"] == order)


def over(document, order):
    value = replayed(document, order)["external_over_pct"]
    return "0" if abs(value) < 5e-4 else f"{value:+.3f} %"


def overlap(document):
    share = document["intersection_over_union_pct"]
    return "100 %" if share == 100 else f"{share:.4f} %"


def equal(values):
    assert all(values), values
    return ["equal"] * len(values)


def run(study):
    for scene in SCENES:
        study.scene(scene)
    by_scene = [compare(study, scene) for scene in SCENES]
    found = {other: [of[other] for of in by_scene] for other in by_scene[0]}
    osmesa = found["osmesa"]
    every = [document["all"] for document in osmesa]
    rows = [
        ["lavapipe", "fragments", *(f"{of['fragments_in_both'] + of['fragments_only_in_a']:,}" for of in every)],
        *(["", f"bytes, {title}", *(f"{replayed(document, order)['a']['external_bytes']:,}" for document in osmesa)] for order, title in ORDERS.items()),
        ["OSMesa, llvmpipe", "overlap of fragments", *map(overlap, osmesa)],
        ["", "coordinates, levels, footprints",
         *equal([of["uv_texels"]["largest"] == of["lod_levels"]["largest"] == of["footprints_that_differ"] == 0 for of in every])],
        ["", "bytes, every order", *equal([all(row["external_over_pct"] == 0 for row in document["replayed"]) for document in osmesa])],
    ]
    for other, title in (("reference", "reference"), ("softpipe", "OSMesa, softpipe")):
        documents = found[other]
        every = [document["all"] for document in documents]
        rows.append([title, "overlap of fragments", *map(overlap, documents)])
        if other == "softpipe":
            rows.append(["", "coordinates, texels: mean, 99 %", *(f"{of['uv_texels']['mean']:.3f}, {of['uv_texels']['percentile_99']:.2f}" for of in every)])
            rows.append(["", "LOD, levels: mean, largest", *(f"{of['lod_levels']['mean']:.4f}, {of['lod_levels']['largest']:.2f}" for of in every)])
        rows.append(["", "footprints that differ, one LOD formula", *(f"{100 * of['footprints_that_differ'] / of['footprints']:.3f} %" for of in every)])
        rows += [["", f"bytes, {title}", *(over(document, order) for document in documents)] for order, title in ORDERS.items()]
    study.write(
        "backends", "tracegen raster SCENE --size 512x512 [--backend osmesa], replay compare lavapipe.textrace OTHER.textrace --mode functional",
        " | ".join(["capture", "figure", *SCENES.values()]), rows)
