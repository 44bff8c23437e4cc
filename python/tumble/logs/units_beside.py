"""Units that a file states beside the names of its columns: in attributes, in the metadata of a field."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from tumble.logs.columns import ImuColumns, MagneticColumns
from tumble.logs.stated_units import unit_in
from tumble.logs.track import COLUMN_TYPE, StatedUnit, joint_unit
from tumble.logs.units import Quantity

KEYS = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")
"""Names of the attribute that states a unit."""


def with_units_beside(
    columns: ImuColumns, text: Callable[[str], str], holds_dates: Callable[[str], bool]
) -> ImuColumns:
    """Returns the columns with the units that `text` gives of each, beside those in their names."""

    def stated(
        names: Sequence[str] | None, quantity: Quantity, so_far: StatedUnit | None
    ) -> StatedUnit | None:
        if names and quantity == "time" and holds_dates(names[0]):
            return StatedUnit("ns", COLUMN_TYPE)
        return joint_unit(
            [*(unit_in(text(name), quantity, name, "attribute") for name in names or ()), so_far]
        )

    def alone(name: str | None) -> Sequence[str] | None:
        return None if name is None else [name]

    return replace(
        columns,
        accelerometer_unit=stated(columns.accelerometer, "accelerometer", columns.accelerometer_unit),
        gyroscope_unit=stated(columns.gyroscope, "gyroscope", columns.gyroscope_unit),
        time_unit=stated(alone(columns.time), "time", columns.time_unit),
        temperature_unit=stated(alone(columns.temperature), "temperature", columns.temperature_unit),
        magnetometer=_with_stated_unit(columns.magnetometer, stated),
    )


def _with_stated_unit(
    columns: MagneticColumns | None,
    stated: Callable[[Sequence[str] | None, Quantity, StatedUnit | None], StatedUnit | None],
) -> MagneticColumns | None:
    if columns is None:
        return None
    return replace(
        columns,
        unit=stated(columns.axes, "magnetometer", columns.unit),
        time_unit=stated(None if columns.time is None else [columns.time], "time", columns.time_unit),
    )
