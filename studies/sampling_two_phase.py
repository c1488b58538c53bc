"""Whether small captures of all frames would save frames of a sample (two-phase sampling with regression), on the populations of `sampling`."""

import csv

from . import sampling
from .common import machine, mean
from .sampling import ORDERS, SCENES, population

SMALL = "240x270"
# The L2s of the small pictures are as far from holding an eye as those of the whole ones.
CACHES = {"8/64": "4/16", "8/128": "8/32", "16/256": "8/64", "16/512": "16/128"}
# Frames of a stratum, roughly, as in `replay sample`.
STRATUM = 10
OPTIONS = {key: sampling.OPTIONS[key] for key in ("--size", "--caches", "--frames", "--only", "--paths", "--populations")}


def counts(path):
    """Bytes by caches and order, and frame."""
    found = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault((row["caches"], row["order"]), []).append(int(row["external_bytes"]))
    return found


def residuals(own, base):
    """What the order's bytes of each frame are above their usual share of the baseline's, and above the stratum's mean."""
    ratio = sum(own) / max(sum(base), 1)
    above = [a - ratio * b for a, b in zip(own, base)]
    out = []
    for start in range(0, len(above), STRATUM):
        stratum = above[start:start + STRATUM]
        out += [value - mean(stratum) for value in stratum]
    return out


def explained(small, whole):
    """Share of the variance of one that the other explains."""
    products = [sum(a * b for a, b in zip(x, y)) for x, y in ((small, whole), (small, small), (whole, whole))]
    return products[0] ** 2 / (products[1] * products[2]) if products[1] * products[2] else 0.0


def run(study):
    options = study.options
    folder = study.out if not options.populations else sampling.Path(options.populations).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    size, caches = options.size, options.caches
    rows, shares_of_all, costs_of_all = [], [], []
    for path in options.paths.split(","):
        shares, costs = [], []
        for scene in study.present(options.only.split(",") if options.only else SCENES):
            options.size, options.caches = size, caches
            _, values, cost = population(study, folder, scene, path)
            options.size, options.caches = SMALL, ",".join(CACHES.values())
            _, small_values, small_cost = population(study, folder, scene, path)
            whole, small = counts(values), counts(small_values)
            costs.append(sum(small_cost[key] for key in ("capture", "replay")) / sum(cost[key] for key in ("capture", "replay")))
            for pair, small_pair in CACHES.items():
                for order in ORDERS.split(","):
                    of_small = residuals(small[small_pair, order], small[small_pair, "morton"])
                    shares.append(explained(of_small, residuals(whole[pair, order], whole[pair, "morton"])))
        rows.append([path, *line(shares, costs)])
        shares_of_all += shares
        costs_of_all += costs
    rows.append(["all", *line(shares_of_all, costs_of_all)])
    study.write(
        "sampling-two-phase", f"residuals of the saving within strata of {STRATUM} frames, at {SMALL} and {size}; processor times",
        "path | populations | explained, lower quartile % | median % | upper quartile % | small captures cost, least % | mean % | most %", rows, machine())


def line(shares, costs):
    shares = sorted(shares)
    quartiles = (shares[int(part * (len(shares) - 1))] for part in (0.25, 0.5, 0.75))
    return [len(shares), *(f"{100 * share:.0f}" for share in [*quartiles, min(costs), mean(costs), max(costs)])]
