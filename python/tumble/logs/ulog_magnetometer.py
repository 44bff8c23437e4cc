"""Magnetometers of logs of PX4, in gauss: `sensor_mag` of each, and what PX4 flew by.

`sensor_mag` is raw since PX4 1.11, in the axes of its sensor. `vehicle_magnetometer` is
`R scale (raw + power * compensation - offset)` less an estimate of the bias that it makes in flight
(src/lib/sensor_calibration/Magnetometer.hpp, src/modules/sensors/vehicle_magnetometer), which no log
undoes; `magnetometer_ga` of `sensor_combined` is the same of before 1.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.logs.flight import FlightMagnetometer, at_times
from tumble.logs.track import RawMagnetic
from tumble.logs.ulog_file import ULogFile, UlogRecords, UlogTopic
from tumble.logs.walk import Damage, doubles

RAW, VEHICLE, COMBINED, BATTERY = "sensor_mag", "vehicle_magnetometer", "sensor_combined", "battery_status"
TOPICS = (RAW, VEHICLE)
FIELDS: Mapping[str, str] = {VEHICLE: "magnetometer_ga", COMBINED: "magnetometer_ga"}
USABLE_RATE = 2.0
"""Hz: what comes more rarely leaves most rests of a session with a few readings."""
RELATIVE = "magnetometer_timestamp_relative"
NO_READING = 2**31 - 1
"""Relative time of a sample of `sensor_combined` without a magnetometer."""
CURRENTS = ("current_a", "current_filtered_a")


@dataclass(frozen=True, slots=True)
class LoggedTopic:
    """One instance of a topic with a magnetometer, as a pass over the log found it."""

    rate: float
    names: tuple[str, ...]
    device: int
    """Id; 0 where it is not known, or changed."""


def magnetometers_of(
    log: ULogFile, topics: Mapping[UlogTopic, LoggedTopic], remarks: tuple[str, ...]
) -> list[FlightMagnetometer]:
    """Returns the magnetometers of a log: raw before corrected, the one PX4 prefers first.

    One that was logged too rarely to be used comes after the others.
    """
    primary = int(log.parameters.get("CAL_MAG_PRIME", 0))
    ranked = [
        (topic.name != RAW, facts.device != primary, topic.instance, topic, facts)
        for topic, facts in topics.items()
        if _holds_field(topic, facts) and facts.rate > 0.0
    ]
    ranked.sort(key=lambda each: (each[4].rate < USABLE_RATE, each[:3]))
    return [_magnetometer(log, topic, facts, remarks) for *_, topic, facts in ranked]


def _holds_field(topic: UlogTopic, facts: LoggedTopic) -> bool:
    wanted = {"x", "y", "z"} if topic.name == RAW else {FIELDS[topic.name]}
    return wanted <= set(facts.names)


def _magnetometer(
    log: ULogFile, topic: UlogTopic, facts: LoggedTopic, remarks: tuple[str, ...]
) -> FlightMagnetometer:
    raw = topic.name == RAW and "timestamp_sample" in facts.names
    return FlightMagnetometer(
        topic.name if topic.name == COMBINED else f"{topic.name}_{topic.instance}",
        "G",
        partial(_read, log, topic),
        already_corrected=not raw,
        notices=(*_notices(log, topic, facts, raw=raw), *remarks),
    )


def _notices(log: ULogFile, topic: UlogTopic, facts: LoggedTopic, *, raw: bool) -> Iterator[str]:
    if not raw:
        yield (
            f"the magnetometer {topic.name} was corrected by PX4; {RAW} is raw, which bit 6 of SDLOG_PROFILE "
            "(sensor comparison) logs at 10 Hz"
        )
    if facts.rate < USABLE_RATE:
        yield f"the magnetometer {topic.name} was logged at {facts.rate:.3g} Hz, too slow to follow motion"
    number = next((n for n in range(4) if log.parameters.get(f"CAL_MAG{n}_ID", 0) == facts.device != 0), None)
    turn = int(log.parameters.get(f"CAL_MAG{number}_ROT", 0)) if number is not None else 0
    if topic.name == RAW and turn > 0:
        yield f"the magnetometer is in the axes of its own sensor, which CAL_MAG{number}_ROT = {turn} turns"


def _read(log: ULogFile, topic: UlogTopic) -> RawMagnetic:
    """Reads all of a topic, in G, with the current of the battery at its times."""
    times, fields = [np.empty(0)], [np.empty((0, 3))]
    powered, currents = [np.empty(0)], [np.empty(0)]
    for block in log.blocks([topic.name, BATTERY], Damage()):
        if topic in block:
            times.append(_time(topic, block[topic]))
            fields.append(_field(topic, block[topic]))
        battery = block.get(UlogTopic(BATTERY, 0))
        if battery is not None and (name := _current_of(battery)):
            powered.append(doubles(battery["timestamp"]) / 1e6)
            currents.append(doubles(battery[name]))
    time = np.concatenate(times)
    # A battery without a measurement of its current reports -1.
    current = np.concatenate(currents)
    known = current >= 0.0
    return RawMagnetic(
        time, np.concatenate(fields), at_times(time, np.concatenate(powered)[known], current[known])
    )


def _current_of(records: UlogRecords) -> str | None:
    names = records.dtype.names or ()
    return next((name for name in CURRENTS if name in names and "timestamp" in names), None)


def _time(topic: UlogTopic, records: UlogRecords) -> FloatArray:
    names = records.dtype.names or ()
    stamp = next((each for each in ("timestamp_sample", "timestamp") if each in names), None)
    if stamp is None:
        return np.full(len(records), np.nan)
    time = doubles(records[stamp])
    if topic.name != COMBINED or RELATIVE not in names:
        return time / 1e6
    relative = records[RELATIVE]
    return np.where(relative == NO_READING, np.nan, time + doubles(relative)) / 1e6


def _field(topic: UlogTopic, records: UlogRecords) -> FloatArray:
    if topic.name == RAW:
        return np.stack([doubles(records[axis]) for axis in "xyz"], axis=-1)
    return doubles(records[FIELDS[topic.name]])
