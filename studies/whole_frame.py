"""All memory traffic of a frame: three scenes as the DK2 shows them, four frames of a head's path, on three machines."""

from .common import PAIR, saved

SCENES = ["crytek-sponza", "stk-black-forest", "jungle"]
# Textures that are not compressed, as the literature's shares are from, on one of them.
MACHINES = {
    "tile-based": "tile-based", "tile-based rgba8": "tile-based --texel-format rgba8", "tile-based-g-buffer": "tile-based-g-buffer", "immediate": "immediate",
}
CLIENTS = ["texture", "index", "vertex", "shaded-vertex", "primitive-list", "colour", "depth", "g-buffer", "composition"]
FRAMES, HERTZ = 4, 90
COMMAND = "tracegen raster SCENE --hmd dk2 --shadows --path head --frames 4 --geometry, replay run TRACE --mode functional --order ORDER --frame MACHINE"


def traffic(result):
    return {client["client"]: client["read_bytes"] + client["write_bytes"] for client in result["clients"]}


def milliwatts(result):
    return f"{sum(client['energy_mj'] for client in result['clients']) / FRAMES * HERTZ:.0f}"


def run(study):
    sizes, shares, orders, drams = [], [], [], []
    for scene in SCENES:
        study.scene(scene)
    for scene in SCENES:
        picture = study.traces / f"{scene}.png"
        trace = study.raster(scene, f"--hmd dk2 --shadows --path head --frames {FRAMES} --geometry --image", picture)
        chunks = {chunk["tag"]: chunk["length_bytes"] for chunk in study.json("info", trace)["chunks"]}
        sizes.append([scene, *(f"{count / 1e6:.2f}" for count in (chunks["TILE"], chunks["GEOM"], chunks["PLST"] + chunks["PLIX"]))])
        for machine, flags in MACHINES.items():
            results = study.pair(trace, "--mode functional --frame", flags)
            morton, sta = map(traffic, results)
            total, total_sta = sum(morton.values()), sum(sta.values())
            shares.append([scene, machine, *(f"{morton.get(client, 0) / FRAMES / 1e6:.2f}" for client in CLIENTS),
                           f"{total / FRAMES / 1e6:.2f}", f"{100 * morton['texture'] / total:.1f}"])
            of = lambda client: saved(sta[client], morton[client]) if client in morton else "-"
            rates = [f"{count / FRAMES * HERTZ / 1e9:.2f}" for count in (total, total_sta)]
            orders.append([scene, machine, of("texture"), of("shaded-vertex"), saved(total_sta, total), *rates, *map(milliwatts, results)])
        # What may change the answer, on a tile-based machine with DRAM.
        variants = {
            "as above": [],
            "an L3 of 2 MiB for all clients": study.config('l3 = {size_bytes = "2MiB", line_bytes = 64, clients = "all"}'),
            "colour compressed without loss": ["--picture", picture],
            **{f"tiles of {px}x{px} pixels": [f"--tile-px {px}"] for px in (32, 64)},
        }
        for title, flags in variants.items():
            found = [study.json(f"run --mode functional --order {order} --frame tile-based --dram lpddr4", trace, *flags) for order in PAIR]
            permille = found[0]["config"]["frame"].get("color_compressed_permille")
            totals = [sum(traffic(document["result"]).values()) for document in found]
            dram = [document["result"]["dram"] for document in found]
            hits = [100 * (of["row_hits"] + of["write_row_hits"]) / (of["reads"] + of["writes"]) for of in dram]
            energy = [of["energy_mj"] / FRAMES for of in dram]
            drams.append([
                scene, title + (f" to {permille / 10:.1f} %" if permille else ""), *(f"{total / FRAMES / 1e6:.2f}" for total in totals),
                saved(totals[1], totals[0]), *(f"{hit:.1f}" for hit in hits), *(f"{mj:.2f}" for mj in energy), saved(energy[1], energy[0])])
        study.drop(trace)
    study.write("whole-frame-bytes", COMMAND, "scene | texture samples, MB | meshes, MB | primitive lists of 4 frames, MB", sizes)
    study.write("whole-frame", COMMAND, f"scene | machine | {' | '.join(CLIENTS)} | all, MB per frame | texture % of all", shares)
    study.write(
        "whole-frame-orders", COMMAND,
        "scene | machine | texture saved % | shaded vertices saved % | all saved % | Morton GB/s at 90 Hz | Z2 STA GB/s at 90 Hz | Morton mW at 90 Hz | "
        "Z2 STA mW at 90 Hz", orders)
    study.write(
        "whole-frame-dram", COMMAND,
        "scene | machine | Morton: all, MB per frame | Z2 STA: all, MB per frame | saved % | Morton: row hits % | Z2 STA: row hits % | "
        "Morton: DRAM energy, mJ per frame | Z2 STA: DRAM energy, mJ per frame | energy saved %", drams)
