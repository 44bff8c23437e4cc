"""JSON that `tumble inspect` prints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.tools.inspect.command import INSPECTION
from tumble.tools.inspect.result import Inspection


class NotRead(Printed):
    """A log that cannot be read."""

    log: str
    reason: str


class InspectionDocument(Printed):
    """Contents of logs."""

    schema_: Literal["tumble-inspection/1"] = Field(INSPECTION, alias="schema")
    verdict: Literal["read", "partly read"]
    logs: list[Inspection]
    not_read: list[NotRead]
