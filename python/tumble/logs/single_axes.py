"""Several logs of single-axis sensors, read as one unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.recording import Chunk, FloatArray, Metadata, Recording
from tumble.foundation.units import CHANNELS, TRIADS, Channel, channels_of, triad_of
from tumble.logs.interpolation import Block, TimedReadings
from tumble.logs.options import ReadOptions, options_for
from tumble.logs.reading import open_recording
from tumble.logs.spec import parse_spec

FORMAT = "single axes"
"""Format of such a unit, in its metadata."""
BRIDGED_STEPS = 3.0
"""Usual steps between two readings of a sensor up to which a value between them is interpolated."""


@dataclass(frozen=True, slots=True)
class SingleAxes:
    """A unit of single-axis sensors, each with a log of its own."""

    name: str
    logs: Mapping[Channel, str | Path]
    """`LOG`, or `LOG:COLUMN`, of each channel that the unit has; all are stamped by one clock."""

    @classmethod
    def parse(cls, text: str) -> SingleAxes:
        """Reads `NAME=CHANNEL:LOG,...`; raises `LogError` where it is none, or names a channel twice."""
        name, _, listed = text.partition("=")
        logs: dict[Channel, str | Path] = {}
        for part in re.split(",(?=[a-z]+:)", listed):
            key, _, log = part.partition(":")
            channel = next((each for each in CHANNELS if each == key), None)
            if not name or channel is None or not log or channel in logs:
                raise LogError(
                    f"--unit {text}: expected NAME=CHANNEL:LOG,... with each of {' '.join(CHANNELS)} once at "
                    "most, as imu2=ax:x.csv,ay:y.csv,gz:yaw.csv"
                )
            logs[channel] = log
        return cls(name, logs)


def open_single_axes(
    unit: SingleAxes, read: ReadOptions | Mapping[str, ReadOptions] | None = None
) -> Recording:
    """Opens a unit of single-axis sensors.

    Samples are those of the first channel in the order `ax ay az gx gy gz`; readings of the others are
    interpolated linearly to its times, and NaN where a sensor paused for more than `BRIDGED_STEPS` of its
    steps. The unit begins as soon as all its sensors have begun. Channels without a log are NaN, and
    `Metadata.missing` names those of a triad that has others. `read` holds the options of reading the logs.

    Raises `LogError` where one of them cannot be read.
    """
    sensors = {
        channel: _open(channel, unit.logs[channel], read) for channel in CHANNELS if channel in unit.logs
    }
    return Recording(_metadata(unit.name, sensors), lambda: _samples(sensors))


def _open(
    channel: Channel, log: str | Path, read: ReadOptions | Mapping[str, ReadOptions] | None
) -> Recording:
    options = replace(options_for(log, read) or ReadOptions(), channel=channel)
    spec = parse_spec(log)
    if spec.imu is not None:
        options = replace(options, columns={**options.columns, channel: spec.imu})
    return open_recording(spec.path, options)


def _metadata(name: str, sensors: Mapping[Channel, Recording]) -> Metadata:
    first = next(iter(sensors.values())).metadata
    triads = tuple(triad for triad in TRIADS if any(triad_of(channel) == triad for channel in sensors))
    accelerometers, gyroscopes = (
        [sensor.metadata for channel, sensor in sensors.items() if triad_of(channel) == triad]
        for triad in TRIADS
    )
    return replace(
        first,
        accelerometer_unit=(accelerometers or gyroscopes)[0].accelerometer_unit,
        gyroscope_unit=(gyroscopes or accelerometers)[0].gyroscope_unit,
        name=name,
        format=FORMAT,
        clock=first.clock if len({sensor.metadata.clock for sensor in sensors.values()}) == 1 else "",
        source=",".join(f"{channel}:{sensor.metadata.source}" for channel, sensor in sensors.items()),
        triads=triads,
        missing=tuple(
            channel for triad in triads for channel in channels_of(triad) if channel not in sensors
        ),
        alone=True,
        remarks=tuple(
            f"{channel}: {remark}"
            for channel, sensor in sensors.items()
            for remark in sensor.metadata.remarks
        ),
    )


def _readings(channel: Channel, sensor: Recording) -> Iterator[Block]:
    triad = triad_of(channel)
    axis = channels_of(triad).index(channel)
    for chunk in sensor.chunks():
        yield chunk.time, getattr(chunk, triad)[:, [axis]]


def _samples(sensors: Mapping[Channel, Recording]) -> Iterator[Chunk]:
    """Returns samples at the times of the first sensor, from the first reading of the last one to begin."""
    (first, sensor), *others = sensors.items()
    read = {
        channel: TimedReadings(_readings(channel, other), longest=BRIDGED_STEPS) for channel, other in others
    }
    for other in read.values():
        other.read_on()
    begin = max((other.begin for other in read.values() if other.begin is not None), default=-np.inf)
    for time, values in _readings(first, sensor):
        kept = time >= begin
        if kept.any():
            yield _sample(first, read, time[kept], values[kept, 0])


def _sample(
    first: Channel, others: Mapping[Channel, TimedReadings], time: FloatArray, values: FloatArray
) -> Chunk:
    readings = np.full((len(time), len(CHANNELS)), np.nan)
    readings[:, CHANNELS.index(first)] = values
    for channel, other in others.items():
        other.read_to(float(time[-1]))
        readings[:, CHANNELS.index(channel)] = other.at(time)[:, 0]
        other.forget(float(time[-1]))
    return Chunk(time, np.ascontiguousarray(readings[:, :3]), np.ascontiguousarray(readings[:, 3:]))
