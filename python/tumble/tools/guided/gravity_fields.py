"""Questions about local gravity that runs share."""

from __future__ import annotations

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.message import message
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField

GRAVITY_FIELDS = (
    RunField(
        name="latitude",
        label=message("Latitude"),
        kind="number",
        unit="deg",
        least=-90.0,
        most=90.0,
        help=message("Local gravity follows from latitude and height."),
        advanced=True,
    ),
    RunField(
        name="height",
        label=message("Height above the ellipsoid"),
        kind="number",
        unit="m",
        least=-500.0,
        most=9000.0,
        advanced=True,
    ),
    RunField(
        name="gravity",
        label=message("Local gravity"),
        kind="number",
        unit="m/s^2",
        least=9.5,
        most=10.0,
        help=message("{standard} if nothing is given.", standard=f"{STANDARD_GRAVITY:g} m/s²"),
        advanced=True,
    ),
)
"""Latitude, height, and gravity itself."""


def gravity_of(answers: Answers) -> dict[str, float | None]:
    """Returns local gravity as procedures take it.

    Raises `ProcedureError` where it is given twice, or a height without a latitude.
    """
    given = {name: answers.number(name) for name in ("gravity", "latitude", "height")}
    if given["gravity"] is not None and (given["latitude"] is not None or given["height"] is not None):
        raise ProcedureError("gravity and latitude or height exclude each other; give one of them")
    if given["height"] is not None and given["latitude"] is None:
        raise ProcedureError("height needs latitude to work out gravity; give both")
    return given
