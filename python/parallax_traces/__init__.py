"""Captures of stereo rendering as traces, traces as Arrow tables, and replays as data frames.

Functions that capture run the program ``tracegen``, analyses run ``replay``, and replays with own tile orders or
replacement policies run the same code in this process. Figures and texts of errors are those of the programs.

>>> import parallax_traces as plx
>>> trace = plx.capture("model.glb", size="480x540")         # Path
>>> plx.orders(trace)                                        # pandas.DataFrame
>>> plx.run(trace, {"mode": "functional"}, order="z2-sta")   # pandas.DataFrame
>>> plx.read_textrace(trace)                                 # pyarrow.Table
>>> plx.view(trace)                                          # a page in the notebook's cell
"""

from ._commands import (
    Page,
    accuracy,
    capture,
    capture_program,
    capture_techniques,
    compare,
    document,
    locality,
    orders,
    paper,
    rays,
    readings,
    reproject,
    sample,
    schedule,
    techniques,
    temporal,
    usage,
    view,
)
from ._native import ParallaxError, __version__
from ._orders import Grid, order_items
from ._programs import ProgramError, program
from ._replays import result, run, sweep
from ._tables import EYES, info, lines, read_raytrace, read_textrace

__all__ = [
    "EYES",
    "Grid",
    "Page",
    "ParallaxError",
    "ProgramError",
    "__version__",
    "accuracy",
    "capture",
    "capture_program",
    "capture_techniques",
    "compare",
    "document",
    "info",
    "lines",
    "locality",
    "order_items",
    "orders",
    "paper",
    "program",
    "rays",
    "read_raytrace",
    "read_textrace",
    "readings",
    "reproject",
    "result",
    "run",
    "sample",
    "schedule",
    "sweep",
    "techniques",
    "temporal",
    "usage",
    "view",
]
