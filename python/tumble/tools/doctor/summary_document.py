"""JSON that `tumble doctor` prints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.tools.doctor.command import DIAGNOSIS
from tumble.tools.doctor.result import Diagnosed


class DiagnosisDocument(Printed):
    """Parts that are installed, and their state."""

    schema_: Literal["tumble-diagnosis/1"] = Field(DIAGNOSIS, alias="schema")
    verdict: Literal["works", "does not work"]
    works: bool
    sections: dict[str, list[Diagnosed]]
