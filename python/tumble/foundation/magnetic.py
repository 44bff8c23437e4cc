"""Readings of a magnetometer beside those of an IMU, at times of their own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

from tumble.foundation import arrays
from tumble.foundation.arrays import FloatArray
from tumble.foundation.errors import ArrayError
from tumble.foundation.units import FIELD_UNITS
from tumble.foundation.words import plain

if TYPE_CHECKING:
    from numpy.typing import NDArray

MICROTESLA: Final = "uT"
"""Unit of the magnetic field, inside and in all files that are written."""

MagneticChannel: TypeAlias = Literal["mx", "my", "mz"]
"""One axis of the magnetometer."""

MAGNETIC_CHANNELS: Final[tuple[MagneticChannel, ...]] = ("mx", "my", "mz")
"""All channels of a magnetometer, x first."""

LoadUnit: TypeAlias = Literal["A", "1"]
"""Unit of what disturbs a magnetometer: ampere, or the share 0 to 1 of a throttle."""


@dataclass(frozen=True, slots=True)
class MagneticTrack:
    """Successive readings of one magnetometer, in the case frame of the IMU beside it.

    The times are on the clock of the recording; their number and rate are those of the magnetometer. Raises
    `ArrayError` for arrays of other shapes.
    """

    time: FloatArray
    """(m,) s of the clock of the recording."""
    field: FloatArray
    """(m, 3) uT; finite."""
    current: FloatArray | None = None
    """(m,) A of the motors or share of the throttle, where the log has either; NaN where it is unknown."""
    current_unit: LoadUnit = "A"
    """Unit of `current`."""
    name: str = ""
    """Name of the magnetometer in its log: a topic, a prefix of columns; empty where it needs none."""
    unit: str = MICROTESLA
    """Unit in which the log holds the field, a name of `FIELD_UNITS`."""
    unit_reason: str = "arrays are in uT"
    """Reason why `unit` was taken: `column name`, `message definition`, `option`, `ASSUMED`."""
    already_corrected: bool | None = None
    """True where the log is known to hold corrected readings, None where nobody knows."""
    remarks: tuple[str, ...] = ()
    """Remarks of the reader for the user: readings left out, an unlikely unit, a correction undone."""

    def __post_init__(self) -> None:
        """Makes arrays of what was given, and escapes control characters in the texts of a log."""
        object.__setattr__(self, "time", arrays.times(self.time))
        object.__setattr__(self, "field", arrays.triad(self.field, "magnetometer"))
        arrays.refuse_other_lengths([("time", self.time), ("magnetometer", self.field)])
        if self.current is not None:
            object.__setattr__(self, "current", arrays.column(self.current, "current"))
            arrays.refuse_other_lengths([("time", self.time), ("current", self.current)])
        if self.unit not in FIELD_UNITS:
            raise ArrayError(f"magnetometer: unit {self.unit!r} is none of {', '.join(FIELD_UNITS)}")
        object.__setattr__(self, "name", plain(self.name))
        object.__setattr__(self, "remarks", tuple(map(plain, self.remarks)))

    def __len__(self) -> int:
        return len(self.time)

    @property
    def rate(self) -> float:
        """Median rate of the readings, Hz; NaN where there are fewer than two."""
        steps = np.diff(self.time)
        steps = steps[steps > 0.0]
        return float(1.0 / np.median(steps)) if len(steps) else float("nan")

    @property
    def strength(self) -> float:
        """Median length of the raw field, uT; NaN where there are no readings."""
        return float(np.median(np.linalg.norm(self.field, axis=1))) if len(self) else float("nan")

    def chosen(self, rows: NDArray[np.bool_] | slice) -> MagneticTrack:
        """Returns some of the readings, with all that is known of the track."""
        current = None if self.current is None else self.current[rows]
        return replace(self, time=self.time[rows], field=self.field[rows], current=current)

    @classmethod
    def joined(cls, tracks: Iterable[MagneticTrack | None]) -> MagneticTrack | None:
        """Joins successive pieces of one track, such as those of live chunks; None where there are none."""
        pieces = [track for track in tracks if track is not None]
        if not pieces:
            return None
        loads = [piece.current for piece in pieces if piece.current is not None]
        return replace(
            pieces[0],
            time=np.concatenate([piece.time for piece in pieces]),
            field=np.concatenate([piece.field for piece in pieces]),
            current=np.concatenate(loads) if len(loads) == len(pieces) else None,
            remarks=tuple(dict.fromkeys(remark for piece in pieces for remark in piece.remarks)),
        )
