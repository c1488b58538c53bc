"""docs/use/questions.md: five questions about models without cameras, each answered by one command, and the first lines of the answer.

Writes the models below OUT/questions: textured boxes without cameras, lights or scene extensions.
"""

import json
import random
import re
import struct
import textwrap
import zlib

from .common import ROOT

QUESTIONS = [
    ("Which tile order should a GPU use, and how sure is that?", "orders -- tracegen raster {scene} --hmd quest3"),
    ("Which L2 do I need?", "sweep --preset adreno-740 --orders morton,zig-zag+sta+offset --vary l2.size_bytes=128KiB,256KiB,512KiB,1MiB,2MiB -- tracegen raster {scene} --hmd quest3"),
    ("What do foveation and culling save?", "techniques -- tracegen techniques {scene} --size 480x540 --frames 4"),
    ("What does reprojection save?", "reproject -- tracegen rays {scene} --size 960x1080"),
    ("Which share of the DRAM traffic is texture?", "run --preset adreno-740 --frame tile-based -- tracegen raster {scene} --hmd quest3 --geometry"),
]
SHOWN_LINES = 3
MARKS = "<!-- transcript: {} -->\n", "<!-- end of transcript -->\n"


def png(size, noise):
    """A picture of noise at all scales."""
    rows = [[0] * size for _ in range(size)]
    for octave in range(1, size.bit_length()):
        cells = 1 << octave
        grid = [[noise.random() / octave for _ in range(cells)] for _ in range(cells)]
        for y in range(size):
            row, cell = rows[y], grid[y * cells // size]
            for x in range(size):
                row[x] += cell[x * cells // size]
    most = max(map(max, rows))
    data = b"".join(b"\0" + bytes(int(255 * value / most) for value in row for _ in range(3)) for row in rows)
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def box(size, centre, inward=False):
    """Positions, texture coordinates (2 m a repeat) and indices of a box."""
    points, coordinates, indices = [], [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1, 1):
            first = len(points)
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                point = [0, 0, 0]
                point[axis], point[u], point[v] = sign * size[axis] / 2, (a - 0.5) * size[u], (b - 0.5) * size[v]
                points.append([at + move for at, move in zip(point, centre)])
                coordinates.append([a * size[u] / 2, b * size[v] / 2])
            turn = (0, 1, 2, 0, 2, 3) if (sign > 0) != inward else (0, 2, 1, 0, 3, 2)
            indices += [first + corner for corner in turn]
    return points, coordinates, indices


def write_glb(path, boxes, textures):
    """A binary glTF file: each box is a mesh with the texture of its number."""
    blob, views, accessors, meshes = b"", [], [], []

    def view(data):
        nonlocal blob
        blob += b"\0" * (-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob += data
        return len(views) - 1

    def accessor(rows, code, component, kind, **ends):
        flat = rows if code == "I" else [value for row in rows for value in row]
        accessors.append({"bufferView": view(struct.pack(f"<{len(flat)}{code}", *flat)), "componentType": component, "count": len(rows), "type": kind, **ends})
        return len(accessors) - 1

    for number, (points, coordinates, indices) in enumerate(boxes):
        ends = {"min": [min(p[a] for p in points) for a in range(3)], "max": [max(p[a] for p in points) for a in range(3)]}
        attributes = {"POSITION": accessor(points, "f", 5126, "VEC3", **ends), "TEXCOORD_0": accessor(coordinates, "f", 5126, "VEC2")}
        meshes.append({"primitives": [{"attributes": attributes, "indices": accessor(indices, "I", 5125, "SCALAR"), "material": number % len(textures)}]})
    images = [{"bufferView": view(data), "mimeType": "image/png"} for data in textures]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(meshes)))}], "nodes": [{"mesh": i} for i in range(len(meshes))],
        "meshes": meshes, "accessors": accessors, "bufferViews": views, "images": images, "textures": [{"source": i} for i in range(len(images))],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}, "metallicFactor": 0}} for i in range(len(images))]}
    blob += b"\0" * (-len(blob) % 4)
    document["buffers"] = [{"byteLength": len(blob)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def models(noise):
    """Name, what it is, and the boxes of each model."""
    city = [box((130, 0.2, 130), (0, -0.1, 0))]
    for x in range(14):
        for z in range(15):
            height = 3 + 16 * noise.random()
            city.append(box((5, height, 5), (9 * x - 58, height / 2, 8.5 * z - 60)))
    corridor = [box((6, 4, 30), (0, 2, 0), inward=True)]
    corridor += [box((0.4, 4, 0.4), (-2.5 if i % 2 else 2.5, 2, 2.4 * i - 13)) for i in range(11)]
    yield "city", "210 buildings on a plain", city
    yield "corridor", "a corridor with columns", corridor


def run(study):
    noise = random.Random(1)
    textures = [png(512, noise) for _ in range(5)]
    text = ""
    for name, about, boxes in models(noise):
        write_glb(study.out / f"{name}.glb", boxes, textures)
        text += f"### {name}.glb: {about}\n\n"
        for question, command in QUESTIONS:
            study.say(f"{name}: {question}")
            words = command.format(scene=f"{name}.glb")
            found = study.replay("--quiet", words.replace("-- tracegen", f"-- {study.bin / 'tracegen'}"), folder=study.out).out
            lines = found.splitlines()[:SHOWN_LINES]
            text += f"{question}\n\n```text\n$ {' '.join(['replay', *words.split()])}\n" + "\n".join(lines) + "\n...\n```\n\n"
    page = ROOT / "docs/use/questions.md"
    start, end = (re.escape(mark) for mark in (MARKS[0].format("python3 -m studies questions"), MARKS[1]))
    whole, count = re.subn(f"(?s)({start}).*?({end})", lambda match: match[1] + "\n" + text + match[2], page.read_text())
    assert count == 1, f"{page}: expected one transcript between marks, found {count}"
    page.write_text(whole)
