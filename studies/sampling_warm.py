"""What frames before a captured one change where their absence has no bounds: timed replays of a frame after 1, 2 and 4 frames, beside the whole path."""

from .common import read_csv
from .orders import one

SCENES = ["atrium", "jungle", "crytek-sponza", "stk-black-forest", "lab", "music-box"]
FRAME = 24
WARM = [1, 2, 4]
CACHES = "8/64,16/512"


def counts(study, plan, trace):
    """Bytes of the frame by caches and order."""
    values = study.work / "values.csv"
    study.replay("sample", plan, trace, "--mode timed --quiet --caches", CACHES, "--save-values", values, allowed=(0, 1))
    return {(row["caches"], row["order"]): int(row["external_bytes"]) for row in read_csv(values) if int(row["frame"]) == FRAME}


def run(study):
    rows = {}
    for scene in study.present(SCENES):
        words = ["raster", study.scene(scene), "--quiet --path head --size 480x540"]
        plan, trace = study.work / "plan.textrace", study.work / "part.textrace"
        study.tracegen(*words, "--frames", FRAME + 1, "--plan-only -o", plan)
        study.tracegen(*words, "--frames", FRAME + 1, "--no-plain -o", trace)
        truth = counts(study, plan, trace)
        for warm in WARM:
            study.tracegen(*words, "--frames", f"{FRAME}..{FRAME + 1}", "--warm", warm, "--no-plain -o", trace)
            found = counts(study, plan, trace)
            for caches in CACHES.split(","):
                saving = lambda of: 100 * (1 - of[caches, "z2-sta"] / of[caches, "morton"])
                bytes_pct = 100 * (found[caches, "z2-sta"] / truth[caches, "z2-sta"] - 1)
                rows.setdefault((caches, warm), []).append((scene, bytes_pct, saving(found) - saving(truth)))
        study.say(scene)
    table = []
    for (caches, warm), found in sorted(rows.items()):
        largest = [max(found, key=lambda row: abs(row[at])) for at in (1, 2)]
        table.append([caches, warm, len(found), one(largest[0][1], 2), largest[0][0], one(largest[1][2], 2), largest[1][0]])
    study.write(
        "sampling-warm", f"frame {FRAME} of a head's path at 480x540, timed: replayed after so many frames, beside the whole path",
        "L1/L2 KiB | frames before | scenes | largest error of bytes % | of scene | largest error of the saving, points | of the scene", table)
