"""Reads SPM, the mesh format of SuperTuxKart, version 1 (static and skinned meshes in their rest pose).

Little-endian: "SP", type and version, flags, bounding box, materials (two texture names each), then mesh
buffers. A vertex is position, [normal], [colour], [UV, [second UV], [tangent]], [joints and weights].
"""

import struct
from ctypes import c_float
from functools import cache
from math import sqrt
from typing import NamedTuple

ANIMATED = 1
HAS_NORMAL, HAS_COLOUR, HAS_TANGENT = 1, 2, 4
WHITE = 128


class Primitive(NamedTuple):
    """Triangles of one material, right-handed: z is negated and the winding reversed."""

    texture: str
    positions: list
    normals: list
    uvs: list
    indices: list


class Reader:
    def __init__(self, path):
        self.path = path
        self.data = path.read_bytes()
        self.at = 0

    def take(self, form):
        form = "<" + form
        end = self.at + struct.calcsize(form)
        if end > len(self.data):
            raise ValueError(f"{self.path}: byte {self.at}: the file ends, expected {end - self.at} more bytes")
        values = struct.unpack_from(form, self.data, self.at)
        self.at = end
        return values if len(values) > 1 else values[0]

    def name(self):
        return self.take(f"{length}s").decode() if (length := self.take("B")) else ""


def single(value):
    return c_float(value).value


@cache
def unpack_normal(packed):
    """Three signed 10-bit components; z is negated. In single precision, as the scenes of the results have it."""
    parts = [(packed >> shift) & 1023 for shift in (0, 10, 20)]
    x, y, z = (single((part - 1024 if part > 511 else part) / 511.0) for part in parts)
    length = single(sqrt(single(single(single(x * x) + single(y * y)) + single(z * z)))) or 1.0
    return x / length, y / length, -z / length


def read_primitive(reader, flags, animated, materials):
    vertices, index_count, material = reader.take("IIH")
    texture, second = materials[material]
    positions, normals, uvs = [], [], []
    for _ in range(vertices):
        x, y, z = reader.take("3f")
        positions.append((x, y, -z))
        normals.append(unpack_normal(reader.take("I")) if flags & HAS_NORMAL else (0.0, 1.0, 0.0))
        if flags & HAS_COLOUR and reader.take("B") != WHITE:
            reader.take("3B")
        uvs.append(reader.take("2e") if texture else (0.0, 0.0))
        if texture:
            reader.at += 4 * bool(second) + 4 * bool(flags & HAS_TANGENT)
        reader.at += 16 * animated
    indices = reader.take(f"{index_count}{'H' if vertices > 255 else 'B'}")
    turned = [index for i in range(0, index_count, 3) for index in (indices[i + 2], indices[i + 1], indices[i])]
    return Primitive(texture, positions, normals, uvs, turned)


def read_mesh(path):
    reader = Reader(path)
    magic, kind, flags = reader.take("2sBB")
    if magic != b"SP" or kind >> 3 != 1 or kind & 7 not in (ANIMATED, 2):
        raise ValueError(f"{path}: expected an SPM mesh of version 1, found {magic!r}, {kind:#04x}")
    reader.take("6f")
    materials = [(reader.name(), reader.name()) for _ in range(reader.take("H"))]
    return [
        read_primitive(reader, flags, kind & 7 == ANIMATED, materials)
        for _ in range(reader.take("H"))
        for _ in range(reader.take("H"))
    ]
