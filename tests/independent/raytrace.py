"""Prints a .raytrace: a line of JSON with the tables, then one for each sample with its rays.

    python3 raytrace.py FILE [--nodes | --slots]

With --nodes or --slots the lines are the inner nodes or the triangles of the hierarchy. Written from FORMAT.md alone; see container.py.
"""

import math
import struct
import sys

from raycolumns import read_geometry, read_nodes, read_slots

from container import FOV, META, V3, Bytes, check_fov, check_meta, content_checksum, f32
from container import parse_json, print_line
from container import read, require, shaped, tile_spans, unzigzag

TAGS = {"META", "RBVH", "RMAT", "RLIT", "RTRI", "RAYS", "RTIX"}
EYE = {
    "position": V3,
    "right": V3,
    "up": V3,
    "forward": V3,
    "fov": FOV,
    "size_px": ["u32", "u32"],
}
RAY_META = {
    "trace": META,
    "origin": ["f64"] * 3,
    "eyes": [EYE, EYE],
    "max_depth": "u32",
    "samples_per_px": "u32",
    "has_visits": "bool",
    "sky": [V3, V3],
}
LIGHTING = {
    "light_radius_m": "f32",
    "sun_radius_deg": "f32",
    "occlusion_rays": "u32",
    "occlusion_m": "f32",
    "bounces": "u32",
    "coloured_shadows": "bool",
    "normal_maps": "bool",
}
HIERARCHY = {
    "builder": "string",
    "settings": (["string", "string"],),
    "traversal": "string",
    "triangles": "u64",
    "nodes": "u64",
    "leaves": "u64",
    "depth": "u32",
    "sah_cost": "f64",
    "bytes_per_node": "u32",
    "bytes_per_triangle": "u32",
}
UPDATE = {
    "method": "string",
    "triangles_read": "u64",
    "triangles_written": "u64",
    "instances": "u64",
    "nodes": "u64",
}
MATERIAL = {
    "name": "string",
    "diffuse": "bool",
    "mirror": "bool",
    "glass": "bool",
    "glossy": "bool",
    "alpha_masked": "bool",
}
LIGHTS = {
    "directional": {"kind": "string", "direction": V3, "color": V3},
    "point": {"kind": "string", "position": V3, "color": V3},
}
KINDS = ["primary", "shadow", "reflection", "refraction", "ambient-occlusion", "diffuse"]
OUTCOMES = ["miss", "hit", "occluded"]
FARTHEST = f32(1e18)


def within(coordinates):
    return all(abs(x) <= FARTHEST for x in coordinates)


def check_ray_meta(meta):
    check_meta(meta["trace"])
    for eye in meta["eyes"]:
        require(eye["size_px"] == meta["trace"]["hmd"]["eye_size_px"], "size of an eye")
        check_fov(eye["fov"])
        axes = [eye["right"], eye["up"], eye["forward"]]
        for i, a in enumerate(axes):
            for j, b in enumerate(axes):
                product = sum(x * y for x, y in zip(a, b))
                length = math.sqrt(product) if i == j else product
                require(abs(length - (i == j)) <= 0.0011, "axes of an eye")
        require(within(eye["position"]), "position of an eye")
    if "lighting" in meta:
        light = meta["lighting"]
        lengths = [light["light_radius_m"], light["occlusion_m"]]
        require(all(0 <= length <= FARTHEST for length in lengths), "lengths of lighting")
        require(0 <= light["sun_radius_deg"] <= 45, "size of the sun")
        require(light["occlusion_rays"] <= 1024 and light["bounces"] <= 64, "rays of lighting")
    require(meta["max_depth"] <= 64 and 1 <= meta["samples_per_px"] <= 1024, "samples or depth")
    return meta


def check_hierarchy(bvh):
    require(bvh["traversal"] in ("bvh2", "bvh4", "bvh8", "cwbvh8"), "traversal")
    require(all(bvh[key] < 1 << 32 for key in ("triangles", "nodes", "leaves")), "counts")
    require(bvh["sah_cost"] >= 0, "cost")
    sizes = [bvh["bytes_per_node"], bvh["bytes_per_triangle"]]
    require(all(1 <= size <= 4096 for size in sizes), "bytes of a node or triangle")
    return bvh


def read_light(value):
    kind = shaped(value, {"kind": "string"})["kind"]
    require(kind in LIGHTS, "kind of a light")
    return shaped(value, LIGHTS[kind])


def read_triangles(chunk, materials):
    data = Bytes(chunk)
    triangles = {}
    previous = -1
    for _ in range(data.count(48)):
        primitive, item, material, *numbers = data.fields("3I9f")
        require(primitive > previous and material < len(materials), "a triangle")
        require(all(math.isfinite(x) for x in numbers) and within(numbers), "a vertex")
        triangles[primitive] = (item, material, [numbers[i : i + 3] for i in (0, 3, 6)])
        previous = primitive
    data.end()
    return triangles


def float_of(bits):
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def half_of(bits):
    return struct.unpack("<e", struct.pack("<H", bits))[0]


# Arithmetic in f32: the exact result of one operation on two f32, rounded once. A float has more
# than twice the digits, so rounding its result again changes nothing.
def add(a, b):
    return f32(a + b)


def mul(a, b):
    return f32(a * b)


def div(a, b):
    return f32(a / b)


def dot(a, b):
    return add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))


def unit(v):
    length = f32(math.sqrt(dot(v, v)))
    return [div(x, length) for x in v]


def u32(number):
    return number % (1 << 32)


def mix(v):
    v ^= v >> 16
    v = u32(v * 0x7FEB352D)
    v ^= v >> 15
    v = u32(v * 0x846CA68B)
    return v ^ v >> 16


def sample_position(x, y, sample, samples):
    if samples == 1:
        return [x + 0.5, y + 0.5]
    h = mix(u32(2654435769 * x) ^ mix(y))

    def fraction(v):
        return (u32(v) >> 8) / (1 << 24)

    first = fraction(3242174889 * sample + h)
    second = fraction(2447445414 * sample + mix(h))
    return [add(x, first), add(y, second)]


def direction_through(eye, point):
    fov, (width, height) = eye["fov"], eye["size_px"]
    across = mul(div(point[0], width), add(fov["left"], fov["right"]))
    a = add(across, -fov["left"])
    b = add(fov["up"], -mul(div(point[1], height), add(fov["up"], fov["down"])))
    axes = zip(eye["forward"], eye["right"], eye["up"])
    return unit([add(add(f, mul(r, a)), mul(u, b)) for f, r, u in axes])


def shading_normal(code):
    x, y = (div(max(c - (1 << 16) if c >> 15 else c, -32767), 32767) for c in code)
    z = add(add(1, -abs(x)), -abs(y))
    if z < 0:
        side = [-1 if v < 0 else 1 for v in (x, y)]
        x, y = mul(add(1, -abs(y)), side[0]), mul(add(1, -abs(x)), side[1])
    return unit([x, y, z])


def geometric_normal(vertices, direction):
    a, b, c = vertices
    p, q = ([f32(v - w) for v, w in zip(other, a)] for other in (b, c))
    n = [p[i] * q[j] - p[j] * q[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    length = math.sqrt(sum(x * x for x in n))
    if length == 0:
        return [0.0, 0.0, 0.0]
    towards = sum(x * d for x, d in zip(n, direction)) > 0
    return [(-x if towards else x) / length for x in n]


def column(data, count):
    """Values from their differences."""
    value, values = 0, []
    for _ in range(count):
        value = u32(value + unzigzag(data.number()))
        values.append(value)
    return values


def pairs(data, count):
    """Pairs of values, each with a column of its own."""
    values, pair = [], [0, 0]
    for _ in range(count):
        pair = [u32(last + unzigzag(data.number())) for last in pair]
        values.append(pair)
    return values


def colors(data, count):
    channels = []
    for _ in range(3):
        codes = column(data, count)
        require(all(code < 1 << 16 for code in codes), "a colour")
        channels.append([half_of(code) for code in codes])
    require(all(math.isfinite(value) for channel in channels for value in channel), "a colour")
    return [list(color) for color in zip(*channels)]


def read_ray(data, own, earlier, lighting):
    head = data.take(1)[0]
    number, outcome = head & 3 | head >> 4 & 4, head >> 2 & 3
    require(outcome < 3 and head >> 7 == 0 and number < (6 if lighting else 4), "a ray's byte")
    kind = KINDS[number]
    require((own == 0) == (kind == "primary"), "a primary ray first, then the others")
    parent, depth = None, 0
    if own == 0:
        require(not head >> 5 & 1, "a parent of a primary ray")
    else:
        parent = 0 if head >> 5 & 1 else own - data.number()
        require(0 <= parent < own and (parent > 0 or head >> 5 & 1), "a parent")
        depth = earlier[parent]["depth"] + 1
        require(depth <= 255, "a ray too deep")
    ray = {
        "kind": kind,
        "outcome": OUTCOMES[outcome],
        "depth": depth,
        "parent": parent,
        "steps": data.number(),
        "triangle_tests": data.number(),
        "alpha_tests": data.number() if head >> 4 & 1 else 0,
    }
    require(not head >> 4 & 1 or ray["alpha_tests"], "alpha tests")
    return ray


def read_visits(data, rays, bvh):
    previous = [0, 0]
    ends = [bvh["nodes"], bvh["triangles"]]
    for ray in rays:
        ray["visits"] = []
        for _ in range(ray["steps"] + ray["triangle_tests"]):
            code = data.number(1 << 34)
            kind = code & 1
            previous[kind] += unzigzag(code >> 1)
            require(0 <= previous[kind] < ends[kind], "a visit")
            address = previous[0] * bvh["bytes_per_node"]
            if kind:
                address = bvh["nodes"] * bvh["bytes_per_node"]
                address += previous[1] * bvh["bytes_per_triangle"]
            name = ["node", "triangle"][kind]
            ray["visits"].append({name: previous[kind], "address": address})


def read_tile(data, pixels, eye, meta, bvh, triangles):
    """The samples of a tile; `pixels` are its pixels row by row."""
    samples = meta["samples_per_px"]
    count = len(pixels) * samples
    bits = int.from_bytes(data.take((count + 7) // 8), "little")
    require(bits >> count == 0, "hit bits left over")
    is_hit = [bits >> i & 1 for i in range(count)]
    hits = sum(is_hit)
    primitives = column(data, hits)
    require(all(primitive in triangles for primitive in primitives), "a primitive")
    distances = [float_of(value) for value in column(data, hits)]
    require(all(math.isfinite(t) and t >= 0 for t in distances), "a distance")
    normals = pairs(data, hits)
    require(all(code < 1 << 16 for pair in normals for code in pair), "a normal")
    coordinates = [[float_of(value) for value in pair] for pair in pairs(data, hits)]
    independent = iter(colors(data, hits))
    dependent = colors(data, count)
    counts = [data.number() for _ in range(count)]
    require(all(counts), "a sample without rays")
    found = iter(zip(primitives, distances, normals, coordinates))
    out = []
    for i in range(count):
        (x, y), sample = pixels[i // samples], i % samples
        hit, color = None, [0.0, 0.0, 0.0]
        if is_hit[i]:
            primitive, t, code, uv = next(found)
            item, material, vertices = triangles[primitive]
            direction = direction_through(eye, sample_position(x, y, sample, samples))
            hit = {
                "primitive": primitive,
                "object": item,
                "material": material,
                "t": t,
                "position": [add(p, mul(t, d)) for p, d in zip(eye["position"], direction)],
                "geometric_normal": geometric_normal(vertices, direction),
                "shading_normal": shading_normal(code),
                "uv": uv,
            }
            color = next(independent)
        rays = []
        out.append(
            {
                "x": x,
                "y": y,
                "sample": sample,
                "hit": hit,
                "view_independent": color,
                "view_dependent": dependent[i],
                "rays": rays,
            }
        )
    for number, each in zip(counts, out):
        for own in range(number):
            each["rays"].append(read_ray(data, own, each["rays"], "lighting" in meta))
    rays = [ray for each in out for ray in each["rays"]]
    if meta["has_visits"]:
        read_visits(data, rays, bvh)
    data.end()
    return out, len(rays)


def check_update(update, bvh):
    instances = bvh.get("instances", {"count": 0})["count"]
    require(update["method"] in ("rebuild", "refit"), "method of the update")
    require(update["triangles_written"] <= update["triangles_read"] <= bvh["triangles"], "triangles of the update")
    require(update["instances"] <= instances, "instances of the update")
    require(update["nodes"] <= bvh["nodes"] - instances, "nodes of the update")


def geometry_entries(chunks, version, tiles):
    """Spans of the tiles' geometry, or None."""
    tags = {"RGEO", "RGIX"} & set(chunks)
    if not tags:
        return None
    require(len(tags) == 2 and version >= (1, 3), "chunks of geometry")
    index = Bytes(chunks["RGIX"])
    entries = [index.fields("QII") for _ in range(tiles)]
    index.end()
    tile_spans(entries, chunks["RGEO"])
    return entries


def hierarchy_lines(chunks, version, bvh):
    """Lines of the inner nodes and of the slots, or None."""
    tags = {"RNOD", "RSLT"} & set(chunks)
    if not tags:
        return None
    require(len(tags) == 2 and version >= (1, 3), "chunks of the hierarchy")
    return read_nodes(chunks["RNOD"], bvh), read_slots(chunks["RSLT"], bvh)


def main(path, what=None):
    chunks, version = read(path, 2)
    require(TAGS <= set(chunks), "chunks missing")
    text = parse_json(chunks["META"])
    shape = RAY_META | ({"lighting": LIGHTING} if "lighting" in text else {})
    meta = check_ray_meta(shaped(text, shape))
    summary = parse_json(chunks["RBVH"])
    instances = {"instances": {"first": "u32", "count": "u32"}} if "instances" in summary else {}
    update = {"update": UPDATE} if "update" in summary else {}
    bvh = check_hierarchy(shaped(summary, HIERARCHY | instances | update))
    if "lighting" in meta or bvh["traversal"] in ("bvh4", "cwbvh8"):
        require(version[1] >= 4, "a later version")
    if instances:
        require(version[1] >= 5, "a later version")
        require(sum(bvh["instances"].values()) <= bvh["nodes"], "instances")
    if update:
        require(version[1] >= 6, "a later version")
        check_update(bvh["update"], bvh)
    materials = shaped(parse_json(chunks["RMAT"]), (MATERIAL,))
    lights = [read_light(light) for light in shaped(parse_json(chunks["RLIT"]), ("any",))]
    triangles = read_triangles(chunks["RTRI"], materials)
    print_line(
        {
            "checksum": content_checksum(chunks),
            "meta": meta,
            "hierarchy": bvh,
            "materials": materials,
            "lights": lights,
            "triangles": [
                {"primitive": primitive, "object": item, "material": material, "vertices": v}
                for primitive, (item, material, v) in triangles.items()
            ],
        }
    )
    lines = hierarchy_lines(chunks, version, bvh)
    if what in ("--nodes", "--slots"):
        require(lines, "no hierarchy")
        for line in lines[what == "--slots"]:
            print_line(line)
        return
    width, height = meta["eyes"][0]["size_px"]
    columns, rows = -(-width // 16), -(-height // 16)
    index = Bytes(chunks["RTIX"])
    entries = [index.fields("QIIII") for _ in range(2 * columns * rows)]
    index.end()
    require(not any(entry[4] for entry in entries), "reserved bytes")
    tile_spans([entry[:3] for entry in entries], chunks["RAYS"])
    geometry = geometry_entries(chunks, version, len(entries))
    for number, (offset, size, _, rays, _) in enumerate(entries):
        eye, tile = divmod(number, columns * rows)
        top, left = (16 * n for n in divmod(tile, columns))
        pixels = [
            (x, y)
            for y in range(top, min(top + 16, height))
            for x in range(left, min(left + 16, width))
        ]
        data = Bytes(chunks["RAYS"][offset : offset + size])
        samples, found = read_tile(data, pixels, meta["eyes"][eye], meta, bvh, triangles)
        require(found == rays, "rays of a tile")
        if geometry:
            offset, size, _ = geometry[number]
            data = Bytes(chunks["RGEO"][offset : offset + size])
            for sample in samples:
                point = [sample["x"], sample["y"], sample["sample"], meta["samples_per_px"]]
                sample["primary"] = direction_through(meta["eyes"][eye], sample_position(*point))
            read_geometry(data, samples, meta["eyes"][eye], lights, bvh)
        for sample in samples:
            print_line({"eye": ["left", "right"][eye], "tile": tile, **sample})


if __name__ == "__main__":
    main(*sys.argv[1:])
