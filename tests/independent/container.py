"""Parallax containers, as FORMAT.md describes them: header, directory, chunks, numbers and JSON.

Written from that text alone, with nothing but Python's own library, to check the text and the
project's readers. What breaks a rule raises ValueError.
"""

import json
import math
import struct
import zlib

LARGEST_F32 = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


def require(holds, text):
    if not holds:
        raise ValueError(text)


class Bytes:
    """Bytes that are read from front to back."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def left(self):
        return len(self.data) - self.at

    def take(self, count):
        require(count <= self.left(), f"{count} bytes wanted, {self.left()} there")
        self.at += count
        return self.data[self.at - count : self.at]

    def fields(self, layout):
        layout = "<" + layout
        return struct.unpack(layout, self.take(struct.calcsize(layout)))

    def field(self, layout):
        return self.fields(layout)[0]

    def number(self, bound=1 << 32):
        """LEB128 in as few bytes as it takes."""
        value, shift = 0, 0
        while True:
            byte = self.take(1)[0]
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
            require(shift < 35, "a number of more than five bytes")
        require(byte != 0 or shift == 7, "a number of too many bytes")
        require(value < bound, "a number out of range")
        return value

    def count(self, least_bytes):
        """A u32 count of items that take so many bytes at least."""
        count = self.field("I")
        require(count * least_bytes <= self.left(), "more entries than bytes")
        return count

    def name(self):
        return self.take(self.field("H")).decode("utf-8")

    def end(self):
        require(self.left() == 0, f"{self.left()} bytes too many")


def unzigzag(code):
    return -(code + 1) // 2 if code & 1 else code // 2


def f32(number):
    """The nearest f32, as a float."""
    return struct.unpack("<f", struct.pack("<f", number))[0]


def read(path, kind):
    """Chunks of a file of a kind (1 textrace, 2 raytrace) by tag, in file order; its version."""
    with open(path, "rb") as file:
        data = file.read()
    head = Bytes(data)
    magic, major, minor, found_kind, zero16 = head.fields("8sHHHH")
    directory_at, size, entries, directory_crc, zero32, head_crc = head.fields("QQIIII")
    known = major == 1 or major in (2, 3, 4, 5) and kind == 1
    require(magic == b"PLXTRACE" and known, "not a trace of versions 1 to 5")
    require(zlib.crc32(data[:44]) == head_crc, "damaged header")
    require(found_kind == kind, "a trace of another kind")
    require(zero16 == 0 and zero32 == 0, "reserved bytes")
    require(size == len(data), "a file of another size")
    require(directory_at + 24 * entries == size, "the directory must end with the file")
    directory = Bytes(data[directory_at:])
    require(zlib.crc32(directory.data) == directory_crc, "damaged directory")
    chunks, end = {}, 48
    for _ in range(entries):
        tag, crc, offset, length = directory.fields("4sIQQ")
        require(all(33 <= byte <= 126 for byte in tag) and tag not in chunks, "a bad tag")
        start = (end + 7) // 8 * 8
        require(offset == start and not any(data[end:start]), "a chunk out of place")
        end = start + length
        require(end <= directory_at, "a chunk past the directory")
        chunks[tag] = data[start:end]
        require(zlib.crc32(chunks[tag]) == crc, f"damaged chunk {tag}")
    start = (end + 7) // 8 * 8
    require(start == directory_at and not any(data[end:start]), "the directory out of place")
    return {tag.decode("ascii"): chunk for tag, chunk in chunks.items()}, (major, minor)


ANNOTATIONS = {"tool", "command_line", "scene", "backend", "driver", "techniques"}
ESCAPES = {'"': '\\"', "\\": "\\\\", "\b": "\\b", "\f": "\\f", "\n": "\\n", "\r": "\\r", "\t": "\\t"}


def spelled_number(number):
    if isinstance(number, int):
        return str(number)
    # `repr` has the shortest digits, the nearest ones of several.
    mantissa, _, power = f"{number!r}".partition("e")
    whole, _, fraction = mantissa.lstrip("-").partition(".")
    digits = (whole + fraction).lstrip("0") or "0"
    leading = len(whole + fraction) - len((whole + fraction).lstrip("0"))
    first = len(whole) - 1 - leading + int(power or 0) if number else 0
    digits = digits.rstrip("0") or "0"
    sign = "-" if math.copysign(1, number) < 0 else ""
    if not -5 <= first <= 15:
        point = "." if len(digits) > 1 else ""
        return f"{sign}{digits[0]}{point}{digits[1:]}e{first:+d}"
    if first < 0:
        return f"{sign}0.{'0' * (-1 - first)}{digits}"
    digits = digits.ljust(first + 1, "0")
    return f"{sign}{digits[: first + 1]}.{digits[first + 1 :] or '0'}"


def spelled(value):
    """The spelling of JSON that the content checksum covers."""
    if isinstance(value, dict):
        items = sorted((key.encode("utf-8"), key, item) for key, item in value.items())
        return "{" + ",".join(f"{spelled(key)}:{spelled(item)}" for _, key, item in items) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(spelled, value)) + "]"
    if isinstance(value, str):
        escaped = (ESCAPES.get(c) or (f"\\u{ord(c):04x}" if c < " " else c) for c in value)
        return '"' + "".join(escaped) + '"'
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return spelled_number(value)


def content_checksum(chunks):
    """As eight hexadecimal digits."""

    def content(value):
        return {key: item for key, item in value.items() if key not in ANNOTATIONS}

    crc = 0
    for tag, chunk in chunks.items():
        if tag != "META":
            entry = struct.pack("<4sQI", tag.encode("ascii"), len(chunk), zlib.crc32(chunk))
            crc = zlib.crc32(entry, crc)
    meta = content(parse_json(chunks["META"]))
    if isinstance(meta.get("trace"), dict):
        meta["trace"] = content(meta["trace"])
    return f"{zlib.crc32(spelled(meta).encode('utf-8'), crc):08x}"


def tile_spans(index, tiles, shared=False):
    """Checks (offset, size, CRC-32, ...) of the tiles that have bytes; they must fill their chunk. If shared, an
    entry may be that of an earlier tile."""
    end, stored = 0, {}
    for entry in index:
        offset, size, crc = entry[:3]
        if shared and offset < end:
            require(stored.get(offset) == entry, "a tile that shares its bytes in part")
            continue
        stored[offset] = entry
        require(offset == end, "a tile out of place")
        end += size
        require(zlib.crc32(tiles[offset:end]) == crc, "a damaged tile")
    require(end == len(tiles), "tiles that do not fill their chunk")


def parse_json(chunk):
    def no_key_twice(pairs):
        keys = [key for key, _ in pairs]
        require(len(keys) == len(set(keys)), "a key twice")
        return dict(pairs)

    def bounded(text):
        number = float(text)
        require(abs(number) <= LARGEST_F32, "a number too large")
        return number

    def refuse(text):
        raise ValueError(f"{text} is not JSON")

    return json.loads(
        chunk.decode("utf-8"),
        object_pairs_hook=no_key_twice,
        parse_float=bounded,
        parse_constant=refuse,
    )


def shaped(value, shape):
    """The value in the shape of a key's type: a type's name, a list of shapes, or a dict of them."""
    if isinstance(shape, dict):
        require(isinstance(value, dict), "an object expected")
        require(all(key in value for key in shape), f"keys missing: {list(shape)}")
        return {key: shaped(value[key], of) for key, of in shape.items()}
    if isinstance(shape, tuple):  # any number of one shape
        require(isinstance(value, list), "an array expected")
        return [shaped(item, shape[0]) for item in value]
    if isinstance(shape, list):
        require(isinstance(value, list) and len(value) == len(shape), "an array of another length")
        return [shaped(item, of) for item, of in zip(value, shape)]
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if shape == "string":
        require(isinstance(value, str), "a string expected")
    elif shape == "bool":
        require(isinstance(value, bool), "true or false expected")
    elif shape in ("u32", "u64"):
        require(isinstance(value, int) and number, "an integer expected")
        require(0 <= value < 1 << int(shape[1:]), "an integer out of range")
    elif shape == "f64":
        require(number, "a number expected")
        value = float(value)
    elif shape == "f32":
        require(number, "a number expected")
        value = f32(value)
    return value


V3 = ["f32"] * 3
FOV = {"left": "f32", "right": "f32", "up": "f32", "down": "f32"}
MATRIX = [["f32"] * 4] * 4
EYE_VIEW = {"world_to_eye": MATRIX, "eye_to_clip": MATRIX, "position": V3}
META = {
    "tool": "string",
    "command_line": ("string",),
    "scene": "string",
    "scene_triangles": "u64",
    "camera": "string",
    "backend": "string",
    "driver": "string",
    "seed": "u64",
    "hmd": {
        "name": "string",
        "source": "string",
        "eye_size_px": ["u32", "u32"],
        "fov": [FOV, FOV],
        "ipd_m": "f32",
        "cant_deg": "f32",
    },
    "frames": ({"frame": "u32", "eyes": [EYE_VIEW, EYE_VIEW]},),
}


def check_fov(fov):
    require(all(abs(tangent) <= 100 for tangent in fov.values()), "an absurd tangent")
    least = f32(0.0001)
    require(f32(fov["left"] + fov["right"]) > least, "left + right")
    require(f32(fov["up"] + fov["down"]) > least, "up + down")


def check_meta(meta):
    hmd = meta["hmd"]
    require(all(1 <= size <= 16384 for size in hmd["eye_size_px"]), "size of an eye")
    for fov in hmd["fov"]:
        check_fov(fov)
    require(0 <= hmd["ipd_m"] <= 1e6, "distance between the eyes")
    require(abs(hmd["cant_deg"]) <= 45, "cant")
    numbers = [frame["frame"] for frame in meta["frames"]]
    require(numbers and all(a < b for a, b in zip(numbers, numbers[1:])), "frames")
    return meta


def print_line(value):
    """A line of JSON; what is not finite becomes null, as `replay dump` prints it."""

    def clean(value):
        if isinstance(value, float):
            return value if math.isfinite(value) else None
        if isinstance(value, dict):
            return {key: clean(item) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [clean(item) for item in value]
        return value

    print(json.dumps(clean(value)))
