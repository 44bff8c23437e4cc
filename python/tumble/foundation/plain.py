"""Results as plain mappings, lists, numbers and text: what YAML and JSON hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np


def plain(value: object) -> object:
    """Turns data classes, numpy values, tuples and paths, which results hold, into types of YAML and JSON."""
    return _turned(value, float)


def finite(value: object) -> object:
    """Turns it plain, with None for what is not a finite number, which JSON does not have."""
    return _turned(value, finite_or_none)


def _turned(value: object, number: Callable[[float], float | None]) -> object:
    # Nearly all that live sessions print, step by step, is of these types.
    if type(value) in _LEAVES:
        return value
    if isinstance(value, np.ndarray | np.generic):
        return _turned(value.tolist(), number)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, Mapping):
        return {str(key): _turned(item, number) for key, item in value.items()}
    if isinstance(value, tuple | list | set | frozenset):
        return [_turned(item, number) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _turned(getattr(value, field.name), number) for field in fields(value)}
    return str(value) if isinstance(value, Path) else value


_LEAVES = frozenset({str, int, bool, type(None)})


def finite_or_none(value: float) -> float | None:
    """Returns a number as Python's own; None for what is not finite."""
    return float(value) if math.isfinite(value) else None
