"""Rate tables that turn themselves: drivers, what keeps them within limits, and plans of poses.

Read in this order: `axes` (what a table is made of and may do), `rate_table` (what every driver gives),
`motion` (how an axis gets from one angle to another), `simulated` and `text` (the drivers, the latter by
a `profile` that a laboratory writes), `registry` (which driver an address means), `guarded` (limits, and
the stop on every way out), `plan` (which poses, in which order).

>>> import numpy as np
>>> from tumble.tools.table import GuardedTable, open_table
>>> with GuardedTable(open_table("simulated:two-axis?speed=1000"), armed=True) as table:
...     seconds = table.goto(np.radians([90.0, 0.0]))
...     table.wait()
...     np.degrees(table.position()).round(3).tolist()
[90.0, 0.0]

A table of your own is a class that does what `RateTable` asks for, and a function that makes one of a
`TableAddress`, named in the `pyproject.toml` of your package; `--table ours:3` then finds it:

    [project.entry-points."tumble.tables"]
    ours = "your_package:open_ours"
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tumble.foundation import lazy

if TYPE_CHECKING:
    from tumble.tools.table.axes import Axis, AxisLimits
    from tumble.tools.table.guarded import GuardedTable
    from tumble.tools.table.rate_table import RateTable
    from tumble.tools.table.registry import TableAddress, drivers, open_table

__all__ = ["Axis", "AxisLimits", "GuardedTable", "RateTable", "TableAddress", "drivers", "open_table"]

__getattr__ = lazy.attributes(
    __name__,
    {
        "tumble.tools.table.axes": ("Axis", "AxisLimits"),
        "tumble.tools.table.guarded": ("GuardedTable",),
        "tumble.tools.table.rate_table": ("RateTable",),
        "tumble.tools.table.registry": ("TableAddress", "drivers", "open_table"),
    },
)
