"""JSON that `tumble convert` prints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.tools.convert.command import CONVERSION
from tumble.tools.convert.result import ConvertedImu


class ConversionDocument(Printed):
    """A log in another format."""

    schema_: Literal["tumble-conversion/1"] = Field(CONVERSION, alias="schema")
    verdict: Literal["written"]
    source: str
    format: str
    imus: list[ConvertedImu]
