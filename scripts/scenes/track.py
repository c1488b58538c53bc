"""The meshes that a SuperTuxKart track shows, and where: scene.xml with the library nodes it places.

The game is left-handed and glTF right-handed: matrices are mirrored at z = 0. Objects that only physics sees
and those of the reverse race are left out.
"""

import math
import xml.etree.ElementTree as xml
from typing import NamedTuple

PHYSICS_ONLY = ("physics-only", "physicsonly")


class Detail(NamedTuple):
    """The finest level of detail within `distance` of `eye` (right-handed), the next one beyond; finest everywhere without an eye."""

    eye: tuple = ()
    distance: float = math.inf

    def pick(self, levels, matrix):
        far = self.eye and math.dist(self.eye, matrix[12:15]) > self.distance
        return levels[min(1, len(levels) - 1) if far else 0]


def numbers(node, name, default):
    return [float(value) for value in node.get(name, default).split()]


def local_matrix(node):
    """Column-major, as glTF stores it: translation, rotations about z, y and x, scale; mirrored at z = 0."""
    x, y, z = numbers(node, "xyz", "0 0 0")
    a, b, c = (math.radians(angle) for angle in numbers(node, "hpr", "0 0 0"))
    (sa, ca), (sb, cb), (sc, cc) = ((math.sin(angle), math.cos(angle)) for angle in (a, b, c))
    columns = (
        (cb * cc, cb * sc, -sb),
        (sa * sb * cc - ca * sc, sa * sb * sc + ca * cc, sa * cb),
        (ca * sb * cc + sa * sc, ca * sb * sc - sa * cc, ca * cb),
    )
    matrix = []
    for column, scale in zip(columns, numbers(node, "scale", "1 1 1")):
        matrix += [value * scale for value in column] + [0.0]
    matrix += [x, y, z, 1.0]
    for i in (2, 6, 8, 9, 14):
        matrix[i] = -matrix[i]
    return matrix


def multiply(a, b):
    return [sum(a[4 * k + row] * b[4 * column + k] for k in range(4)) for column in range(4) for row in range(4)]


IDENTITY = [float(i % 5 == 0) for i in range(16)]


class Track:
    def __init__(self, data, name, detail):
        self.data = data
        self.detail = detail
        self.instances = {}
        self.place(data / "tracks" / name, "scene.xml", IDENTITY)

    def place(self, folder, file, parent):
        """Adds what one file shows to `instances`: matrices by the path of the mesh."""
        root = xml.parse(folder / file).getroot()
        groups = {group.get("name"): [level.get("model") for level in group] for group in root.iterfind("lod/group")}
        for node in root:
            if node.tag == "track":
                self.show(folder / node.get("model"), parent)
                for child in node.iterfind("static-object"):
                    self.place_object(folder, child, groups, parent)
            elif node.tag == "object":
                self.place_object(folder, node, groups, parent)
            elif node.tag == "library" and shown(node):
                self.place(self.data / "library" / node.get("name"), "node.xml", multiply(parent, local_matrix(node)))

    def place_object(self, folder, node, groups, parent):
        levels = groups.get(node.get("lod_group")) or [node.get("model")]
        if not shown(node) or levels == [None]:
            return
        matrix = multiply(parent, local_matrix(node))
        self.show(folder / self.detail.pick(levels, matrix), matrix)

    def show(self, mesh, matrix):
        self.instances.setdefault(mesh, []).append(matrix)


def shown(node):
    return node.get("interaction") not in PHYSICS_ONLY and node.get("if", "isTrackNotReverse") == "isTrackNotReverse"
