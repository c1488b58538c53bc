"""Size and speed of the optional columns of ray traces."""

import csv

from .common import bench, execute

OPTIONS = {"--size": dict(default="512x512", help="pixels per eye (512x512)")}
SCENES = ["chess", "atrium", "crytek-sponza", "stk-black-forest"]


def speed(items, seconds):
    return f"{items / seconds / 1e6:.1f}"


def run(study):
    size = study.options.size
    for scene in SCENES:
        study.scene(scene)
    program = bench("formats", "ray_columns")
    rays_rows, tree_rows = [], []
    for scene in SCENES:
        trace = study.rays(scene, f"--size {size} --all-columns")
        study.replay("validate", trace)
        # Items, coded bytes, uncoded bytes, seconds to write and to read.
        columns = {column: [float(number) for number in numbers] for _, column, *numbers in csv.reader(execute(program, trace).out.splitlines())}
        study.drop(trace)
        rays = columns["records"][0]
        per_ray = [columns[column][1:] for column in ("records", "visits", "geometry")]
        line = lambda first, column, coded, uncoded, *speeds: rays_rows.append([first, column, f"{coded / rays:.2f}", f"{uncoded / rays:.2f}", *speeds])
        for column, (coded, uncoded, *seconds) in zip(("records", "visits", "geometry"), per_ray):
            line(f"{scene}, {rays:,.0f} rays" if column == "records" else "", column, coded, uncoded, *(speed(rays, s) for s in seconds))
        nodes, triangles = columns["nodes"], columns["triangles"]
        tree, bare = nodes[1] + triangles[1], nodes[2] + triangles[2]
        coded, uncoded, *seconds = map(sum, zip(*per_ray))
        line("", "hierarchy", tree, bare, "-", "-")
        line("", "all", coded + tree, uncoded + bare, *(speed(rays, s) for s in seconds))
        tree_rows.append([
            scene, f"{nodes[0]:,.0f}", f"{triangles[0]:,.0f}", f"{nodes[1] / nodes[0]:.1f}", f"{triangles[1] / triangles[0]:.1f}", f"{tree / 1e6:.2f}",
            f"{bare / 1e6:.2f}", *(speed(triangles[0], s) for s in nodes[3:])])
    detail = f"tracegen rays SCENE --size {size} --all-columns, cargo bench -p formats --bench ray_columns -- TRACE"
    study.write("ray-columns", detail, "scene | columns | bytes per ray | uncoded, bytes per ray | write, Mray/s | read, Mray/s", rays_rows)
    study.write(
        "ray-hierarchy", detail,
        "scene | nodes | triangles | bytes per node | bytes per triangle | MB | uncoded, MB | write, Mtriangle/s | read, Mtriangle/s", tree_rows)
