"""Converts a small track, a patch and an OBJ file that it writes, without the network: `synthetic.py FOLDER`.

Leaves the track in FOLDER/made/track.gltf. Prints `images: skipped` where Pillow is absent.
"""

import hashlib
import io
import json
import struct
import sys
import tarfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts" / "scenes"))
import debian
import download
import obj
import supertuxkart
import teapot
from track import Detail

CAMERA = {"camera": "cam", "eye": "0 1 5", "target": "0 0 0", "near": "0.1", "far": "100"}


def spm(texture, z):
    """A square of two triangles at `z` that faces -z, with normals, UVs and a colour at the first vertex."""
    data = struct.pack("<2sBB6fH", b"SP", 1 << 3 | 2, 0b011, *[0.0] * 6, 1)
    data += bytes([len(texture)]) + texture.encode() + b"\0" + struct.pack("<HHIIH", 1, 1, 4, 6, 0)
    for number, (x, y) in enumerate(((0, 0), (0, 1), (1, 1), (1, 0))):
        data += struct.pack("<3fI", x, y, z, (-511 & 1023) << 20)
        data += b"\x01\x10\x20\x30" if number == 0 else b"\x80"
        data += struct.pack("<2e", x, 1.5 * y) if texture else b""
    return data + bytes((0, 1, 2, 0, 2, 3))


def write_game(data, texture):
    track, library = data / "tracks" / "field", data / "library" / "post"
    for folder in (track, library, data / "textures"):
        folder.mkdir(parents=True)
    for path in (track / "ground.spm", track / "far.spm", track / "wall.spm", library / "post.spm"):
        path.write_bytes(spm(texture if path.stem == "ground" else "", 2.0 if path.stem == "far" else 0.0))
    (track / "trigger.spm").write_bytes(spm("invisible.png", 0.0))
    (track / "materials.xml").write_text(f'<materials><material name="{texture}" shader="alphatest"/></materials>')
    (library / "node.xml").write_text('<scene><object type="animation" model="post.spm" xyz="0 0 1" interaction="ghost"/></scene>')
    (track / "scene.xml").write_text(
        """<scene>
          <lod><group name="tree"><static-object model="wall.spm"/><static-object model="far.spm"/></group></lod>
          <track model="ground.spm" x="0" y="0" z="0">
            <static-object lod_instance="true" lod_group="tree" xyz="1 0 0" hpr="0 0 0" scale="1 1 1"/>
            <static-object lod_instance="true" lod_group="tree" xyz="90 0 0" hpr="0 0 0" scale="1 1 1"/>
            <static-object model="wall.spm" interaction="physics-only"/>
            <static-object model="trigger.spm"/>
          </track>
          <object type="animation" model="wall.spm" if="isTrackReverse"/>
          <library name="post" xyz="5 6 7" hpr="0 90 0" scale="2 2 2"/>
        </scene>"""
    )


def check_track(folder, texture=""):
    game, made = folder / f"game{texture}", folder / f"made{texture}"
    write_game(game, texture)
    made.mkdir()
    if texture:
        from PIL import Image

        Image.new("RGBA", (400, 200), (10, 20, 30, 99)).save(game / "textures" / texture)
    supertuxkart.convert(game, "field", Detail((0.0, 0.0, 0.0), 50.0), 100, [CAMERA], made, "track")
    scene = json.loads((made / "track.gltf").read_text())
    nodes = {node["name"]: node.get("matrix") for node in scene["nodes"]}
    # Near the eye the first level of detail, far from it the second; no physics, no reverse race, no trigger.
    assert list(nodes) == ["ground.0", "wall.0", "far.0", "post.0", "cam"], list(nodes)
    assert nodes["far.0"][12:15] == [90, 0, 0]
    # 90 degrees about y turn the post's z into x; then z is mirrored.
    expected = [0, 0, 2, 0, 0, 2, 0, 0, -2, 0, 0, 0, 5 + 2, 6, -7, 1]
    assert all(abs(a - b) < 1e-12 for a, b in zip(nodes["post.0"], expected)), nodes["post.0"]
    data = (made / "track.bin").read_bytes()

    def values(accessor, form):
        at = scene["bufferViews"][scene["accessors"][accessor]["bufferView"]]["byteOffset"]
        return list(struct.unpack_from(form, data, at))

    far = scene["meshes"][2]["primitives"][0]
    assert values(far["attributes"]["POSITION"], "<12f") == [0, 0, -2, 0, 1, -2, 1, 1, -2, 1, 0, -2]
    assert values(far["attributes"]["NORMAL"], "<3f") == [0, 0, 1]
    assert values(far["indices"], "<6H") == [2, 1, 0, 3, 2, 0]
    if texture:
        ground = scene["meshes"][0]["primitives"][0]
        assert values(ground["attributes"]["TEXCOORD_0"], "<8f") == [0, 0, 0, 1.5, 1, 1.5, 1, 0]
        material = scene["materials"][ground["material"]]
        assert material["alphaMode"] == "MASK" and material["name"] == "leaf", material
        image = made / scene["images"][0]["uri"]
        with Image.open(image) as shown:
            assert (image.name, shown.size, shown.mode) == ("leaf.png", (100, 50), "RGBA"), (image, shown)


def check_refusals(folder):
    """An SPM file that ends early is named with the byte."""
    game = folder / "cut"
    write_game(game, "")
    mesh = game / "tracks" / "field" / "ground.spm"
    mesh.write_bytes(mesh.read_bytes()[:60])
    try:
        supertuxkart.spm.read_mesh(mesh)
    except ValueError as error:
        assert str(mesh) in str(error) and "the file ends" in str(error), error
    else:
        raise AssertionError("a file that ends early was read")


def check_download(folder):
    file = folder / "source.txt"
    file.write_text("right")
    table = folder / "sources.csv"

    def fetch(name, text, address):
        row = f"{name},got.txt,{len(text)},{hashlib.sha256(text.encode()).hexdigest()},{address}"
        table.write_text(f"source,file,bytes,sha256,address\n{row}\n")
        return download.source(name, folder / "downloads", table)

    assert (fetch("good", "right", file.as_uri()) / "got.txt").read_text() == "right"
    for name, text, address, expected in (
        ("bad", "wrong", file.as_uri(), download.WrongFile),
        ("none", "right", (folder / "absent").as_uri(), download.Unreachable),
    ):
        try:
            fetch(name, text, address)
        except expected:
            assert list((folder / "downloads" / name).iterdir()) == [], name
        else:
            raise AssertionError(f"{name}: expected {expected}")


def check_package(folder):
    inner = io.BytesIO()
    with tarfile.open(fileobj=inner, mode="w:xz") as archive:
        for name in ("./usr/wanted/a.txt", "./usr/other/b.txt"):
            archive.addfile(tarfile.TarInfo(name), io.BytesIO())
    package = b"!<arch>\n"
    for name, data in ((b"debian-binary", b"2.0"), (b"data.tar.xz", inner.getvalue())):
        package += name.ljust(48) + str(len(data)).encode().ljust(10) + b"`\n" + data + b"\n" * (len(data) % 2)
    (folder / "a.deb").write_bytes(package)
    debian.unpack(folder / "a.deb", folder / "unpacked", ("usr/wanted/",))
    assert [path.name for path in (folder / "unpacked").rglob("*.txt")] == ["a.txt"]


def check_patch():
    """A flat patch in x and z: 512 triangles that face up, none degenerate."""
    patch = [[(float(i), 0.0, float(j)) for j in range(4)] for i in range(4)]
    positions, normals, _, indices = teapot.tessellate([patch])
    assert (len(positions), len(indices)) == (17 * 17, 512 * 3)
    assert all(normal[1] > 1 - 1e-9 for normal in normals), normals


def check_obj(folder):
    lines = ["v 0 0 0", "v 100 0 0", "v 100 100 0", "v 0 100 0", "vt 0 0 0", "vt 1 0.25 0", "vn 0 0 2", "g wall", "usemtl brick"]
    (folder / "wall.obj").write_text("\n".join([*lines, "f 1/1/1 2/2/1 3/2/1 4/1/1", ""]))
    part = obj.read(folder / "wall.obj", 0.01)["wall"]["brick"]
    assert part.indices == [0, 1, 2, 0, 2, 3] and part.positions[2] == [1, 1, 0], part
    assert part.uvs[1] == (1, 0.75) and part.normals[0] == [0, 0, 1], part


def main(folder):
    check_track(folder)
    check_refusals(folder)
    check_download(folder)
    check_package(folder)
    check_patch()
    check_obj(folder)
    try:
        import PIL  # noqa: F401
    except ModuleNotFoundError:
        print("images: skipped")
    else:
        check_track(folder, "leaf.png")


main(Path(sys.argv[1]))
