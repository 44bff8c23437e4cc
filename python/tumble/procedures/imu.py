"""A recording together with what was acquired from it."""

from __future__ import annotations

from dataclasses import dataclass

from tumble import _core
from tumble.recording import Recording


@dataclass(frozen=True, slots=True)
class Imu:
    """One IMU of a session."""

    recording: Recording
    acquired: _core.Acquired
    remarks: tuple[str, ...] = ()
    """What was left out while reading."""

    @property
    def name(self) -> str:
        """Short name for tables and messages."""
        return self.recording.name
