"""Converts Crytek Sponza from Crytek's OBJ and TGA files: centimetres to metres, specular maps through KHR_materials_specular."""

import csv
import io
from pathlib import Path

import obj
from gltf import Gltf
from images import Images
from PIL import Image

# The floating banner without a texture, which McGuire's release leaves out too.
BANNER = "16___Default"


# Numbers of DXGI formats in the header of a DDS file. Pillow refuses the second, whose blocks are the same.
DXGI_AT, BC1, BC1_SRGB = 128, 71, 72


def open_dds(path):
    data = bytearray(path.read_bytes())
    if data[DXGI_AT] == BC1_SRGB:
        data[DXGI_AT] = BC1
    return Image.open(io.BytesIO(data))


def grey(image):
    """The image with one channel if its three are the same."""
    red, *others = (channel.tobytes() for channel in image.split())
    return image.convert("L") if others == [red, red] else image


def convert(sources, cameras, folder, name):
    gltf = Gltf()
    images = Images(folder)
    materials = {}

    def jpeg(stem):
        """Curtains come as 2048x2048 BC1 blocks, the others as TGA."""
        dds = sources / f"{stem.removesuffix('_diff')}.DDS"
        options = {"quality": 88} if dds.is_file() else {"quality": 92, "subsampling": 0}
        with open_dds(dds) if dds.is_file() else Image.open(sources / f"{stem}.tga") as image:
            return images.once(f"{stem}.jpg", lambda: grey(image.convert("RGB")), **options)

    def png(stem, mask=None):
        with Image.open(sources / f"{stem}.tga") as image:
            image = image.convert("RGB")
        if mask:
            with Image.open(sources / f"{mask}.tga") as alpha:
                image.putalpha(alpha.convert("L"))
        return images.once(f"{stem}_alpha.png" if mask else f"{stem}.png", lambda: image)

    with open(Path(__file__).with_name("crytek-sponza.csv"), newline="") as table:
        for row in csv.DictReader(table):
            base = row["diffuse"] and (png(row["diffuse"], row["mask"]) if row["mask"] else jpeg(row["diffuse"]))
            normal = row["normal"] and png(row["normal"])
            specular = row["specular"] and jpeg(row["specular"])
            look = {"alphaMode": "MASK", "alphaCutoff": 0.5} if row["mask"] else {}
            if row["sides"] == "2":
                look["doubleSided"] = True
            materials[row["material"]] = gltf.material(row["material"], 0.7, base, normal, specular, **look)
    for title, parts in obj.read(sources / "sponza.obj", 0.01).items():
        primitives = [
            gltf.primitive(part.positions, part.normals, part.uvs, part.indices, materials[material])
            for material, part in parts.items()
            if material != BANNER and part.indices
        ]
        if primitives:
            gltf.add("nodes", {"mesh": gltf.add("meshes", {"name": title, "primitives": primitives}), "name": title})
    gltf.cameras(cameras)
    gltf.save(folder, name)
