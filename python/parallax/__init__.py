"""Traces of stereo rendering as Arrow tables, and replays as data frames.

Trace files come from ``tracegen``; every function takes their paths. Replays are those of the program
``replay``: the same settings, the same figures, and the same texts of errors.

>>> import parallax
>>> records = parallax.read_textrace("traces/atrium.textrace")      # pyarrow.Table
>>> accesses = parallax.lines("traces/atrium.textrace", "z2-sta")   # numpy arrays
>>> parallax.run("traces/atrium.textrace", {"mode": "functional"})  # pandas.DataFrame
"""

from ._native import ParallaxError, __version__
from ._orders import Grid, order_items
from ._programs import program
from ._replays import reproject, result, run, sweep
from ._tables import EYES, info, lines, read_raytrace, read_textrace

__all__ = [
    "EYES",
    "Grid",
    "ParallaxError",
    "__version__",
    "info",
    "lines",
    "order_items",
    "program",
    "read_raytrace",
    "read_textrace",
    "reproject",
    "result",
    "run",
    "sweep",
]
