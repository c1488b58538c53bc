"""Writes glTF 2.0: one .gltf, one .bin, images beside them."""

import json
import math
import struct

FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TRILINEAR_REPEAT = {"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}


def look_at(eye, target):
    """Column-major matrix of a camera at `eye` that looks at `target`, y up."""
    back = [a - b for a, b in zip(eye, target)]
    length = math.hypot(*back)
    z = [value / length for value in back]
    length = math.hypot(z[2], z[0])
    x = [z[2] / length, 0.0, -z[0] / length]
    y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
    return [*x, 0.0, *y, 0.0, *z, 0.0, *eye, 1.0]


class Gltf:
    def __init__(self):
        self.data = bytearray()
        self.document = {"asset": {"version": "2.0", "generator": "Parallax, scripts/scenes"}, "scene": 0}
        self.lists = {name: [] for name in ("nodes", "meshes", "materials", "accessors", "bufferViews", "images", "textures", "cameras")}

    def add(self, name, item):
        self.lists[name].append(item)
        return len(self.lists[name]) - 1

    def accessor(self, rows, component, kind, target, bounds=False):
        flat = [value for row in rows for value in row] if kind != "SCALAR" else rows
        code = {FLOAT: "f", UNSIGNED_SHORT: "H", UNSIGNED_INT: "I"}[component]
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(flat) * struct.calcsize(code), "target": target}
        self.data += struct.pack(f"<{len(flat)}{code}", *flat)
        item = {"bufferView": self.add("bufferViews", view), "componentType": component, "count": len(rows), "type": kind}
        if bounds:
            columns = list(zip(*struct.iter_unpack("<3f", self.data[-4 * len(flat) :])))
            item |= {"min": [min(column) for column in columns], "max": [max(column) for column in columns]}
        return self.add("accessors", item)

    def primitive(self, positions, normals, uvs, indices, material):
        attributes = {
            "POSITION": self.accessor(positions, FLOAT, "VEC3", ARRAY_BUFFER, bounds=True),
            "NORMAL": self.accessor(normals, FLOAT, "VEC3", ARRAY_BUFFER),
            "TEXCOORD_0": self.accessor(uvs, FLOAT, "VEC2", ARRAY_BUFFER),
        }
        component = UNSIGNED_SHORT if len(positions) <= 65535 else UNSIGNED_INT
        return {
            "attributes": attributes,
            "indices": self.accessor(indices, component, "SCALAR", ELEMENT_ARRAY_BUFFER),
            "material": material,
            "mode": 4,
        }

    def texture(self, uri):
        """The texture of an image file; a file has one."""
        image = {"uri": uri}
        if image in self.lists["images"]:
            return {"index": self.lists["images"].index(image)}
        self.document["samplers"] = [TRILINEAR_REPEAT]
        return {"index": self.add("textures", {"source": self.add("images", image), "sampler": 0})}

    def material(self, name, roughness, base=None, normal=None, specular=None, colour=(1, 1, 1), **rest):
        """A material of images by their file names, which are numbered in the order base colour, normals, specular."""
        item = {"name": name, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": roughness, "baseColorFactor": [*colour, 1]}}
        if base:
            item["pbrMetallicRoughness"]["baseColorTexture"] = self.texture(base)
        if normal:
            item["normalTexture"] = self.texture(normal)
        if specular:
            item["extensions"] = {"KHR_materials_specular": {"specularColorTexture": self.texture(specular)}}
            self.document["extensionsUsed"] = ["KHR_materials_specular"]
        return self.add("materials", item | rest)

    def cameras(self, rows):
        for row in rows:
            lens = {"yfov": 1.0472, "aspectRatio": 16 / 9, "znear": float(row["near"]), "zfar": float(row["far"])}
            camera = self.add("cameras", {"name": row["camera"], "type": "perspective", "perspective": lens})
            eye, target = ([float(value) for value in row[name].split()] for name in ("eye", "target"))
            self.add("nodes", {"name": row["camera"], "camera": camera, "matrix": look_at(eye, target)})

    def save(self, folder, name):
        self.document["scenes"] = [{"nodes": list(range(len(self.lists["nodes"])))}]
        self.document["buffers"] = [{"uri": f"{name}.bin", "byteLength": len(self.data)}]
        self.document |= {key: items for key, items in self.lists.items() if items}
        (folder / f"{name}.bin").write_bytes(self.data)
        (folder / f"{name}.gltf").write_text(json.dumps(self.document))
