"""Serial numbers as evidence of whether what is taken together is of one unit."""

from __future__ import annotations

from collections.abc import Iterable

from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import join


def are_of_two(one: str | None, other: str | None) -> bool:
    """Returns whether two serial numbers are those of two units; one that is empty is not known."""
    return bool(one and other) and one != other


def refuse_several_units(serials: Iterable[str], what: str) -> None:
    """Raises `ProcedureError`, in one line, where what belongs to one unit states several serial numbers."""
    stated = sorted({each for each in serials if each})
    if len(stated) > 1:
        raise ProcedureError(f"are of units {join(stated)}; give {what} of one unit")
