"""The optional columns of a .raytrace: geometry of rays, and content of the hierarchy.

Written from FORMAT.md alone; see raytrace.py.
"""

import math
import struct

from container import Bytes, require, unzigzag

LARGEST = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
FARTHEST = struct.unpack("<f", struct.pack("<f", 1e18))[0]


def bits_of(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


def float_of(bits):
    return struct.unpack("<f", struct.pack("<I", bits % (1 << 32)))[0]


def rounded(number):
    """The nearest f32, infinite where it is too large for one."""
    try:
        return struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return math.copysign(math.inf, number)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(v):
    """The f32 unit vector of a vector, and its length."""
    length = math.sqrt(dot(v, v))
    return [rounded(x / length) if length else 0.0 for x in v], rounded(length)


class Stored:
    """The values of a tile, each stored by its difference from a prediction."""

    def __init__(self, data):
        self.data = data

    def value(self, there, bits):
        return float_of(bits + unzigzag(self.data.number()) if there else bits)

    def values(self, there, bits):
        return [self.value(there, each) for each in bits]


def first_values():
    return {
        "shift": [0, 0, 0],
        "direction": [0.0, 0.0, 0.0],
        "t_min": 0.0,
        "t_max": LARGEST,
        "t": 0.0,
        "slot": 0,
    }


def predicted_origin(ray, rays, eye, last):
    """Bits of the origin, and the parent's point if it is the ray's first of its side."""
    if ray["kind"] == "primary":
        return [bits_of(x) for x in eye["position"]], None
    siblings = [
        other
        for other in rays
        if other["parent"] == ray["parent"]
        and other["kind"] != "primary"
        and (other["kind"] == "refraction") == (ray["kind"] == "refraction")
    ]
    if siblings:
        return [bits_of(x) for x in siblings[-1]["origin"]], None
    parent = rays[ray["parent"]]
    t = parent["t"] if parent["t"] is not None else 0.0
    point = [bits_of(rounded(o + t * d)) for o, d in zip(parent["origin"], parent["direction"])]
    return [bits + shift for bits, shift in zip(point, last["shift"])], point


def predicted_light(ray, rays, lights):
    before = [
        other["light"]
        for other in rays
        if other["parent"] == ray["parent"] and other["kind"] == "shadow"
    ]
    light = before[-1] + 1 if before else 0
    return light if light < len(lights) else 0


def predicted_direction(ray, rays, sample, lights, last):
    """Direction, and the distance to a point light."""
    if ray["kind"] == "primary":
        return sample["primary"], None
    parent = rays[ray["parent"]]
    if ray["kind"] == "shadow" and lights:
        light = lights[ray["light"]]
        if light["kind"] == "directional":
            return [-x for x in light["direction"]], None
        return unit([p - o for p, o in zip(light["position"], ray["origin"])])
    if ray["kind"] == "reflection" and ray["parent"] == 0 and sample["hit"]:
        d, n = parent["direction"], sample["hit"]["shading_normal"]
        twice = 2 * dot(d, n)
        return unit([x - twice * y for x, y in zip(d, n)])[0], None
    if ray["kind"] == "refraction":
        return parent["direction"], None
    return last["direction"], None


def read_geometry_of(ray, rays, sample, eye, lights, last, data):
    """Adds the geometry of a ray; `rays` are those before it in its sample."""
    stored = Stored(data)
    flags = data.take(1)[0]
    hits = ray["outcome"] != "miss"
    shadow = ray["kind"] == "shadow"
    require(flags < 64, "flags of a ray")
    require(not flags & 16 or shadow and lights, "a light of no shadow ray")
    require(not flags & 32 or hits, "a distance of a miss")
    if shadow:
        ray["light"] = data.number() if flags & 16 else predicted_light(ray, rays, lights)
        require(not lights or ray["light"] < len(lights), "a light")
    origin, point = predicted_origin(ray, rays, eye, last)
    ray["origin"] = stored.values(flags & 1, origin)
    direction, distance = predicted_direction(ray, rays, sample, lights, last)
    ray["direction"] = stored.values(flags & 2, [bits_of(x) for x in direction])
    ray["t_min"] = stored.value(flags & 4, bits_of(last["t_min"]))
    farthest = last["t_max"] if distance is None else distance
    ray["t_max"] = stored.value(flags & 8, bits_of(farthest))
    t = last["t"]
    if ray["kind"] == "primary":
        t = sample["hit"]["t"] if sample["hit"] else 0.0
    t = stored.value(flags & 32, bits_of(t))
    ray["t"], ray["slot"] = None, None
    if hits:
        ray["t"] = last["t"] = t
        ray["slot"] = last["slot"] = (last["slot"] + unzigzag(data.number())) % (1 << 32)
    ray["stack_depth"] = data.number()
    if point:
        last["shift"] = [bits_of(x) - y for x, y in zip(ray["origin"], point)]
    last["direction"], last["t_min"] = ray["direction"], ray["t_min"]
    if distance is None:
        last["t_max"] = ray["t_max"]


def check_ray(ray, bvh):
    require(all(abs(x) <= FARTHEST for x in ray["origin"]), "an origin")
    require(abs(dot(ray["direction"], ray["direction"]) - 1) <= 0.001, "a direction")
    require(0 <= ray["t_min"] <= ray["t_max"] <= LARGEST, "limits of a ray")
    if ray["t"] is not None:
        require(ray["t_min"] <= ray["t"] <= ray["t_max"], "a distance")
        require(ray["slot"] < bvh["triangles"], "a slot")


def read_geometry(data, samples, eye, lights, bvh):
    """Adds the geometry of a tile's rays; `primary` of a sample is the direction of its first."""
    kinds = {}
    for sample in samples:
        for own, ray in enumerate(sample["rays"]):
            last = kinds.setdefault(ray["kind"], first_values())
            before = sample["rays"][:own]
            read_geometry_of(ray, before, sample, eye, lights, last, data)
            check_ray(ray, bvh)
        del sample["primary"]
        for ray in sample["rays"]:
            ray.pop("light", None)
    data.end()


def check_box(low, high):
    ordered = all(a <= b for a, b in zip(low, high))
    require(ordered and all(abs(x) <= FARTHEST for x in low + high), "a box")


def read_nodes(chunk, bvh):
    data = Bytes(chunk)
    width = {"bvh2": 2, "bvh4": 4, "bvh8": 8, "cwbvh8": 8}[bvh["traversal"]]
    require(bvh["nodes"] * width <= data.left(), "more nodes than bytes")
    boxes = {0: [0.0] * 6}
    taken, leaves, next_slot = set(), 0, 0
    lines = []
    for node in range(bvh["nodes"]):
        require(node in boxes, "a node without a parent")
        own, children = boxes.pop(node), []
        for _ in range(width):
            code = data.number(1 << 35)
            kind, difference = code & 3, unzigzag(code >> 2)
            if code == 0:
                children.append(None)
                continue
            require(kind in (1, 2), "a kind of child")
            child = {}
            if kind == 1:
                child["node"] = node + difference
                require(node < child["node"] < bvh["nodes"], "a child")
            else:
                child["slot"] = next_slot + difference
                child["triangles"] = data.number() + 1
                next_slot = child["slot"] + child["triangles"]
                require(0 <= child["slot"] and next_slot <= bvh["triangles"], "a leaf")
                slots = set(range(child["slot"], next_slot))
                require(not taken & slots, "a slot in two leaves")
                taken |= slots
                leaves += 1
            planes = data.take(1)[0]
            require(planes < 64, "bits of planes")
            stored = Stored(data)
            box = [stored.value(planes >> i & 1, bits_of(own[i])) for i in range(6)]
            check_box(box[:3], box[3:])
            if kind == 1:
                require(child["node"] not in boxes, "a node with two parents")
                boxes[child["node"]] = box
            child["min"], child["max"] = box[:3], box[3:]
            children.append(child)
        address = node * bvh["bytes_per_node"]
        lines.append({"node": node, "address": address, "children": children})
    data.end()
    require(len(taken) == bvh["triangles"] and leaves == bvh["leaves"], "leaves")
    return lines


def read_slots(chunk, bvh):
    data = Bytes(chunk)
    require(bvh["triangles"] * 4 <= data.left(), "more triangles than bytes")
    first = bvh["nodes"] * bvh["bytes_per_node"]
    vertices, primitive, lines = [], 0, []
    for slot in range(bvh["triangles"]):
        code = data.number(1 << 34)
        primitive += unzigzag(code >> 1)
        require(0 <= primitive < 1 << 32, "a primitive")
        for _ in range(3):
            back = data.number()
            require(back <= min(48, len(vertices)), "a vertex back")
            if back:
                vertex = vertices[-back]
            else:
                before = vertices[-1] if vertices else [0.0, 0.0, 0.0]
                vertex = Stored(data).values(True, [bits_of(x) for x in before])
            require(all(abs(x) <= FARTHEST for x in vertex), "a vertex")
            vertices.append(vertex)
        lines.append(
            {
                "slot": slot,
                "address": first + slot * bvh["bytes_per_triangle"],
                "primitive": primitive,
                "masked": bool(code & 1),
                "vertices": vertices[-3:],
            }
        )
        del vertices[:-48]
    data.end()
    return lines
