"""Prints a .textrace: a line of JSON with the tables, then one for each record.

    python3 textrace.py FILE [--lists | --vertex-reads]

With --lists it prints a line for each tile of each view of the geometry instead, with --vertex-reads one for each
texture read of a vertex shader.
Written from FORMAT.md alone; see container.py.
"""

import struct
import sys

from container import META, Bytes, check_meta, content_checksum, parse_json, print_line, read
from container import require
from container import shaped, tile_spans, unzigzag
from planes import decode_planes, read_codes

ENCODINGS = (0, 1, 3)
TAGS = {
    1: ["META", "TEXS", "SMPS", "DRAW", "PASS", "TILE", "TIDX"],
    2: ["TILE", "TIDX", "META", "TEXS", "SMPS", "DRAW", "PASS"],
}
TAGS[3] = TAGS[2]
# Versions 4 and 5 have the tables of versions 1 and 3.
TABLES = {1: 1, 2: 2, 3: 3, 4: 1, 5: 3}
MOST_REPEATS = 63
GEOMETRY_TAGS = ["GEOM", "PLST", "PLIX"]
FORMATS = {
    1: "bc1",
    3: "bc3",
    7: "bc7",
    10: "etc2",
    11: "etc2-rgba",
    20: "astc-4x4",
    21: "astc-5x5",
    22: "astc-6x6",
    23: "astc-8x8",
    40: "rgba8",
    41: "r32f",
}
FORMATS_2 = {
    **FORMATS,
    2: "bc2",
    4: "bc4",
    5: "bc5",
    6: "bc6h",
    12: "eac-r11",
    13: "eac-rg11",
    42: "r8",
    43: "rg8",
    44: "packed16",
    45: "r16",
    46: "rg16",
    47: "rgba16",
    48: "rg32",
    49: "rgba32",
    50: "packed32",
    51: "d16",
}
WRAPS = {0: "repeat", 1: "mirrored-repeat", 2: "clamp-to-edge"}
WRAPS_2 = {**WRAPS, 3: "clamp-to-border", 4: "mirror-clamp-to-edge"}
LOD_RULES = {0: "derivatives", 1: "bias", 2: "explicit"}
WHOLE_LOD = {"bias_256ths": 0, "min_256ths": -32768, "max_256ths": 32767}
FILTERS = {0: "nearest", 1: "linear"}
MIP_FILTERS = {0: "none", 1: "nearest", 2: "linear"}
NO_GROUP = 15
NO_PART = 0xFFFFFFFF
DEPTHS = {"r32f", "d16"}
WIDE = {"bc6h", "r16", "rg16", "rgba16", "rg32", "rgba32", "packed32", "r32f", "d16"}
# Texels along a block's edge and bytes of a block; of formats without blocks, bytes of a texel where not 4.
BLOCKS = {name: (4, 8) for name in ("bc1", "bc4", "etc2", "eac-r11")}
BLOCKS |= {name: (4, 16) for name in ("bc2", "bc3", "bc5", "bc6h", "bc7", "etc2-rgba", "eac-rg11", "astc-4x4")}
BLOCKS |= {"astc-5x5": (5, 16), "astc-6x6": (6, 16), "astc-8x8": (8, 16)}
TEXEL_BYTES = {"r8": 1, "rg8": 2, "r16": 2, "packed16": 2, "d16": 2, "rgba16": 8, "rg32": 8, "rgba32": 16}
PROGRAM = {
    "cameras_known": "bool",
    "frames_by": "string",
    "views_by": "string",
    "left_out": ({"what": "string", "draws": "u64", "fragments": "u64"},),
}
WIDTHS = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 18, 24, 32]


def named(names, number):
    require(number in names, f"an unknown id, {number}")
    return names[number]


def read_texture(data, major):
    width, height, levels, layers, fmt, space, zero = data.fields("IIIIHBB")
    whole, level, layer = data.fields("III") if major >= 3 else (NO_PART, 0, 0)
    require(1 <= width <= 65536 and 1 <= height <= 65536, "size of a texture")
    require(1 <= levels <= max(width, height).bit_length(), "mip levels")
    require(1 <= layers <= 65536 and zero == 0, "layers or reserved byte")
    texture = {
        "size": [width, height],
        "levels": levels,
        "layers": layers,
        "format": named(FORMATS_2 if major >= 2 else FORMATS, fmt),
        "color_space": named({0: "linear", 1: "srgb"}, space),
        "name": data.name(),
    }
    if whole != NO_PART:
        texture["part"] = {"of": whole, "level": level, "layer": layer}
    else:
        require(level == layer == 0, "a place of what is no part")
    return texture


def block(fmt):
    return BLOCKS.get(fmt, (1, TEXEL_BYTES.get(fmt, 4)))


def check_parts(textures):
    for texture in textures:
        if "part" not in texture:
            continue
        part = texture["part"]
        require(part["of"] < len(textures), "a part of nothing")
        whole = textures[part["of"]]
        require("part" not in whole, "a part of a part")
        for of, counts in (("level", "levels"), ("layer", "layers")):
            require(part[of] + texture[counts] <= whole[counts], f"{counts} that are not there")
        size = [max(1, side >> part["level"]) for side in whole["size"]]
        require(texture["size"] == size, "the size of a part")
        formats = texture["format"], whole["format"]
        for same in (block, DEPTHS.__contains__, WIDE.__contains__):
            require(same(formats[0]) == same(formats[1]), "the format of a part")


def read_sampler(data, major):
    u, v, mag, small, mip = data.fields("5B")
    wraps = WRAPS_2 if major >= 2 else WRAPS
    sampler = {
        "wrap": [named(wraps, u), named(wraps, v)],
        "mag": named(FILTERS, mag),
        "min": named(FILTERS, small),
        "mip": named(MIP_FILTERS, mip),
    }
    if major >= 2:
        lod = dict(zip(WHOLE_LOD, data.fields("3h")))
        if lod != WHOLE_LOD:  # replay leaves out what changes nothing
            sampler["lod"] = lod
    if major >= 3:
        most = data.field("H")
        require(256 <= most <= 4096, "a largest anisotropy")
        if most != 256:
            sampler["max_anisotropy_256ths"] = most
    return sampler


def read_level(data):
    rule, operands, lod = data.fields("BBh")
    require(operands <= 1 and (rule != 0 or lod == 0), "a level of detail")
    return {"rule": named(LOD_RULES, rule), "lod_256ths": lod, "operands": operands == 1}


def asks_operands(group):
    return any("level" in s and s["level"]["operands"] for s in group["samples"])


def read_group(data, textures, samplers, major):
    width, height, count = data.fields("IIH")
    require(1 <= width <= 65536 and 1 <= height <= 65536, "extent")
    samples = []
    for _ in range(count):
        texture, sampler, layer, x, y = data.fields("IHHbb")
        require(texture < len(textures) and sampler < len(samplers), "a sample of nothing")
        require(layer < textures[texture]["layers"], "a layer that is not there")
        sample = {"texture": texture, "sampler": sampler, "layer": layer, "offset": [x, y]}
        level = read_level(data) if major >= 2 else {"rule": "derivatives", "operands": False}
        if level["rule"] != "derivatives" or level["operands"]:
            sample["level"] = level
        samples.append(sample)
    return {"extent": [width, height], "samples": samples}


def read_draw(data, textures, samplers, major):
    first, primitives, count = data.fields("IIH")
    require(first + primitives < 1 << 32 and count <= 15, "a draw")
    material = data.name()
    groups = [read_group(data, textures, samplers, major) for _ in range(count)]
    for number, group in enumerate(groups):
        if asks_operands(group):
            require(number > 0, "operands of the first group")
            require(groups[number - 1] == {"extent": [1, 1], "samples": []}, "a group of operands")
    return {
        "material": material,
        "first_primitive": first,
        "primitives": primitives,
        "groups": groups,
    }


def read_pass(data, meta):
    frame, kind, eye, layer, width, height, columns, rows = data.fields("IBBHIIII")
    require(columns >= 1 and rows >= 1, "a pass")
    require((columns, rows) == (-(-width // 16), -(-height // 16)), "tiles of a pass")
    require(frame in [views["frame"] for views in meta["frames"]], "a frame that is not there")
    kind = named({0: "main", 1: "shadow", 2: "layer"}, kind)
    require(kind == "layer" or layer == 0, "a number of what is no layer")
    eye = named({0: "left", 1: "right", 255: None}, eye)
    if kind == "main" and eye:
        require([width, height] == meta["hmd"]["eye_size_px"], "size of an eye's picture")
    return {
        "frame": frame,
        "kind": kind,
        "eye": eye,
        "layer": layer,
        "size_px": [width, height],
        "tiles": [columns, rows],
    }


def check_layers(layers, version):
    require(version >= (1, 1) or not layers, "layers in a file of version 1.0")
    numbers = {(each["frame"], each["eye"], each["layer"]) for each in layers}
    require(len(numbers) == len(layers), "two layers of a number")


def read_table(chunk, least_bytes, entry):
    data = Bytes(chunk)
    items = [entry(data) for _ in range(data.count(least_bytes))]
    data.end()
    return items


def every_other_bit(number):
    return number & 1 | number >> 1 & 2 | number >> 2 & 4


def i32(number):
    return (number + (1 << 31)) % (1 << 32) - (1 << 31)


def decode_raw(data, runs, records):
    heads = [data.fields("III") for _ in range(runs)]
    rows = []
    for _ in range(records):
        x, y, mask, group, *numbers = data.fields("4B8i")
        rows.append((x, y, mask, group, *(numbers[i : i + 2] for i in (0, 2, 4, 6))))
    data.end()
    return heads, rows


class Bits:
    """Bits from the lowest of the first byte on."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, count):
        """At most 32 bits, which lie in five bytes."""
        first, shift = self.at >> 3, self.at & 7
        self.at += count
        require(self.at <= 8 * len(self.data), "bits beyond the end")
        word = int.from_bytes(self.data[first : first + 5], "little")
        return word >> shift & ((1 << count) - 1)


class Context:
    def __init__(self):
        self.x = self.y = 0
        self.uv, self.dx, self.dy, self.cross = [0, 0], [0, 0], [0, 0], [0, 0]
        self.sx, self.sy = [0, 0], [0, 0]


def along(n, start, end):
    bend = 0 if n == 0 else i32(end - start) >> 1
    return n * (start + end) - bend


def decode_delta(data, runs, records):
    heads, following, draw = [], 0, 0
    for _ in range(runs):
        head = data.number(1 << 33)
        primitive = following + (head >> 1)
        require(primitive < 1 << 32, "a primitive out of range")
        if head & 1:
            draw = data.number()
        heads.append((primitive, draw, data.number() + 1))
        following = primitive + 1
    require(sum(count for _, _, count in heads) == records, "records of the runs")
    bits = Bits(data.take(data.left()))
    rows = []

    def start_anew():
        return [Context() for _ in range(16)], list(range(16)), 0

    contexts, follows, group = start_anew()
    previous_draw = 0
    for _, draw, count in heads:
        if draw != previous_draw:
            contexts, follows, group = start_anew()
            previous_draw = draw
        position, seen = 0, set()
        for _ in range(count):
            codes = [bits.take(4) for _ in range(4)]
            step, mask, expected = bits.take(3), bits.take(4), bits.take(1)
            if step == 7:
                step = bits.take(6)
            now = follows[group] if expected else bits.take(4)
            follows[group] = group = now
            position += step
            require(position < 64, "a quad outside its tile")
            x, y = every_other_bit(position), every_other_bit(position >> 1)
            left = [[unzigzag(bits.take(WIDTHS[code])) for _ in "uv"] for code in codes]
            c = contexts[group]
            right, down = x - c.x, y - c.y
            uv, dx, dy, cross = [0, 0], [0, 0], [0, 0], [0, 0]
            for a in range(2):
                dx[a] = i32(c.dx[a] + right * c.sx[a] + 2 * down * c.cross[a] + left[0][a])
                dy[a] = i32(c.dy[a] + down * c.sy[a] + 2 * right * c.cross[a] + left[1][a])
                cross[a] = i32(c.cross[a] + left[2][a])
                dx_there = i32(dx[a] - 2 * down * c.cross[a])
                dy_here = i32(c.dy[a] + 2 * right * c.cross[a])
                uv[a] = i32(
                    c.uv[a]
                    + along(right, c.dx[a], dx_there)
                    + along(down, dy_here, dy[a])
                    + left[3][a]
                )
                if group in seen and abs(right) == 1:
                    c.sx[a] = i32(right * (dx[a] - c.dx[a] - 2 * down * c.cross[a]))
                if group in seen and abs(down) == 1:
                    c.sy[a] = i32(down * (dy[a] - c.dy[a] - 2 * right * c.cross[a]))
            c.x, c.y, c.uv, c.dx, c.dy, c.cross = x, y, uv, dx, dy, cross
            seen.add(group)
            rows.append((x, y, mask, group, uv, dx, dy, cross))
    require(not bits.take(-bits.at % 8), "bits after the last record")
    require(bits.data[bits.at // 8 :] == bytes(8), "padding")
    return heads, rows


def check_tile(heads, rows, draws):
    previous, first = -1, 0
    for primitive, draw, count in heads:
        require(primitive > previous and count >= 1 and draw < len(draws), "a run")
        of = draws[draw]
        number = primitive - of["first_primitive"]
        require(0 <= number < of["primitives"], "a primitive of another draw")
        previous, position = primitive, 0
        check_operands(rows[first : first + count], of["groups"])
        for x, y, mask, group, *_ in rows[first : first + count]:
            require(x < 8 and y < 8 and 1 <= mask <= 15, "a record")
            require(group < len(of["groups"]) or group == NO_GROUP, "a group")
            now = sum((x >> b & 1) << 2 * b | (y >> b & 1) << 2 * b + 1 for b in range(3))
            require(now >= position, "records out of order")
            position = now
        first += count
    require(first == len(rows), "records of the runs")


def check_operands(rows, groups):
    """Operands come right before the record that asks for them, and nowhere else."""
    asks = [asks_operands(group) for group in groups] + [False] * 16
    operands = None
    for x, y, mask, group, *_ in rows:
        if operands:
            require(operands == (x, y, mask, group - 1), "operands of another record")
        else:
            require(not asks[group], "a record without its operands")
        operands = (x, y, mask, group) if group < 15 and asks[group + 1] else None
    require(operands is None, "operands of no record")


def ascending(data):
    """A list of ascending numbers."""
    numbers, following = [], 0
    for _ in range(data.number()):
        numbers.append(following + data.number())
        following = numbers[-1] + 1
    require(following <= 1 << 32, "a number out of range")
    return numbers


def read_mesh(data):
    vertices, vertex_bytes, index_bytes = data.fields("IHH")
    require(vertex_bytes >= 1 and index_bytes in (2, 4), "a mesh")
    indices, following = [], 0
    for _ in range(data.count(1)):
        indices.append(following - unzigzag(data.number(1 << 33)))
        require(0 <= indices[-1] < vertices, "an index")
        following = max(following, indices[-1] + 1)
    require(len(indices) % 3 == 0, "a triangle of fewer indices")
    return indices


def read_geometry(chunks, version, draws, passes, frames):
    """Yields (view, its pass or None, tile, primitives) for each tile of each view."""
    tags = [tag for tag in chunks if tag in GEOMETRY_TAGS]
    if not tags:
        return
    new = version >= (1, 2)
    require(tags == GEOMETRY_TAGS and new, "geometry missing, out of order or too old")
    require(list(chunks).index("GEOM") > list(chunks).index("TIDX"), "geometry before the tiles")
    data = Bytes(chunks["GEOM"])
    meshes = [read_mesh(data) for _ in range(data.count(12))]
    of_draws = [data.field("I") for _ in range(data.count(4))]
    data.end()
    require(len(of_draws) == len(draws), "meshes of the draws")
    for mesh, draw in zip(of_draws, draws):
        require(mesh < len(meshes) and len(meshes[mesh]) == 3 * draw["primitives"], "a draw's mesh")
    index = Bytes(chunks["PLIX"])
    entries = [index.fields("IIIIIQII") for _ in range(index.left() // 36)]
    index.end()
    tile_spans([entry[5:] for entry in entries], chunks["PLST"])
    places = [(frame, 1 - kind, number) for frame, kind, number, *_ in entries]
    require(places == sorted(set(places)), "order of the views")
    require(sum(kind for _, kind, _ in places) == len(passes), "a view of each pass")
    for view, (frame, kind, number, width, height, offset, size, _) in enumerate(entries):
        require(frame in frames and 1 <= width <= 16384 and 1 <= height <= 16384, "a view")
        if kind == 0:
            of = passes[number]
            require((of["frame"], of["size_px"]) == (frame, [width, height]), "the pass of a view")
        require(kind <= 1, "the kind of a view")
        lists = Bytes(chunks["PLST"][offset : offset + size])
        drawn = ascending(lists)
        require(not drawn or drawn[-1] < len(draws), "draws of a view")
        ranges = [draws[draw] for draw in drawn]
        allowed = {
            primitive
            for draw in ranges
            for primitive in range(draw["first_primitive"], draw["first_primitive"] + draw["primitives"])
        }
        for tile in range(-(-width // 16) * -(-height // 16)):
            primitives = ascending(lists)
            require(allowed.issuperset(primitives), "a primitive of another draw")
            yield view, number if kind == 0 else None, tile, primitives
        lists.end()


def read_vertex_reads(chunks, version, frames, textures, samplers):
    """Yields each texture read of a vertex shader."""
    if version[0] not in (2, 3, 5) or "VTXR" not in chunks:
        return
    require(version[1] >= 1, "vertex reads in an older version")
    require(list(chunks).index("VTXR") > list(chunks).index("PASS"), "vertex reads before the passes")
    data = Bytes(chunks["VTXR"])
    before = (0, 0)
    for _ in range(data.count(17)):
        frame, draw, eye = data.fields("IIB")
        require(frame in frames and (frame, draw) >= before and eye in (0, 1, 255), "a draw of vertex reads")
        before = frame, draw
        sites = [data.fields("IHBbb") for _ in range(data.count(9))]
        for texture, sampler, fetches, *_ in sites:
            require(texture < len(textures) and sampler < len(samplers) and fetches <= 1, "a site")
        values, last = [0] * 7, (0, 0)
        for _ in range(data.count(7)):
            values = [(value + unzigzag(data.number())) % (1 << 32) for value in values]
            instance, vertex, site, *at, layer, level = values
            require(site < len(sites) and (instance, vertex) >= last, "a vertex read")
            last = instance, vertex
            texture, sampler, fetches, *offset = sites[site]
            read = {"frame": frame, "eye": {0: "left", 1: "right", 255: None}[eye], "draw": draw}
            read |= {"instance": instance, "vertex": vertex, "texture": texture, "layer": layer, "offset": offset}
            if fetches:
                yield read | {"texel": [i32(value) for value in at], "level": i32(level)}
            else:
                *uv, lod = struct.unpack("<3f", struct.pack("<3I", *at, level))
                yield read | {"sampler": sampler, "uv": uv, "level": lod}
    data.end()


def read_repeats(index, passes):
    """For each pass its own number or that of the earlier pass whose tiles it has."""
    repeats = []
    for number, each in enumerate(passes):
        (of,) = index.fields("I")
        known = of == number or of < number and repeats[of] == of and passes[of]["tiles"] == each["tiles"]
        require(known, "a pass that repeats none")
        repeats.append(of)
        require(repeats.count(of) <= 1 + MOST_REPEATS, "a pass that is repeated too often")
    return repeats


def main(path, *options):
    chunks, version = read(path, 1)
    shared = version[0] >= 4
    major = TABLES[version[0]]
    tags = TAGS[major]
    require([tag for tag in chunks if tag in tags] == tags, "chunks missing or out of order")
    description = parse_json(chunks["META"])
    meta = check_meta(shaped(description, META))
    if major >= 2 and "program" in description:
        meta["program"] = shaped(description["program"], PROGRAM)
    textures = read_table(chunks["TEXS"], 22, lambda data: read_texture(data, major))
    check_parts(textures)
    samplers = read_table(chunks["SMPS"], 5, lambda data: read_sampler(data, major))
    draws = read_table(chunks["DRAW"], 12, lambda data: read_draw(data, textures, samplers, major))
    passes = read_table(chunks["PASS"], 24, lambda data: read_pass(data, meta))
    check_layers([each for each in passes if each["kind"] == "layer"], version)
    print_line(
        {
            "checksum": content_checksum(chunks),
            "meta": meta,
            "textures": textures,
            "samplers": samplers,
            "draws": draws,
            "passes": passes,
        }
    )
    frames = {views["frame"] for views in meta["frames"]}
    listed = {}
    for view, of_pass, tile, primitives in read_geometry(chunks, version, draws, passes, frames):
        if of_pass is not None:
            listed[of_pass, tile] = set(primitives)
        if "--lists" in options:
            print_line({"view": view, "tile": tile, "primitives": primitives})
    for listed_read in read_vertex_reads(chunks, version, frames, textures, samplers):
        if "--vertex-reads" in options:
            print_line(listed_read)
    if options:
        return
    index = Bytes(chunks["TIDX"])
    repeats = read_repeats(index, passes) if shared else list(range(len(passes)))
    of_pass, own = [], []
    for number, each in enumerate(passes):
        if repeats[number] == number:
            count = each["tiles"][0] * each["tiles"][1]
            of_pass.append([index.fields("QIIIIQ") for _ in range(count)])
            own += of_pass[-1]
        else:
            of_pass.append(of_pass[repeats[number]])
    index.end()
    touched = [entry for entry in own if entry[3]]
    require(all(not any(e[:5]) and e[5] in ENCODINGS for e in own if not e[3]), "an untouched tile")
    tile_spans(touched, chunks["TILE"], shared)
    places = [(number, tile) for number, entries in enumerate(of_pass) for tile in range(len(entries))]
    entries = [entry for each in of_pass for entry in each]
    codes = read_codes()

    def planes(data, runs, records):
        return decode_planes(data, runs, records, codes)

    for (number, tile), (offset, size, _, records, runs, encoding) in zip(places, entries):
        if not records:
            continue
        require(runs <= records and encoding in ENCODINGS, "an index entry")
        decode = {0: decode_raw, 1: decode_delta, 3: planes}[encoding]
        heads, rows = decode(Bytes(chunks["TILE"][offset : offset + size]), runs, records)
        check_tile(heads, rows, draws)
        if listed:
            require(listed[number, tile].issuperset(head[0] for head in heads), "a recorded primitive's list")
        rows = iter(rows)
        for primitive, draw, count in heads:
            for _ in range(count):
                x, y, mask, group, uv, dx, dy, cross = next(rows)
                print_line(
                    {
                        "pass": number,
                        "tile": tile,
                        "draw": draw,
                        "primitive": primitive,
                        "x": x,
                        "y": y,
                        "mask": mask,
                        "group": None if group == NO_GROUP else group,
                        "uv": uv,
                        "dx": dx,
                        "dy": dy,
                        "cross": cross,
                    }
                )


if __name__ == "__main__":
    main(*sys.argv[1:])
