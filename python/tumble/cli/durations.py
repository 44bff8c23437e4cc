"""Lengths of time as they are typed: `500ms`, `5s`, `10min`, `2h`."""

from __future__ import annotations

import re

from tumble.foundation.errors import ProcedureError

_SECONDS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def seconds_of(option: str, text: str) -> float:
    """Reads a length of time, s unless a unit is typed; raises `ProcedureError` where it is none."""
    match = re.fullmatch(rf"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*({'|'.join(_SECONDS)})?\s*", text)
    seconds = float(match[1]) * _SECONDS[match[2] or "s"] if match else 0.0
    if not seconds > 0.0:
        raise ProcedureError(f"{option} {text}: give a time above zero, such as 5s")
    return seconds
