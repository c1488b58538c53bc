"""What tile orders do to rows of DRAM: Crytek Sponza, atrium and jungle as the DK2 shows them."""

DEVICES = ["lpddr4", "gddr6"]
ORDERS = ["scanline", "morton", "hilbert", "z2-lrta", "z2-sta"]


def run(study):
    rows = []
    for scene, trace in study.dk2():
        for device in DEVICES:
            for order in ORDERS:
                dram = study.result(trace, order, "--dram", device)["dram"]
                rows.append([
                    scene, dram["device"], order, f"{dram['reads']:,}", f"{100 * dram['row_hit_rate']:.1f}", f"{dram['activates']:,}",
                    f"{dram['latency_mean_ns']:.0f}", f"{dram['latency_p99_ns']:.0f}", f"{dram['energy_mj']:.3f}"])
    study.write(
        "dram-orders", "tracegen raster SCENE --hmd dk2 --no-plain, replay run TRACE --order ORDER --dram DEVICE",
        "scene | DRAM | order | reads | row hits % | rows opened | mean latency ns | 99 % ns | energy mJ", rows)
