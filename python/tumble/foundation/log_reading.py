"""Reading of a log: what its numbers went through before they were readings in the case frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

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
"""Counts per unit, which the same samples in units do not need."""
_OF_TUMBLE = "sha256:"


def turns(reading: LogReading) -> str:
    """Returns the options that changed axes, signs or zeros, as they are typed; empty where none did."""
    changed = [name for name in TURNING if reading.get(name) not in (None, AS_LOGGED)]
    return " ".join(_typed(name, reading[name]) for name in changed)


def read_otherwise(reading: LogReading, known: LogReading, of: str) -> Iterator[str]:
    """Describes each option by which a log was read otherwise than another, `of`, if both are known."""
    for name in (*TURNING, *SCALING) if reading and known else ():
        one, other = reading.get(name), known.get(name)
        if one != other and not (name in SCALING and None in (one, other)):
            yield f"was read {_given(name, one)}, {of} {_given(name, other)}"


def corrected_alike(reading: LogReading, known: LogReading) -> bool:
    """Returns whether one correction, or none, was made before of two logs."""
    one, other = (each.get(CORRECTION) or "" for each in (reading, known))
    if _OF_TUMBLE in (one[: len(_OF_TUMBLE)], other[: len(_OF_TUMBLE)]):
        return one == other
    return bool(one) == bool(other)


def _given(name: str, value: object) -> str:
    return f"without {_option(name)}" if value is None else f"with {_typed(name, value)}"


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _typed(name: str, value: object) -> str:
    numbers = ",".join(f"{each:g}" for each in value) if isinstance(value, list | tuple) else value
    return f"{_option(name)} {numbers}"
