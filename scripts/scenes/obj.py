"""Reads a Wavefront OBJ file: objects (`g`) of triangles by material."""

from math import hypot
from typing import NamedTuple


class Part(NamedTuple):
    """Triangles of one material. Vertices with the same position, UV and normal are one."""

    positions: list
    normals: list
    uvs: list
    indices: list
    numbers: dict


def read(path, scale):
    """Parts by material by object, positions times `scale`, v downwards as in glTF."""
    values = {"v": [], "vt": [], "vn": []}
    objects, part = {}, None
    with open(path, encoding="ascii") as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word in values:
                values[word].append(tuple(float(value) for value in rest))
            elif word == "g" and rest:
                parts = objects.setdefault(rest[0], {})
            elif word == "usemtl":
                part = parts.setdefault(rest[0], Part([], [], [], [], {}))
            elif word == "f":
                corners = [vertex(part, values, corner, scale) for corner in rest]
                for second, third in zip(corners[1:], corners[2:]):
                    part.indices.extend((corners[0], second, third))
    return objects


def vertex(part, values, corner, scale):
    """The index in `part` of a corner `position/UV/normal`, which is added the first time."""
    found = tuple(values[name][int(number) - 1] for name, number in zip(("v", "vt", "vn"), corner.split("/")))
    if found not in part.numbers:
        position, uv, normal = found
        part.numbers[found] = len(part.positions)
        part.positions.append([value * scale for value in position])
        part.uvs.append((uv[0], 1.0 - uv[1]))
        length = hypot(*normal) or 1.0
        part.normals.append([value / length for value in normal])
    return part.numbers[found]
