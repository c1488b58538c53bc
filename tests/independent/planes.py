"""Encoding 3 of a .textrace's tiles.

Written from FORMAT.md alone; even the code lengths are read from there.
"""

import math
import struct
from pathlib import Path

from container import require, unzigzag

FORMAT = Path(__file__).resolve().parents[2] / "FORMAT.md"
ESCAPE_PLACE = 0
ESCAPE_SIZES = 625


def i32(number):
    return (number + (1 << 31)) % (1 << 32) - (1 << 31)


def wrapped(u, v):
    return [i32(u), i32(v)]


class Code:
    def __init__(self, digits):
        self.symbols = {}
        lengths = [int(digit, 16) for digit in digits]
        code = 0
        for length in range(1, 16):
            code <<= 1
            for symbol, own in enumerate(lengths):
                if own == length:
                    self.symbols[length, code] = symbol
                    code += 1
        self.longest = max(lengths)


def read_codes():
    """The lines of the block below the heading: a name, lengths."""
    _, text = FORMAT.read_text(encoding="utf-8").split("## Code lengths of encoding 3\n")
    _, block, *_ = text.split("```")
    codes = {}
    for line in block.split("\n"):
        if line:
            name, digits = line.split()
            codes.setdefault(name, []).append(Code(digits))
    return codes


class Bits:
    """Bits from the lowest of the first byte on; the last byte ends them."""

    def __init__(self, data):
        self.number = int.from_bytes(data, "little")
        self.left = 8 * len(data)

    def take(self, count):
        require(count <= self.left, "bits beyond the end")
        self.left -= count
        bits = self.number & (1 << count) - 1
        self.number >>= count
        return bits

    def symbol(self, code):
        bits = 0
        for length in range(1, code.longest + 1):
            bits = bits << 1 | self.take(1)
            if (length, bits) in code.symbols:
                return code.symbols[length, bits]
        require(False, "bits that are no code")

    def gamma(self):
        zeros = 0
        while not self.take(1):
            zeros += 1
            require(zeros <= 32, "a long number")
        return (1 << zeros) + self.take(zeros)

    def pair(self, width):
        require(0 <= width <= 32, "a width")
        return [unzigzag(self.take(width)) for _ in "uv"]


def one(a):
    """Also of what is no number: the comparisons then fail."""
    a = a if a < 1.0 else 1.0
    return a if a > -1.0 else -1.0


def least(w):
    return max(w, 2.0**-10)


def f32(value):
    """A single operation of f64 on f32 numbers, rounded again, is that of f32."""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


def steps(value):
    """The integer in the low bits of a sum with 12582912."""
    (bits,) = struct.unpack("<I", struct.pack("<f", value))
    return i32(bits - 0x4B400000)


def near(value):
    return steps(f32(value + 12582912.0))


class Plane:
    def __init__(self):
        self.keep(0, 0, [0, 0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], 0.0, 0.0)

    def keep(self, ox, oy, base, rest, right, down, p, q):
        self.ox, self.oy, self.base, self.rest = ox, oy, base, rest
        self.right, self.down, self.p, self.q = right, down, p, q

    def w(self, right, down):
        return f32(f32(1.0 + f32(self.p * right)) + f32(self.q * down))

    def tilt(self, x, y):
        w = least(self.w(2 * x - self.ox, 2 * y - self.oy))
        return one(f32(self.p / w)), one(f32(self.q / w))

    def says(self, x, y):
        """uv, dx, dy and cross."""
        X, Y = 2 * x - self.ox, 2 * y - self.oy
        upper = [self.w(X, Y), self.w(X + 1, Y)]
        weights = [least(w) for w in upper + [f32(w + self.q) for w in upper]]
        says = [[0, 0] for _ in range(4)]
        for i in range(2):
            right, down = self.right[i], self.down[i]
            upper = [f32(f32(right * at) + f32(down * Y)) for at in (X, X + 1)]
            numbers = upper + [f32(n + down) for n in upper]
            a, b, c, d = (f32(n / w) for n, w in zip(numbers, weights))
            cross = f32(f32(d - b) - f32(c - a))
            row = [f32(a + self.rest[i]), f32(b - a), f32(c - a), cross]
            for k, value in enumerate(row):
                says[k][i] = near(value)
            says[0][i] = i32(says[0][i] + self.base[i])
        return says


def quotient(a, b):
    """Never of zeros: the divisor is at least 2^32."""
    return f32(a / b) if math.isfinite(a) or math.isfinite(b) else math.nan


def least_squares(dx, dy, cross, p, q):
    times = lambda a, b: f32(a * b)
    plus = lambda a, b: f32(a + b)
    au, av = (plus(f32(cross[i]), f32(dy[i])) for i in range(2))
    bu, bv = (plus(f32(cross[i]), f32(dx[i])) for i in range(2))
    eu = -plus(plus(f32(cross[0]), times(p, au)), times(q, bu))
    ev = -plus(plus(f32(cross[1]), times(p, av)), times(q, bv))
    dot = lambda a, b, c, d: plus(times(a, b), times(c, d))
    A, B, C = dot(au, au, av, av), dot(bu, bu, bv, bv), dot(au, bu, av, bv)
    E, F, G = dot(au, eu, av, ev), dot(bu, eu, bv, ev), plus(times(au, bv), -times(av, bu))
    L = 65536.0
    D = plus(times(L, plus(plus(L, A), B)), times(G, G))
    to_p = quotient(plus(times(plus(B, L), E), -times(C, F)), D)
    to_q = quotient(plus(times(plus(A, L), F), -times(C, E)), D)
    return one(plus(p, to_p)), one(plus(q, to_q))


# Widths of a first quad's pairs and of corrections, by level.
EACH = [*range(29), 32, 32, 32]
CROSS = [*range(12), 13, 16, 20, 32]
START, SLOPE, TILT = [1, 2, 3, 5], [1, 2, 3, 4, 5, 6, 7, 9], [4, 5, 6, 7, 8, 9, 11, 16]


def pairs_of(holds):
    """Pairs of a class by u, then v."""
    numbers = range(-2, 3)
    return [[u, v] for u in numbers for v in numbers if holds(abs(u), abs(v))]


SMALL = [
    [],
    pairs_of(lambda u, v: u + v == 1),
    pairs_of(lambda u, v: u == v == 1),
    pairs_of(lambda u, v: max(u, v) == 2),
]
NUMBER_BITS = [0, 2, 2, 4]
SIZES = [0, 1, 1, 2, 3]
NOISE = [0, 1, 1, 2, 2, 3, 3, 4, 4, 4, 5, 5, 5]


class Context:
    """Encoding 1's, of departures."""

    def __init__(self, x, y):
        self.x, self.y = x, y
        self.uv = self.dx = self.dy = self.cross = self.sx = self.sy = [0, 0]

    def next(self, mode, x, y, r_uv, r_dx, r_dy, r_cross):
        R, D = x - self.x, y - self.y
        quad = [[], [], [], []]
        sx, sy = list(self.sx), list(self.sy)
        for i in range(2):
            dx, dy, cross = self.dx[i], self.dy[i], self.cross[i]
            bend_x, bend_y = 2 * D * cross, 2 * R * cross
            new_dx, new_dy = dx, dy
            if mode == 2:
                new_dx = i32(dx + R * self.sx[i] + bend_x)
                new_dy = i32(dy + D * self.sy[i] + bend_y)
            new_dx, new_dy = i32(new_dx + r_dx[i]), i32(new_dy + r_dy[i])
            uv = self.uv[i] + along(R, dx, i32(new_dx - bend_x)) + along(D, i32(dy + bend_y), new_dy)
            if abs(R) == 1:
                sx[i] = i32(R * (new_dx - dx - bend_x))
            if abs(D) == 1:
                sy[i] = i32(D * (new_dy - dy - bend_y))
            for to, value in zip(quad, (uv + r_uv[i], new_dx, new_dy, cross + r_cross[i])):
                to.append(i32(value))
        self.x, self.y, self.sx, self.sy = x, y, sx, sy
        self.uv, self.dx, self.dy, self.cross = quad
        return quad


def along(n, start, end):
    return n * (start + end) - (i32(end - start) >> 1 if n else 0)


class Told:
    """A group's plane in a run, and what its records depend on."""

    def __init__(self, x, y):
        self.x, self.y = x, y


class Tile:
    def __init__(self, data, codes):
        self.bits, self.back = Bits(data), Bits(data[::-1])
        self.bytes = len(data)
        self.codes = codes
        self.place = self.mask = self.group = self.start = self.draw = 0
        self.one = self.likely = False
        # x, y, mask, group, uv, dx, dy and cross of each record; the planes told so far by group.
        self.rows, self.earlier = [], [[] for _ in range(16)]
        self.start_anew()

    def start_anew(self):
        self.follows = [(group, False) for group in range(16)]
        self.covered = [0] * 64
        self.group = 0

    def run(self, draw, count):
        if draw != self.draw:
            self.start_anew()
            self.draw = draw
        self.regular = any(same for _, same in self.follows) and self.bits.take(1)
        self.first = True
        of_run, last = {}, None
        for left in reversed(range(count)):
            place, mask, group = self.next_place()
            require(0 <= place < 64, "a quad outside its tile")
            x = place & 1 | place >> 1 & 2 | place >> 2 & 4
            y = place >> 1 & 1 | place >> 2 & 2 | place >> 3 & 4
            if group in of_run:
                quad = self.departed(of_run[group], x, y)
            else:
                told = of_run[group] = Told(x, y)
                self.tell(told, self.earlier[group], last, left // 2 if self.regular else left)
                last, quad = told.plane, told.quad
            self.rows.append((x, y, mask, group, *quad))
            self.note(place, mask, group)
        for group, told in of_run.items():
            self.earlier[group].append(told.plane)

    def note(self, place, mask, group):
        same = not self.first and (place, mask) == (self.place, self.mask)
        self.follows[self.group] = (group, same)
        rest = 15 & ~self.covered[place]
        self.covered[place] |= mask
        if not same:
            self.likely = mask == (rest or 15)
            self.one = not self.first and place == self.place + 1
        if self.first:
            self.start = place
        self.place, self.mask, self.group, self.first = place, mask, group, False

    def next_place(self):
        group, same = self.follows[self.group]
        if not self.first and same and (self.regular or self.bits.take(1)):
            return self.place, self.mask, group
        if self.first:
            base = (self.start ^ self.bits.symbol(self.codes["start"][0])) - 1
            context = 16
        else:
            base = self.place
            context = 4 * (base & 3) + 2 * self.likely + self.one
        t = self.bits.symbol(self.codes["place"][context])
        if t == ESCAPE_PLACE:
            return base + self.bits.take(6), self.bits.take(4), self.bits.take(4)
        step, mask = 1 + t // 16, t % 16
        if step == 7:
            step = self.bits.take(6)
        place = base + step
        require(0 <= place < 64, "a quad outside its tile")
        rest = 15 & ~self.covered[place]
        if rest and mask in (15, rest):
            mask ^= 15 ^ rest
        return place, mask, group

    def tell(self, told, earlier, of_run, likely_others):
        bits, codes, x, y = self.back, self.codes, told.x, told.y
        power = bits.symbol(codes["parent"][0])
        require(power <= 6, "a plane that is not there")
        first = bits.symbol(codes["first"][0])
        rest = bits.symbol(codes["rest"][min(first >> 2 & 7, 5)])
        widths = [EACH[first & 31], EACH[rest & 31], CROSS[rest >> 5], EACH[first >> 5]]
        mode = level = 0
        if likely_others:
            context = min((likely_others + 1).bit_length() - 2, 3)
            mode, level = divmod(bits.symbol(codes["level"][context]), 8)
            require(mode <= 3, "a mode")
        if level:
            z = bits.symbol(codes["correction"][0])
            widths += [START[z & 3], SLOPE[z >> 2 & 7], SLOPE[z >> 5 & 7], TILT[z >> 8]]
        back = (1 << power) + bits.take(power) - 1
        counted = min(len(earlier), 64)
        require(back <= counted, "a plane that is not there")
        parent = Plane() if back == counted else earlier[-1 - back]
        left = [bits.pair(width) for width in widths]
        p, q = (of_run or parent).tilt(x, y)
        uv, dx, dy, _ = parent.says(x, y)
        add = lambda a, b: wrapped(a[0] + b[0], a[1] + b[1])
        dx, dy = add(dx, left[0]), add(dy, left[1])
        turns = [f32(f32(f32(dx[k]) * q) + f32(f32(dy[k]) * p)) for k in range(2)]
        cross = add([steps(f32(12582912.0 - turn)) for turn in turns], left[2])
        uv = add(uv, left[3])
        if not of_run:
            p, q = least_squares(dx, dy, cross, p, q)
        by = left[4:] or [[0, 0]] * 4
        if level:
            size = max(d ^ d >> 31 for d in dx + dy).bit_length()
            unit = 2.0 ** -(2 * level + size)
            p, q = (one(f32(a + f32(f32(change) * unit))) for a, change in zip((p, q), by[3]))
        plane = Plane()
        unit = 2.0**-level
        right, down = (
            [f32(f32(f32(d) * f32(1.0 + bend)) + change * unit) for d, change in zip(slope, changes)]
            for slope, bend, changes in ((dx, p, by[1]), (dy, q, by[2]))
        )
        plane.keep(2 * x, 2 * y, uv, [change * 0.25 for change in by[0]], right, down, p, q)
        told.plane, told.quad = plane, (uv, dx, dy, cross)
        told.mode, told.noise, told.context = mode, 2 if level else 3, Context(x, y)

    def residuals(self, told):
        """Pairs of uv, dx, dy and cross."""
        bits = self.back
        z = bits.symbol(self.codes["sizes"][6 * told.mode + told.noise])
        if z == ESCAPE_SIZES:
            classes = [bits.take(3) for _ in range(4)]
            require(max(classes) <= 4, "a class")
        else:
            classes = [z // 5**i % 5 for i in range(4)]
        told.noise = NOISE[sum(SIZES[each] for each in classes)]
        pairs = [[0, 0] for _ in range(4)]
        for i, each in enumerate(classes):
            if each in (1, 2, 3):
                pairs[i] = SMALL[each][bits.take(NUMBER_BITS[each])]
        if 4 in classes:
            width = bits.symbol(self.codes["later"][0])
            for i, each in enumerate(classes):
                if each == 4:
                    pairs[i] = bits.pair(width)
        return pairs

    def departed(self, told, x, y):
        uv, dx, dy, cross = departure = self.residuals(told)
        if told.mode == 1:
            cross = [cross[i] + uv[i] - dx[i] - dy[i] for i in range(2)]
            dx = [dx[i] - uv[i] for i in range(2)]
            dy = [dy[i] - uv[i] for i in range(2)]
            departure = [uv, dx, dy, cross]
        elif told.mode >= 2:
            departure = told.context.next(told.mode, x, y, uv, dx, dy, cross)
        says = told.plane.says(x, y)
        return [wrapped(a[0] + b[0], a[1] + b[1]) for a, b in zip(says, departure)]


def decode_planes(data, runs, records, codes):
    tile = Tile(data.take(data.left()), codes)
    bits = tile.bits
    heads, following, draw = [], 0, 0
    for _ in range(runs):
        head = bits.symbol(codes["header"][0])
        power = bits.symbol(codes["count"][0])
        primitive = following - 1 + (1 << (head >> 1)) + bits.take(head >> 1)
        require(primitive < 1 << 32, "a primitive out of range")
        if head & 1:
            draw = bits.gamma() - 1
        count = (1 << power) + bits.take(power)
        require(len(tile.rows) + count <= records, "records of a run")
        heads.append((primitive, draw, count))
        following = primitive + 1
        tile.run(draw, count)
    require(len(tile.rows) == records, "records of the runs")
    read = 0
    for each in (bits, tile.back):
        read += tile.bytes - each.left // 8
        require(not each.number & (1 << each.left % 8) - 1, "bits after the last record")
    require(read == tile.bytes, "bytes between front and back")
    return heads, tile.rows
