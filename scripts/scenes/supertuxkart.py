"""Converts a track of SuperTuxKart to glTF."""

import xml.etree.ElementTree as xml

import spm
from gltf import Gltf
from images import Images
from track import Track

# Textures of surfaces that the game uses as triggers.
TRIGGERS = ("invisible", "reset", "zipper")
MASKED = {"alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True}
BLENDED = {"alphaMode": "BLEND"}
GLOWING = {"emissiveFactor": [1, 1, 1]}
SHADERS = {
    "alphatest": MASKED,
    "grass": MASKED,
    "alphablend": BLENDED | {"doubleSided": True},
    "displace": BLENDED,
    "additive": GLOWING | BLENDED,
    "unlit": GLOWING,
}


class Materials:
    """One material a texture. Textures and their settings are looked up beside the mesh, in the track, in the shared folder."""

    def __init__(self, gltf, images, data, track):
        self.gltf, self.images = gltf, images
        self.shared = [data / "tracks" / track, data / "textures"]
        self.settings = {}
        self.made = {}

    def find(self, folders, name):
        return next((folder / name for folder in folders if (folder / name).is_file()), None)

    def setting(self, folder, name):
        """The entry of a folder's materials.xml for a texture."""
        if folder not in self.settings:
            file = folder / "materials.xml"
            entries = xml.parse(file).getroot() if file.is_file() else ()
            self.settings[folder] = {entry.get("name"): entry for entry in entries}
        return self.settings[folder].get(name)

    def index(self, folder, texture):
        folders = list(dict.fromkeys([folder, *self.shared]))
        base = texture and self.find(folders, texture)
        if base in self.made:
            return self.made[base]
        entries = (self.setting(folder, texture) for folder in folders)
        entry = next((entry for entry in entries if entry is not None), {})
        shader = entry.get("shader") or "solid"
        look = SHADERS.get(shader, {})
        maps = [base and self.images.uri(base, alpha="alphaMode" in look)]
        for name in (entry.get("normal-map"), entry.get("gloss-map")):
            file = name and self.find(folders, name)
            maps.append(file and self.images.uri(file))
        name = texture.rpartition(".")[0] or "none"
        self.made[base] = self.gltf.material(name, 0.8, *maps, **look, extras={"stk_shader": shader})
        return self.made[base]


def convert(data, track, detail, limit, cameras, folder, name):
    """`data` is the game's data folder; the scene goes to `folder`/`name`.gltf."""
    gltf = Gltf()
    materials = Materials(gltf, Images(folder, limit), data, track)
    for path, matrices in Track(data, track, detail).instances.items():
        primitives = [
            gltf.primitive(part.positions, part.normals, part.uvs, part.indices, materials.index(path.parent, part.texture))
            for part in spm.read_mesh(path)
            if not part.texture.startswith(TRIGGERS)
        ]
        if not primitives:
            continue
        mesh = gltf.add("meshes", {"name": path.stem, "primitives": primitives})
        for number, matrix in enumerate(matrices):
            gltf.add("nodes", {"mesh": mesh, "name": f"{path.stem}.{number}", "matrix": matrix})
    gltf.cameras(cameras)
    gltf.save(folder, name)
