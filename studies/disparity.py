"""Disparity manipulation and Z2's orders: the eyes' distance, and highlights with more or less disparity than the surfaces that show them."""

from .common import mean

SIZE = "480x540"
SCENES = ["atrium", "jungle", "plant", "crytek-sponza", "stk-cocoa-temple", "stk-black-forest"]
IPDS_MM = [0, 16, 32, 64, 128, 256]
SHARES = ["0", "0.5", "1", "2"]
# Techniques that are compared with eyes that see highlights as they are.
TECHNIQUES = ["highlights-between-eyes", "shading-reuse", "highlights-between-eyes+shading-reuse"]


def saved(study, trace):
    """What both orders save of the texture's DRAM bytes."""
    rows = study.csv("paper", trace)
    return {row["order"]: float(row["reduction_pct"]) for row in rows if (row["l1_kib"], row["l2_kib"]) == ("16", "256")}


def run(study):
    by_distance, by_share, techniques = [], [], []
    for scene in study.present(SCENES):
        study.say(scene)
        for ipd in IPDS_MM:
            trace = study.raster(scene, f"--size {SIZE} --ipd {ipd}", name=f"{scene}-{ipd}")
            found = saved(study, trace)
            by_distance.append([scene, ipd, f"{found['z2-lrta']:.1f}", f"{found['z2-sta']:.1f}"])
            study.drop(trace)
        contents = set()
        for share in SHARES:
            trace = study.raster(scene, f"--size {SIZE} --highlight-disparity {share}", name=f"{scene}-share-{share}")
            contents.add(study.json("info", trace)["checksum"])
            study.drop(trace)
        by_share.append([scene, len(SHARES), len(contents)])
        folder = study.out / f"{scene}-techniques"
        study.tracegen("techniques", study.scene(scene), f"--path head --frames 2 --repeats 1 --size {SIZE} --only", ",".join(TECHNIQUES), "-o", folder)
        found = study.json("techniques", folder)
        rows = {row["technique"]: row for row in found["rows"]}
        orders = {row["technique"]: row["saved_pct"] for row in found["orders"]}
        for name in TECHNIQUES:
            row = rows[name]
            techniques.append([scene, name, f"{100 * row['fragments_ratio']:.1f}", f"{row['flip_mean']:.4f}", f"{row['flip_worst']:.4f}",
                               f"{orders['per-eye']:.1f}", f"{orders[name]:.1f}"])
    detail = f"tracegen raster SCENE --size {SIZE}"
    study.write("disparity-ipd", f"{detail} --ipd MM; replay paper --csv, L1 of 16 KiB and L2 of 256 KiB", "scene | IPD mm | LRTA saves % | STA saves %", by_distance)
    study.write("disparity-highlights", f"{detail} --highlight-disparity SHARE", "scene | shares | different traces", by_share, "shares " + ", ".join(SHARES))
    study.write("disparity-techniques", f"tracegen techniques SCENE --path head --frames 2 --repeats 1 --size {SIZE} --only LIST -o DIR; replay techniques DIR --json",
                "scene | technique | fragments % | FLIP, mean | FLIP, worst | STA saves without % | STA saves with %", techniques)
    means = []
    for ipd in IPDS_MM:
        rows = [row for row in by_distance if row[1] == ipd]
        sta = [float(row[3]) for row in rows]
        means.append([ipd, f"{mean(float(row[2]) for row in rows):.1f}", f"{mean(sta):.1f}", f"{min(sta):.1f}", f"{max(sta):.1f}"])
    study.write("disparity-ipd-summary", "", "IPD mm | LRTA saves % | STA saves % | STA, least % | STA, most %", means, f"means over {len(by_share)} scenes")
