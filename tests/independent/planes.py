"""Encoding 2 of a .textrace's tiles.

Written from FORMAT.md alone; even the code lengths are read from there.
"""

from pathlib import Path

from container import require, unzigzag

FORMAT = Path(__file__).resolve().parents[2] / "FORMAT.md"
ESCAPE_PLACE = 105
ESCAPE_SIZES = 256


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
    _, text = FORMAT.read_text(encoding="utf-8").split("## Code lengths of encoding 2\n")
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

    def power(self, code):
        power = self.symbol(code)
        return (1 << power) + self.take(power)

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
    return min(max(a, -1.0), 1.0)


def least(w):
    return max(w, 2.0**-10)


def wide(value):
    """Python's own rounding is to even, too."""
    return i32(round(value))


class Plane:
    def __init__(self):
        self.ox = self.oy = 0
        self.start, self.right, self.down = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.p = self.q = 0.0

    def w(self, x, y):
        return (1.0 + self.p * (2 * x - self.ox)) + self.q * (2 * y - self.oy)

    def tilt(self, x, y):
        w = least(self.w(x, y))
        return one(self.p / w), one(self.q / w)

    def says(self, x, y):
        """uv, dx, dy and cross."""
        w0 = self.w(x, y)
        w1 = w0 + self.p
        weights = [w0, w1, w0 + self.q, w1 + self.q]
        scales = [1.0 / least(w) for w in weights]
        says = [[0, 0] for _ in range(4)]
        for i in range(2):
            right, down = self.right[i], self.down[i]
            n0 = right * (2 * x - self.ox) + down * (2 * y - self.oy)
            n1 = n0 + right
            numbers = [n0, n1, n0 + down, n1 + down]
            a, b, c, d = (n * scale for n, scale in zip(numbers, scales))
            row = [self.start[i] + a, b - a, c - a, (d - c) - (b - a)]
            for k, value in enumerate(row):
                says[k][i] = wide(value)
        return says


def least_squares(dx, dy, cross, p, q):
    au, av = (float(cross[i] + dy[i]) for i in range(2))
    bu, bv = (float(cross[i] + dx[i]) for i in range(2))
    eu = -((cross[0] + p * au) + q * bu)
    ev = -((cross[1] + p * av) + q * bv)
    A, B, C = au * au + av * av, bu * bu + bv * bv, au * bu + av * bv
    E, F, G = au * eu + av * ev, bu * eu + bv * ev, au * bv - av * bu
    L = 65536.0
    D = L * ((L + A) + B) + G * G
    return one(p + ((B + L) * E - C * F) / D), one(q + ((A + L) * F - C * E) / D)


def of_size(size):
    """Pairs of a class by u, then v."""
    numbers = range(-size, size + 1)
    return [[u, v] for u in numbers for v in numbers if max(abs(u), abs(v)) == size]


SMALL = [[], of_size(1), of_size(2)]
NOISE = [0, 1, 1, 2, 2, 3, 3, 4, 4, 4, 5, 5, 5]


class Tile:
    def __init__(self, data, codes):
        self.bits = Bits(data)
        self.codes = codes
        self.earlier = [[] for _ in range(16)]
        self.place = self.mask = self.group = self.start = self.draw = 0
        self.one = False
        self.start_anew()

    def start_anew(self):
        self.follows = [(group, False) for group in range(16)]
        self.covered = [0] * 64
        self.group = 0

    def start_run(self, draw, count):
        if draw != self.draw:
            self.start_anew()
            self.draw = draw
        self.count, self.first = count, True
        self.told = None
        self.planes = {}

    def next_place(self):
        group, same = self.follows[self.group]
        if not self.first and same and self.bits.take(1):
            return self.place, self.mask, group
        if self.first:
            base = (self.start ^ self.bits.symbol(self.codes["start"][0])) - 1
            context = 16
        else:
            base = self.place
            context = 4 * (base & 3) + 2 * (self.mask == 15) + self.one
        t = self.bits.symbol(self.codes["place"][context])
        if t == ESCAPE_PLACE:
            return base + self.bits.take(6), self.bits.take(4), self.bits.take(4)
        step, mask = 1 + t // 15, 1 + t % 15
        if step == 7:
            step = self.bits.take(6)
        place = base + step
        require(0 <= place < 64, "a quad outside its tile")
        rest = 15 & ~self.covered[place]
        if rest and mask in (15, rest):
            mask ^= 15 ^ rest
        return place, mask, group

    def record(self):
        place, mask, group = self.next_place()
        require(0 <= place < 64, "a quad outside its tile")
        x = place & 1 | place >> 1 & 2 | place >> 2 & 4
        y = place >> 1 & 1 | place >> 2 & 2 | place >> 3 & 4
        quad = self.later(group, x, y) if group in self.planes else self.told_first(group, x, y)
        same = not self.first and (place, mask) == (self.place, self.mask)
        self.follows[self.group] = (group, same)
        self.covered[place] |= mask
        if not same:
            self.one = not self.first and place == self.place + 1
        if self.first:
            self.start = place
        self.place, self.mask, self.group, self.first = place, mask, group, False
        uv, dx, dy, cross = quad
        return x, y, mask, group, uv, dx, dy, cross

    def told_first(self, group, x, y):
        bits, codes = self.bits, self.codes
        back = bits.power(codes["parent"][0]) - 1
        earlier = self.earlier[group]
        require(back <= len(earlier), "a plane that is not there")
        parent = Plane() if back == len(earlier) else earlier[-1 - back]
        p, q = (self.told or parent).tilt(x, y)
        uv, dx, dy, _ = parent.says(x, y)
        width, quad = 0, []
        for i in range(4):
            width += unzigzag(bits.symbol(codes["first"][i]))
            expected = [dx, dy, None, uv][i]
            if i == 2:
                below = -least((1.0 + p) + q)
                dx, dy = quad
                expected = [wide((dx[k] * q + dy[k] * p) / below) for k in range(2)]
            left = bits.pair(width)
            quad.append(wrapped(*(expected[k] + left[k] for k in range(2))))
        dx, dy, cross, uv = quad
        if not self.told:
            p, q = least_squares(dx, dy, cross, p, q)
        mode = level = 0
        if self.count > 1:
            context = min(self.count.bit_length() - 2, 3)
            mode, level = divmod(bits.symbol(codes["level"][context]), 8)
            require(mode <= 2, "a mode")
        by = [[0, 0]] * 4
        if level:
            by = [bits.pair(bits.symbol(codes["correction"][i])) for i in range(4)]
            size = max(abs(d) for d in dx + dy).bit_length()
            p = one(p + by[3][0] * 2.0 ** -(2 * level + size))
            q = one(q + by[3][1] * 2.0 ** -(2 * level + size))
        plane = Plane()
        plane.ox, plane.oy, plane.p, plane.q = 2 * x, 2 * y, p, q
        unit = 2.0**-level
        plane.start = [uv[k] + by[0][k] * 0.25 for k in range(2)]
        plane.right = [dx[k] * (1.0 + p) + by[1][k] * unit for k in range(2)]
        plane.down = [dy[k] * (1.0 + q) + by[2][k] * unit for k in range(2)]
        earlier.append(plane)
        self.told = plane
        last = (x, y, [[0, 0]] * 4)
        self.planes[group] = [plane, mode, 2 if level else 3, last]
        return uv, dx, dy, cross

    def later(self, group, x, y):
        plane, mode, noise, last = self.planes[group]
        z = self.bits.symbol(self.codes["sizes"][noise])
        if z == ESCAPE_SIZES:
            z = self.bits.take(8)
        classes = [z >> 2 * i & 3 for i in range(4)]
        dx, dy, cross, uv = (self.departure(each) for each in classes)
        if mode == 1:
            cross = [cross[i] + uv[i] - dx[i] - dy[i] for i in range(2)]
            dx = [dx[i] - uv[i] for i in range(2)]
            dy = [dy[i] - uv[i] for i in range(2)]
        if mode == 2:
            lx, ly, (l_uv, l_dx, l_dy, l_cross) = last
            dx, dy, cross = (
                [a[i] + b[i] for i in range(2)] for a, b in ((l_dx, dx), (l_dy, dy), (l_cross, cross))
            )
            uv = [
                l_uv[i] + uv[i] + (x - lx) * (l_dx[i] + dx[i]) + (y - ly) * (l_dy[i] + dy[i])
                for i in range(2)
            ]
        departure = [wrapped(*pair) for pair in (uv, dx, dy, cross)]
        noise = NOISE[sum(classes)]
        self.planes[group] = [plane, mode, noise, (x, y, departure)]
        says = plane.says(x, y)
        return [wrapped(a[0] + b[0], a[1] + b[1]) for a, b in zip(says, departure)]

    def departure(self, size):
        if size == 3:
            return self.bits.pair(self.bits.symbol(self.codes["later"][0]))
        return SMALL[size][self.bits.take(2 + size)] if size else [0, 0]


def decode_planes(data, runs, records, codes):
    tile = Tile(data.take(data.left()), codes)
    bits = tile.bits
    heads, rows, following, draw = [], [], 0, 0
    for _ in range(runs):
        head = bits.symbol(codes["header"][0])
        primitive = following - 1 + (1 << (head >> 1)) + bits.take(head >> 1)
        require(primitive < 1 << 32, "a primitive out of range")
        if head & 1:
            draw = bits.gamma() - 1
        count = bits.power(codes["count"][0])
        require(len(rows) + count <= records, "records of a run")
        heads.append((primitive, draw, count))
        following = primitive + 1
        tile.start_run(draw, count)
        rows.extend(tile.record() for _ in range(count))
    require(len(rows) == records, "records of the runs")
    require(bits.left < 8 and not bits.number, "bits after the last record")
    return heads, rows
