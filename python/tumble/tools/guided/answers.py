"""Answers to the questions of a run, checked against its fields."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import quoted
from tumble.tools.guided.field import FieldValue, RunField


class Answers:
    """Answers by the name of the field; a missing one has its default.

    Raises `ProcedureError` where an answer is of no field, or not of its kind, or out of its bounds.
    """

    def __init__(self, fields: Sequence[RunField], given: Mapping[str, FieldValue]) -> None:
        known = {each.name: each for each in fields}
        for name in given:
            if name not in known:
                raise ProcedureError(f"{name}: is none of {', '.join(known)}; use one of these names")
        answered = {name: _blank_as_none(each) for name, each in given.items()}
        for name, value in answered.items():
            _check(known[name], value)
        self._values = {
            name: value if (value := answered.get(name)) is not None else each.default
            for name, each in known.items()
        }

    def number(self, name: str) -> float | None:
        """Returns a number, None where there is none."""
        value = self._values[name]
        return None if value is None else float(value)

    def whole(self, name: str) -> int | None:
        """Returns a whole number, None where there is none."""
        value = self.number(name)
        return None if value is None else round(value)

    def text(self, name: str) -> str:
        """Returns a text or a choice, empty where there is none."""
        value = self._values[name]
        return "" if value is None else str(value)

    def flag(self, name: str) -> bool:
        """Returns whether a flag is set."""
        return bool(self._values[name])

    def file(self, name: str) -> Path | None:
        """Returns the path of a file or a folder, None where there is none."""
        value = self._values[name]
        return None if value is None else Path(str(value))


def _blank_as_none(value: FieldValue) -> FieldValue:
    return None if isinstance(value, str) and not value.strip() else value


def _check(field: RunField, value: FieldValue) -> None:
    if value is None:
        return
    if field.kind == "number" and not _is_within(field, value):
        bounds = " ".join(
            part
            for part in (
                f"{field.least:g} or more" if field.least is not None else "",
                f"{field.most:g} or less" if field.most is not None else "",
            )
            if part
        )
        raise ProcedureError(f"{field.name}: {quoted(str(value))} is no number{bounds and f' of {bounds}'}")
    if field.kind == "flag" and not isinstance(value, bool):
        raise ProcedureError(f"{field.name}: {quoted(str(value))} is neither true nor false")
    if field.kind == "choice" and value not in dict(field.choices):
        known = ", ".join(word for word, _ in field.choices)
        raise ProcedureError(f"{field.name}: {quoted(str(value))} is none of {known}")


def _is_within(field: RunField, value: FieldValue) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return False
    low = -math.inf if field.least is None else field.least
    high = math.inf if field.most is None else field.most
    return low <= value <= high
