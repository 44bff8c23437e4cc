"""Results as plain mappings, lists, numbers and text: what YAML and JSON hold."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np


def plain(value: object) -> object:
    """Turns data classes, numpy values, tuples and paths, which results hold, into types of YAML and JSON."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list | set | frozenset):
        return [plain(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def finite(value: object) -> object:
    """Turns it plain, with None for what is not a finite number, which JSON does not have."""
    return _without_infinities(plain(value))


def _without_infinities(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_infinities(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_infinities(item) for item in value]
    return finite_or_none(value) if isinstance(value, float) else value


def finite_or_none(value: float) -> float | None:
    """Returns a number as Python's own; None for what is not finite."""
    return float(value) if math.isfinite(value) else None


class _Short(reprlib.Repr):
    """Looks at no more of a value than it shows."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxlist, self.maxdict, self.maxtuple, self.maxset = 4, 10, 6, 10, 10
        self.maxstring = self.maxother = _SHORT


_SHORT = 60
_short = _Short()


def short(value: object) -> str:
    """Shows a value in a message: at most 60 characters of it, however large it is."""
    text = _short.repr(value)
    return text if len(text) <= _SHORT else f"{text[: _SHORT - 3]}..."
