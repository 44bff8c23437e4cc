"""A recording together with what was acquired from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tumble import _core
from tumble.acquisition.thermometer import ThermometerFault
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_formats import stem_of
from tumble.foundation.provenance import NO_LOG, LogFacts, log_digest
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.units import Triad
from tumble.logs import parse_spec


class ChannelFault(NamedTuple):
    """A channel that cannot be trusted, as `Acquired.faults` has it."""

    channel: str
    kind: str
    """`stuck`, `saturated at rest` or `saturated in motion`."""
    value: float
    """The value it holds, SI."""
    first: float
    last: float
    """s."""
    samples: int = 0
    """Samples at the end of the range, of a channel saturated in motion."""
    runs: Sequence[tuple[float, float]] = ()
    """First and last time of each run of them, s."""

    @property
    def is_of_gyroscope(self) -> bool:
        """Returns whether the channel is one of the gyroscope."""
        return self.channel.startswith("gyroscope")

    def touches(self, start: float, end: float) -> bool:
        """Returns whether the channel was at the end of its range between two times, s."""
        return any(first <= end and start <= last for first, last in self.runs)


@dataclass(frozen=True, slots=True)
class Imu:
    """One IMU of a session."""

    recording: Recording
    acquired: _core.Acquired
    notices: tuple[str, ...] = ()
    """Notices on samples that were left out while reading."""
    log: LogFacts = NO_LOG
    gyroscope_digest: str = ""
    """Digest of the logged readings, as from `SensorHead.digest`."""
    axes_twice: str = ""
    """Describes a sensor of which two axes are one column, as `UnitHeads.twice` does."""
    digest: str = ""
    """Digest of both sensors, as from `UnitHeads.digest`, of the first file."""
    stuck: tuple[ChannelFault, ...] = ()
    """Channels that repeated one reading for a while."""
    thermometer: tuple[ThermometerFault, ...] = ()
    """Stretches without a temperature."""
    clock_sets: tuple[float, ...] = ()
    """s, of the first sample after each time that the clock was set, as of `Counts`."""

    @property
    def name(self) -> str:
        """Short name for tables and messages."""
        return self.recording.name

    @property
    def triads(self) -> tuple[Triad, ...]:
        """Those that were recorded; what was acquired of the other is zero, and means nothing."""
        return self.recording.metadata.triads

    @property
    def rate(self) -> float:
        """Samples a second, Hz; NaN where the log has no length."""
        return self.acquired.samples / self.log.duration if self.log.duration > 0.0 else math.nan

    @property
    def faults(self) -> list[ChannelFault]:
        """Faults of the channels that were recorded."""
        return [*self.stuck, *recorded_faults(self.acquired, self.triads)]


def recorded_faults(acquired: _core.Acquired, triads: tuple[Triad, ...]) -> list[ChannelFault]:
    """Returns the faults of recorded channels; one that was not recorded is no fault."""
    return [fault for fault in faults_of(acquired) if fault.channel.startswith(triads)]


def faults_of(acquired: _core.Acquired) -> list[ChannelFault]:
    """Returns the faults of all channels."""
    return [ChannelFault(*fault) for fault in acquired.faults]


def known(values: FloatArray, triad: Triad, triads: tuple[Triad, ...]) -> FloatArray:
    """Returns what was acquired of a triad, NaN where it was not recorded."""
    return values if triad in triads else np.full(values.shape, np.nan)


def log_name(recording: Recording) -> str:
    """Names a log as results do: without the folders it is in, which are of the user's machine."""
    source = recording.metadata.source
    if recording.metadata.in_memory:
        return source
    spec = parse_spec(source)
    return f"{spec.path.name}:{spec.imu}" if spec.imu else spec.path.name


def digest_of(recording: Recording) -> str:
    """SHA-256 of the log that a recording was opened from, in hexadecimal; empty for arrays in memory."""
    metadata = recording.metadata
    return "" if metadata.in_memory else log_digest(parse_spec(metadata.source).path)


def pose_file(part: Recording) -> str:
    """Name by which the file of one pose is known in the folders of all IMUs and in the pose list."""
    metadata = part.metadata
    name = metadata.name if metadata.in_memory else stem_of(parse_spec(metadata.source).path)
    return name.casefold()


def pose_files(recording: Recording) -> tuple[str, ...]:
    """Returns the name of each file of a recording that has one a pose.

    Raises `ProcedureError` where two files have one name.
    """
    names = tuple(pose_file(part) for part in recording.parts)
    for name in names:
        if names.count(name) > 1:
            raise ProcedureError(
                f"{names.count(name)} files are named {name!r}, which differ in case or "
                "extension only; keep one for each pose",
                about=recording.name,
            )
    return names
