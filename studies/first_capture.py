"""What the first capture of a scene costs, before its textures are in the cache: with the texels of all images, and with those that alpha tests read."""

from .common import machine

SCENES = [
    "atrium", "jungle", "plant", "meadow", "lab", "crytek-sponza", "dabrovic-sponza", "stk-cocoa-temple", "stk-black-forest", "chess_42k", "bmw_55k"]


def run(study):
    rows = []
    for scene in study.present(SCENES):
        def processor_s(*flags):
            trace = study.work / "first.textrace"
            return study.tracegen("raster", study.scene(scene), "--size 480x540 --no-plain --no-cache --quiet", *flags, "-o", trace).processor_s

        times = [[processor_s(*flags) for flags in (("--no-skip", "images"), ())] for _ in range(3)]
        all_s, tested_s = (sorted(values)[1] for values in zip(*times))
        rows.append([scene, f"{all_s:.1f}", f"{tested_s:.1f}", f"{all_s / tested_s:.1f}"])
        study.say(scene)
    study.write(
        "first-capture", "tracegen raster SCENE --size 480x540 --no-plain --no-cache, with and without --no-skip images; processor time, the median of three in turn",
        "scene | texels of all images s | of alpha tests s | times less", rows, machine())
