"""JSON that `tumble align` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import PrintedResult
from tumble.procedures.align.result import UnitAlignment
from tumble.procedures.align.summary import SCHEMA


class AlignDocument(PrintedResult):
    """Rotation, time offset and lever arm of units that moved together."""

    schema_: Literal["tumble-align-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["aligned", "partly aligned"]
    primary: str
    source: str
    options: dict[str, Any]
    units: list[UnitAlignment]
    """Secondaries, beside the primary."""
