"""Reading of a log: what its numbers went through before they were readings in the case frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from tumble.foundation.unit_values import UNIT_VALUES
from tumble.foundation.units import CALIBRATED_TRIADS, UNITS, CalibratedTriad, Triad

LogReading: TypeAlias = Mapping[str, Any]
"""Options that changed readings, by their names in `ReadOptions`, and `CORRECTION`; empty where unknown."""

CORRECTION = "correction"
"""Key of what had corrected the samples of the log: `sha256:...` of a calibration, else in words."""
EARLIER = "before it was read"
"""Correction by what logged the samples."""
AS_LOGGED = "x,y,z"
"""Axes of a log that is not turned."""
TURNING = ("axes", "accelerometer_sign", "accelerometer_zero", "gyroscope_zero")
"""Options that move readings away from those of the sensor's own axes and zeros."""
SCALING = ("accelerometer_scale", "gyroscope_scale", "magnetometer_scale")
"""Counts per unit, which the same samples in units do not need, unless `RAW`."""
RAW = "raw"
"""Key of scales that nobody stated: nominal ones, for which alone a calibration of counts holds."""
TYPED_ALIKE = 1e-5
"""Relative difference of scales that six printed digits leave: a tenth of the smallest sigma of a scale."""
_OF_TUMBLE = "sha256:"


def turns(reading: LogReading) -> str:
    """Returns the options that changed axes, signs or zeros, as they are typed; empty where none did."""
    changed = [name for name in TURNING if reading.get(name) not in (None, AS_LOGGED)]
    return " ".join(_typed(name, reading[name]) for name in changed)


def counts_in(reading: LogReading) -> str:
    """Returns the options that state the nominal scales of counts, as they are typed; empty without any."""
    if not reading.get(RAW):
        return ""
    return " ".join(_typed_scale(name, reading) for name in SCALING if reading.get(name) is not None)


def read_as_counts(reading: LogReading, counts: Mapping[Triad, float | None]) -> LogReading:
    """Returns the reading of a log whose numbers are counts, so many per SI unit as a calibration assumes.

    None for a triad that was not calibrated. Scales and units that were stated beside that are of no effect.
    """
    found = {name: value for name, value in reading.items() if not name.endswith(("_scale", "_unit"))}
    for triad, value in counts.items():
        if value is not None:
            # A nominal scale has four digits: it is read as it is printed.
            found[f"{triad}_scale"] = [float(f"{value:g}")] * 3
            found[f"{triad}_unit"] = UNITS[triad]
    return found | {RAW: True}


def read_otherwise(reading: LogReading, known: LogReading, of: str) -> Iterator[str]:
    """Describes each option by which a log was read otherwise than another, `of`, if both are known.

    Scales are compared as counts per SI unit, whatever units they were stated in.
    """
    if not reading or not known:
        return
    for name in TURNING:
        one, other = reading.get(name), known.get(name)
        if one != other:
            yield f"was read {_given(name, one)}, {of} {_given(name, other)}"
    for name in SCALING:
        if not _scaled_alike(name, reading, known):
            yield f"was read {_given_scale(name, reading)}, {of} {_given_scale(name, known)}"


def _scaled_alike(name: str, reading: LogReading, known: LogReading) -> bool:
    one, other = _counts_per_unit(name, reading), _counts_per_unit(name, known)
    if one is not None and other is not None:
        return all(math.isclose(a, b, rel_tol=TYPED_ALIKE) for a, b in zip(one, other, strict=True))
    # Nominal scales are no property of the sensor, and samples in units have another.
    return not (one is not None and reading.get(RAW)) and not (other is not None and known.get(RAW))


def _counts_per_unit(name: str, reading: LogReading) -> list[float] | None:
    """Returns the counts per SI unit, or microtesla, of each axis; None where none is known."""
    scale = reading.get(name)
    if scale is None:
        return None
    values = UNIT_VALUES[_triad_of(name)]
    unit = reading.get(_unit_of(name)) or next(iter(values))
    return [float(each) / values.get(unit, math.nan) for each in scale]


def corrected_alike(reading: LogReading, known: LogReading) -> bool:
    """Returns whether one correction, or none, was made before of two logs."""
    one, other = (each.get(CORRECTION) or "" for each in (reading, known))
    if _OF_TUMBLE in (one[: len(_OF_TUMBLE)], other[: len(_OF_TUMBLE)]):
        return one == other
    return bool(one) == bool(other)


def _given(name: str, value: object) -> str:
    return f"without {_option(name)}" if value is None else f"with {_typed(name, value)}"


def _given_scale(name: str, reading: LogReading) -> str:
    return f"without {_option(name)}" if reading.get(name) is None else f"with {_typed_scale(name, reading)}"


def _typed_scale(name: str, reading: LogReading) -> str:
    scale, unit = reading[name], reading.get(_unit_of(name))
    typed = _typed(name, scale[0] if len(set(scale)) == 1 else scale)
    return f"{typed} {_typed(_unit_of(name), unit)}" if unit else typed


def _triad_of(scale: str) -> CalibratedTriad:
    return CALIBRATED_TRIADS[SCALING.index(scale)]


def _unit_of(scale: str) -> str:
    return f"{_triad_of(scale)}_unit"


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _typed(name: str, value: object) -> str:
    numbers = ",".join(f"{each:g}" for each in value) if isinstance(value, list | tuple) else value
    numbers = f"{numbers:g}" if isinstance(numbers, float) else numbers
    return f"{_option(name)} {numbers}"
