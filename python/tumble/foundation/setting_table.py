"""Settings of the core as models: a field for each row of the table, with bounds, unit and default."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model

from tumble import _core
from tumble.foundation.documents import Document
from tumble.foundation.words import short

LARGEST = 1e9
"""SI units: 31 years, or more than any sensor can read; the core keeps no more than so many microseconds."""
LARGEST_COUNT = 2**32 - 1

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_KNOWN_ERROR = r"(?:(?:factory|last)\s*\+|last\s*\*)\s*"
_LONGEST_THRESHOLD = 100
"""Letters; the time of the next pattern grows with the square of them."""
_THRESHOLD = re.compile(rf"\s*(?P<error>{_KNOWN_ERROR})?(?P<number>{_NUMBER})\s*")


def _threshold(value: object) -> object:
    """Reads `0.1`, `factory+0.1`, `last+0.1` or `last*1.5`; returns it without spaces."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return value
    text = str(value)
    match = _THRESHOLD.fullmatch(text) if len(text) <= _LONGEST_THRESHOLD else None
    smallest = 1.0 if match and "*" in (match["error"] or "") else 0.0
    if match is None or not smallest < float(match["number"]) <= LARGEST:
        raise ValueError(
            "needs to be a number above 0, factory+MARGIN, last+MARGIN, or last*RATIO with a ratio above 1, "
            f"found {short(value)}"
        )
    return "".join((match["error"] or "").split()) + match["number"]


def _none(value: object) -> object:
    return None if value == "none" else value


Threshold: TypeAlias = Annotated[
    str,
    BeforeValidator(_threshold),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0.0},
                {"type": "string", "pattern": rf"^\s*({_KNOWN_ERROR})?{_NUMBER}\s*$"},
            ]
        }
    ),
]
"""`0.1`: fixed. `factory+0.1`: the error from the factory and a margin. `last+0.1`, `last*1.5`: the error at
the last calibration and a margin, or times a ratio."""
OrNone: TypeAlias = Annotated[
    Annotated[float, Field(gt=0.0, le=LARGEST)] | None,
    BeforeValidator(_none),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0.0, "maximum": LARGEST},
                {"enum": ["none", None]},
            ]
        }
    ),
]
"""A number above 0, or `none`."""


def model_of(table: _core.SettingTable, name: str, about: str) -> type[Document]:
    """Creates the model of a table; `setting_models.pyi` gives its fields to type checkers and editors."""
    fields: dict[str, Any] = {
        row["name"]: (_annotation(row), _field(row)) for row in _core.setting_table(table)
    }
    return create_model(name, __base__=Document, __doc__=about, **fields)


def _annotation(row: _core.SettingRow) -> Any:  # noqa: ANN401 - an annotation made while it runs
    if row["none"]:
        return OrNone
    match row["kind"]:
        case "flag":
            return bool
        case "count":
            return int
        case "choice":
            return Literal[row["choices"]]
        case "threshold":
            return Threshold
        case _:
            return float


def _field(row: _core.SettingRow) -> Any:  # noqa: ANN401
    # Where there may be none, the bound is that of `OrNone`.
    bounded = not row["none"]
    return Field(
        default=row["default"],
        description=meaning(row),
        json_schema_extra={"unit": row["unit"]},
        validate_default=True,
        gt=row["above"] if bounded else None,
        ge=_least(row) if bounded else None,
        lt=row["below"] if bounded else None,
        le=_largest(row) if bounded and row["below"] is None else None,
    )


def _largest(row: _core.SettingRow) -> float | None:
    return {"number": LARGEST, "time": LARGEST, "count": LARGEST_COUNT}.get(row["kind"])


def _least(row: _core.SettingRow) -> float | None:
    least = row["least"]
    return int(least) if least is not None and row["kind"] == "count" else least


@dataclass(frozen=True, slots=True)
class Explained:
    """A setting as people read of it."""

    group: str
    name: str
    meaning: str
    unit: str
    """Empty for what has none."""
    choices: tuple[str, ...]
    """The words it may be, if it is one of several."""
    default: object


def explain(table: _core.SettingTable) -> Iterator[Explained]:
    """Returns every setting of a table, in order."""
    for row in _core.setting_table(table):
        yield Explained(row["group"], row["name"], meaning(row), row["unit"], row["choices"], row["default"])


def meaning(row: _core.SettingRow) -> str:
    """Describes the meaning of a setting, and that it may be empty."""
    none = f"; `none`: {row['none']}." if row["none"] else "."
    return row["meaning"].removesuffix(".") + none
