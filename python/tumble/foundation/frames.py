"""Results and samples as tables of pandas and xarray, imported where one is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib import import_module
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING

from tumble.foundation.errors import TumbleError

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

VALUE = "value"
"""First column of a table that is a number; those before it name what the number is of."""

_MOST_ROWS = 100
"""Rows that a notebook shows."""


def frame_of(rows: Iterable[Mapping[str, object]]) -> DataFrame:
    """Creates a data frame; raises `TumbleError` where pandas is not installed."""
    pandas = library("pandas", "to_pandas() needs pandas", "take rows()")
    frame: DataFrame = pandas.DataFrame(list(rows))
    return frame


def dataset_of(rows: Iterable[Mapping[str, object]]) -> Dataset:
    """Creates a data set with a dimension for each column before `value`; else one dimension, `row`.

    Raises `TumbleError` where xarray is not installed.
    """
    xarray = library("xarray", "to_xarray() needs xarray", "take rows()")
    frame = frame_of(rows)
    names = list(frame.columns)
    keys = names[: names.index(VALUE)] if VALUE in names else []
    is_unique = bool(keys) and not frame.duplicated(keys).any()
    indexed = frame.set_index(keys) if is_unique else frame.rename_axis("row")
    dataset: Dataset = xarray.Dataset.from_dataframe(indexed)
    return dataset


def html_table(rows: Iterable[Mapping[str, object]]) -> str:
    """Prints a table for notebooks, its first lines where it is long."""
    shown = list(islice(rows, _MOST_ROWS + 1))
    if not shown:
        return "<p>an empty table</p>"
    lines = [_html_row("th", list(shown[0]))]
    lines += [_html_row("td", list(row.values())) for row in shown[:_MOST_ROWS]]
    more = f"<p>the first {_MOST_ROWS} rows</p>" if len(shown) > _MOST_ROWS else ""
    return f"<table>{''.join(lines)}</table>{more}"


def _html_row(tag: str, cells: Iterable[object]) -> str:
    from html import escape  # which no command needs

    texts = (f"{cell:.6g}" if isinstance(cell, float) else str(cell) for cell in cells)
    return f"<tr>{''.join(f'<{tag}>{escape(text)}</{tag}>' for text in texts)}</tr>"


def library(name: str, purpose: str, otherwise: str) -> ModuleType:
    """Imports an optional library; raises `TumbleError` where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        raise TumbleError(
            f"{purpose}, which is not installed; run pip install {name}, or {otherwise}"
        ) from None
