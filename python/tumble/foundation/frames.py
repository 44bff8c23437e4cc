"""Results as data frames of pandas, which is asked for only where somebody asks for a frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

from tumble.foundation.errors import TumbleError

if TYPE_CHECKING:
    from pandas import DataFrame


def frame_of(rows: Iterable[Mapping[str, object]]) -> DataFrame:
    """Creates a data frame; raises `TumbleError` where pandas is not installed."""
    try:
        pandas = import_module("pandas")
    except ImportError:
        raise TumbleError(
            "to_frame() needs pandas, which is not installed; run pip install pandas, or take rows()"
        ) from None
    frame: DataFrame = pandas.DataFrame(list(rows))
    return frame
