"""CSV that Tumble wrote, as pyarrow reads it: the speed that our reader is compared with."""

from __future__ import annotations

from pathlib import Path

import pyarrow.csv  # type: ignore[import-untyped]


def csv_of_ours(path: Path) -> object:
    """Reads a table behind the line that states its units."""
    return pyarrow.csv.read_csv(path, read_options=pyarrow.csv.ReadOptions(skip_rows=1))
