"""Columns and units of a live source, which hold for all samples of one recording."""

from __future__ import annotations

from pydantic import Field

from tumble.foundation.documents import Document


class ReadAs(Document):
    """Columns of rows of text, where there are any, and the units that were stated or found."""

    columns: tuple[str, ...] = Field(default=(), strict=False)
    """Names of the fields of a row, in their order."""
    delimiter: str = ""
    """Text between two fields."""
    is_without_names: bool = False
    """Indicates whether rows came without names, so that these are the usual ones."""
    is_of_objects: bool = False
    """Indicates whether the names are those of fields of JSON."""
    units: dict[str, str] = Field(default_factory=dict)
    """Units by quantity; a unit that was assumed is none."""
