"""Tessellates the Utah teapot: 32 bicubic Bezier patches, 16x16 quads each, and a floor of two triangles. Y up."""

from math import comb, hypot

from gltf import Gltf

STEPS = 16


def read_patches(path):
    words = iter(path.read_text().split())
    for _ in range(int(next(words))):
        rows, columns = int(next(words)) + 1, int(next(words)) + 1
        # The file has z up.
        points = [[float(next(words)) for _ in range(3)] for _ in range(rows * columns)]
        yield [[(x, z, -y) for x, y, z in points[row * columns :][:columns]] for row in range(rows)]


def weights(t, degree=3):
    return [comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]


def slopes(t):
    """Derivatives of the weights."""
    lower = weights(t, 2)
    return [3 * ((lower[i - 1] if i else 0) - (lower[i] if i < 3 else 0)) for i in range(4)]


def point(patch, u, v):
    return [sum(u[i] * v[j] * patch[i][j][axis] for i in range(4) for j in range(4)) for axis in range(3)]


def unit(a, b):
    """The direction of the cross product, or None."""
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    length = hypot(*cross)
    return [value / length for value in cross] if length > 1e-9 else None


def normal(patch, u, v):
    """At a collapsed edge the tangents vanish, and a point nearby stands for it."""
    for nudge in (0, 1e-4):
        s, t = (min(max(value, nudge), 1 - nudge) for value in (u, v))
        found = unit(point(patch, weights(s), slopes(t)), point(patch, slopes(s), weights(t)))
        if found:
            return found
    return [0.0, 1.0, 0.0]


def tessellate(patches):
    positions, normals, uvs, indices = [], [], [], []
    for patch in patches:
        first = len(positions)
        for i in range(STEPS + 1):
            for j in range(STEPS + 1):
                u, v = i / STEPS, j / STEPS
                positions.append(point(patch, weights(u), weights(v)))
                normals.append(normal(patch, u, v))
                uvs.append((u, v))
        row = STEPS + 1
        for triangle in ((row + 1, row, 0), (1, row + 1, 0)):
            for quad in (i * row + j for i in range(STEPS) for j in range(STEPS)):
                corners = [first + quad + corner for corner in triangle]
                if not degenerate(*(positions[corner] for corner in corners)):
                    indices.extend(corners)
    return positions, normals, uvs, indices


def degenerate(a, b, c):
    sides = ([q - p for p, q in zip(a, other)] for other in (b, c))
    return unit(*sides) is None


def convert(sources, cameras, folder, name):
    gltf = Gltf()
    glaze = gltf.material("glaze", 0.15, colour=(0.75, 0.78, 0.85))
    ground = gltf.material("floor", 0.9, colour=(0.45, 0.4, 0.35))
    corners = [(-8.0, 0.0, -8.0), (8.0, 0.0, -8.0), (8.0, 0.0, 8.0), (-8.0, 0.0, 8.0)]
    floor = (corners, [(0.0, 1.0, 0.0)] * 4, [(0, 0), (4, 0), (4, 4), (0, 4)], [0, 2, 1, 0, 3, 2])
    for title, geometry, material in (("teapot", tessellate(read_patches(sources / "teapot.bpt")), glaze), ("floor", floor, ground)):
        mesh = gltf.add("meshes", {"name": title, "primitives": [gltf.primitive(*geometry, material)]})
        gltf.add("nodes", {"mesh": mesh, "name": title})
    gltf.cameras(cameras)
    gltf.save(folder, name)
