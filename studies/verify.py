"""Captures against a reference in double precision: causes of differences, and what they change in a replay."""

import json

# Scene, and pixels per eye.
MEANS = [
    ("atrium-shadows", "128x144"), ("jungle", "512x512"), ("plant", "256x256"), ("crytek-sponza", "256x256"), ("crytek-sponza", "333x217"),
    ("stk-cocoa-temple", "256x256"), ("stk-cocoa-temple", "333x217"), ("stk-cocoa-temple", "512x512"), ("stk-black-forest", "256x256"),
    ("stk-black-forest", "512x512"), ("dabrovic-sponza", "256x256"), ("chess_42k", "256x256"), ("bmw_55k", "256x256"),
]
NAMES = {"chess_42k": "chess-openchessset", "bmw_55k": "bmw27"}
WHOLE = ["crytek-sponza", "stk-cocoa-temple", "atrium", "jungle"]


def verify(study, scene, *options):
    return json.loads(study.tracegen("verify --json", study.scene(scene), *options).out)


def largest_mean(study, scene, size):
    """The mean nearest to its bound, and the coordinates that nothing explains."""
    uv = verify(study, scene, f"--size {size}")["uv_error_texels"]
    share, bound = max((abs(mean["mean_texels"]) / mean["bound_texels"], mean["bound_texels"]) for mean in uv["largest_means"])
    unexplained = next(cause["count"] for cause in uv["causes"] if cause["cause"] == "unexplained")
    return [NAMES.get(scene, scene), f"2x{size}", uv["coordinates"], unexplained, f"{100 * share:.1f} %", f"{bound:.4f}"]


def whole(study, scene):
    """Differences between capture and reference."""
    capture, reference = study.raster(scene, "--size 512x512"), study.traces / f"{scene}-reference.textrace"
    found = verify(study, scene, "--trace", capture, "--write-reference", reference)
    cover, uv, same, specification = (found[key] for key in ("coverage", "uv_error_texels", "capture_precision", "specification"))
    kind = {of["class"]: of["only_reference"] + of["only_capture"] for of in cover["differences"]}
    cause = {of["cause"]: of["count"] for of in uv["causes"]}
    change = []
    for own, base in zip(*(study.pair(trace, "--mode functional") for trace in (capture, reference))):
        change.append(f"{100 * (own['external_bytes'] / base['external_bytes'] - 1):+.3f} %")
    study.drop(capture, reference)
    return [
        scene, f"{cover['both']:,}", f"{cover['only_reference']:,}; {cover['only_capture']:,}", f"{100 * cover['iou']:.4f} %",
        "; ".join(f"{kind[of]:,}" for of in ("edge", "depth-tie", "unexplained")), f"{uv['mean']:.4f}; {uv['p99']:.4f}",
        "; ".join(f"{cause[of]:,}" for of in ("single-precision", "saturated", "unexplained")),
        f"{same['lod_error_mean']:.5f}; {same['lod_error_max']:.4f}", f"{100 * same['footprints_differ_share']:.3f} %",
        f"{100 * specification['levels_differ_share']:.2f} %; {100 * specification['footprints_differ_share']:.2f} %", "; ".join(change)]


def run(study):
    for scene in (*WHOLE, *(scene for scene, _ in MEANS)):
        study.scene(scene)
    differences = [whole(study, scene) for scene in WHOLE]
    study.write(
        "verify-means", "tracegen verify SCENE --size SIZE --json of each row",
        "scene | pixels of both eyes | coordinates | unexplained | largest mean, part of its bound | that bound, texels",
        [largest_mean(study, *of) for of in MEANS])
    study.write(
        "verify-scenes", "tracegen verify SCENE --trace FILE --write-reference FILE --json, replay run of both; 2x512x512",
        "scene | fragments in both | only reference, only capture | IoU | at edges, depth ties, unexplained | coordinates, texels: mean, 99 % | "
        "beyond 1/64 texel: single precision, saturated, unexplained | same formula: LOD mean, max | same formula: footprints that differ | "
        "specification: levels, footprints that differ | external bytes, capture over reference: Morton, Z2 STA", differences)
