"""Reuse histograms at one size predict the traffic at another.

A histogram has the reuses of the L2's stream by class (same tile, another tile, the other eye) and by distance in lines. Two sizes, each half as wide and
high as the next, give the ratio between sizes for every quantile of a class. The same ratio leads to the full size. Ways follow Hill and Smith (1989): the
lines between two uses fall into the sets evenly, so a set receives a Poisson number of them.
"""

import csv
import math

BINS_PER_DOUBLING = 16
CLASSES = ["same_tile", "other_tile", "other_eye"]
# Lines are between as many and four times as many when a picture has four times the pixels.
LEAST, MOST = 1.0, 4.0


def bin_of(distance):
    return 0 if distance == 0 else 1 + math.floor(BINS_PER_DOUBLING * math.log2(distance))


def lines_of(place):
    """Lines that a cache needs for the reuses of a bin: the distance in its middle, and one."""
    return 1.0 if place == 0 else 1 + 2 ** ((place - 0.5) / BINS_PER_DOUBLING)


def binned(path):
    """Reuses of the L2's stream in a file of `replay locality --csv`: order, class, bin, count."""
    found = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            if row["stream"] != "l2":
                continue
            place = bin_of(int(row["from"]))
            for name in CLASSES:
                count = int(row[name])
                if count:
                    bins = found.setdefault(row["order"], {}).setdefault(name, {})
                    bins[place] = bins.get(place, 0) + count
    return found


def quantiles(bins):
    """Middle of each bin as a share of all reuses, its lines and its count."""
    places = sorted((int(place), count) for place, count in bins.items())
    total, below, found = sum(count for _, count in places), 0, []
    for place, count in places:
        found.append(((below + count / 2) / total, lines_of(place), count))
        below += count
    return found, total


def lines_at(found, share):
    """Lines at a quantile, between bins on a logarithmic scale."""
    below = found[0]
    for above in found:
        if share <= above[0]:
            part = (share - below[0]) / (above[0] - below[0]) if above[0] > below[0] else 0
            return below[1] ** (1 - part) * above[1] ** part
        below = above
    return below[1]


class Measured:
    """An order's reuses at the size at which they were measured."""

    def __init__(self, found, order):
        self.first_uses = next(int(row["unique_lines"]) for row in found["summary"] if row["order"] == order)
        classes = found["distances"][order].values()
        self.reuses = [(lines_of(int(place)) - 1, count) for bins in classes for place, count in bins.items()]

    def misses(self, sets, ways):
        return self.first_uses + sum(count * (1 - hit(distance / sets, ways)) for distance, count in self.reuses)


class Stretched(Measured):
    """An order's reuses at the full size, from those at a quarter and at half of its width and height."""

    def __init__(self, quarter, half, order):
        unique = [next(int(row["unique_lines"]) for row in found["summary"] if row["order"] == order) for found in (quarter, half)]
        self.first_uses = unique[1] ** 2 / unique[0]
        self.reuses = []
        for name in CLASSES:
            bins = half["distances"][order].get(name)
            if not bins:
                continue
            at_half, count = quantiles(bins)
            at_quarter, count_at_quarter = quantiles(quarter["distances"][order].get(name, bins))
            for share, lines, reuses in at_half:
                ratio = 1.0 if name == "same_tile" else lines / lines_at(at_quarter, share)
                self.reuses.append((lines * min(max(ratio, LEAST), MOST) - 1, reuses * count / count_at_quarter))


def hit(mean, ways):
    """Probability that fewer than `ways` lines fall into a set that receives `mean` on average."""
    if mean > 2 * ways + 40:
        return 0.0
    term = total = math.exp(-mean)
    for number in range(1, ways):
        term *= mean / number
        total += term
    return min(total, 1.0)
