"""Logs of PX4: every IMU in each form that PX4 logs it.

`sensor_accel` with `sensor_gyro` and their FIFO topics are readings as the sensor gives them;
`sensor_combined` and `vehicle_imu` are corrected. Before PX4 1.11, which stamps `timestamp_sample`, drivers
corrected as well.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from tumble.foundation.errors import CalibrationFileError, LogError
from tumble.foundation.files import once_per_file
from tumble.foundation.firmware.correction import Corrections, over_time
from tumble.foundation.firmware.px4 import correction_of
from tumble.foundation.firmware.rotations import rotation
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of, join
from tumble.logs import ulog_magnetometer
from tumble.logs.flight import FlightImu, FlightMagnetometer, Times, list_of, open_flight_imu
from tumble.logs.options import ReadOptions
from tumble.logs.pairing import CLOSE, USABLE_RATE, Thermometer, TriadSamples, paired
from tumble.logs.track import LoggedImu, RawSamples
from tumble.logs.ulog_file import MOST_CHANGES, ULogFile, UlogRecords, UlogTopic, opened
from tumble.logs.walk import Damage, doubles

SENSOR: Mapping[Triad, str] = {"accelerometer": "sensor_accel", "gyroscope": "sensor_gyro"}
FIFO: Mapping[Triad, str] = {"accelerometer": "sensor_accel_fifo", "gyroscope": "sensor_gyro_fifo"}
COMBINED, DELTAS, STATUS = "sensor_combined", "vehicle_imu", "vehicle_imu_status"
SELECTION = "sensor_selection"
TOPICS = (*SENSOR.values(), *FIFO.values(), COMBINED, DELTAS, STATUS, SELECTION, *ulog_magnetometer.TOPICS)
SOUGHT = f"one of {COMBINED}, {DELTAS}, or {' and '.join(SENSOR.values())}"
FIRST_RELEASE = (1, 11)
"""First release of PX4 whose drivers no longer correct."""
NO_ACCELEROMETER = 2**31 - 1
"""`accelerometer_timestamp_relative` of a sample without one."""
FASTER = (
    "SDLOG_PROFILE bits 8 and 9 (raw FIFO) log the first IMU with every sample, bit 6 (sensor comparison) "
    "all of them at 10 Hz"
)
_DEVICE: Mapping[Triad, str] = {"accelerometer": "accel_device_id", "gyroscope": "gyro_device_id"}
_CORRECTS = re.compile("CAL_(ACC|GYRO)|TC_|SENS_BOARD_")


@dataclass(slots=True)
class _TopicFacts(Times):
    """Result of one pass for one instance of a topic."""

    names: tuple[str, ...] = ()
    """Names of its fields."""
    devices: dict[str, set[int]] = field(default_factory=dict)
    """Ids, by the field that holds them."""
    clipped: int = 0


@dataclass(frozen=True, slots=True)
class _Scan:
    """Result of one pass over the whole log."""

    topics: Mapping[UlogTopic, _TopicFacts]
    changes: tuple[tuple[float, str, float], ...]
    """Changes of correction parameters: time, s, name and value."""
    remarks: tuple[str, ...]


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of all IMUs, in each form in which they were logged."""
    return list_of(path, _imus(path), SOUGHT)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds an IMU; raises `LogError` where there is no such one, or several and none is named."""
    imus, magnetometers = _imus(path), _magnetometers(path)
    if options.need_imu or not magnetometers:
        list_of(path, imus, SOUGHT)
    return open_flight_imu(path, imus, imu, options, "ulog", opened(path).clock, magnetometers)


def parameters_in(path: Path) -> dict[str, float]:
    """Returns the parameters as they were when the log ended."""
    log = opened(path)
    return {**log.parameters, **{name: value for _, name, value in _scanned(path).changes}}


@once_per_file
def _scanned(path: Path) -> _Scan:
    log, damage = opened(path), Damage()
    topics: dict[UlogTopic, _TopicFacts] = {}
    changes: list[tuple[float, str, float]] = []

    def changed(time: int, name: str, value: float) -> None:
        if _CORRECTS.match(name) and len(changes) < MOST_CHANGES:
            changes.append((1e-6 * time, name, value))

    for block in log.blocks(TOPICS, damage, changed):
        for topic, records in block.items():
            _note(topics, topic, records)
    return _Scan(topics, tuple(changes), damage.notices())


def _note(topics: dict[UlogTopic, _TopicFacts], topic: UlogTopic, records: UlogRecords) -> None:
    names = records.dtype.names or ()
    time = _time(records)
    facts = topics.setdefault(topic, _TopicFacts(names=names))
    count = int(records["samples"].sum()) if _is_fifo(topic) and "samples" in names else len(records)
    facts.note(float(time[0]), float(time[-1]), count)
    for name in ("device_id", *_DEVICE.values()):
        if name in names:
            facts.devices.setdefault(name, set()).update(np.unique(records[name]).tolist())
    if "clip_counter" in names and not _is_fifo(topic):
        facts.clipped += int(records["clip_counter"].sum())


def _is_fifo(topic: UlogTopic) -> bool:
    return topic.name in FIFO.values()


def _time(records: UlogRecords) -> FloatArray:
    """Returns the (n,) s at which the sensor was read, where that is known."""
    names = records.dtype.names or ()
    name = next((each for each in ("timestamp_sample", "timestamp") if each in names), None)
    if name is None:
        return np.zeros(len(records))
    return doubles(records[name]) / 1e6


def _imus(path: Path) -> list[FlightImu]:
    log, scan = opened(path), _scanned(path)
    return [
        *_apart(log, scan, "sensor_fifo", FIFO, _unpacked, ("samples", "dt", "scale")),
        *_apart(log, scan, "sensor", SENSOR, _readings),
        *_together(log, scan, COMBINED, _combined),
        *_together(log, scan, DELTAS, _deltas),
        *_together(log, scan, STATUS, _means),
    ]


def _magnetometers(path: Path) -> list[FlightMagnetometer]:
    log, scan = opened(path), _scanned(path)
    topics = {
        topic: ulog_magnetometer.LoggedTopic(
            facts.rate, facts.names, _only(facts.devices.get("device_id", set()))
        )
        for topic, facts in scan.topics.items()
        if topic.name in (*ulog_magnetometer.TOPICS, COMBINED)
    }
    return ulog_magnetometer.magnetometers_of(log, topics, ())


def _apart(
    log: ULogFile,
    scan: _Scan,
    form: str,
    names: Mapping[Triad, str],
    decode: Callable[[Triad, UlogRecords], TriadSamples],
    fields: tuple[str, ...] = (),
) -> Iterator[FlightImu]:
    """Finds instances whose accelerometer and gyroscope were logged, with x, y, z and `fields`."""
    for instance in sorted({topic.instance for topic in scan.topics}):
        topics = {triad: UlogTopic(name, instance) for triad, name in names.items()}
        facts = {triad: scan.topics[topic] for triad, topic in topics.items() if topic in scan.topics}
        if len(facts) < len(TRIADS) or not all(_has(each, "x", "y", "z", *fields) for each in facts.values()):
            continue
        base = max(TRIADS, key=lambda triad: (facts[triad].rate, triad))
        devices = {triad: _only(each.devices.get("device_id", set())) for triad, each in facts.items()}
        slowest = min(each.rate for each in facts.values())
        if not slowest:
            continue
        yield FlightImu(
            name=f"{form}_{instance}",
            form=form,
            rate=slowest,
            count=facts[base].count,
            read=partial(_read_apart, log, topics, base, max(CLOSE, 1.0 / slowest), decode),
            already_corrected=form == "sensor" and not all(map(_stamps_sensors, facts.values())),
            serial=str(devices["accelerometer"] or devices["gyroscope"] or ""),
            corrections=partial(_corrections, log, scan, devices),
            has_temperature=any("temperature" in each.names for each in facts.values()),
            notices=(
                *_on_changes({triad: each.devices.get("device_id", set()) for triad, each in facts.items()}),
                *_notices_apart(form, facts, base, devices),
                *scan.remarks,
            ),
        )


def _has(facts: _TopicFacts, *names: str) -> bool:
    return all(name in facts.names for name in names)


def _stamps_sensors(facts: _TopicFacts) -> bool:
    return "timestamp_sample" in facts.names


def _only(devices: set[int]) -> int:
    """Returns the one device; 0 where it is not known, or changed."""
    return next(iter(devices)) if len(devices) == 1 else 0


def _on_changes(of_triads: Mapping[Triad, set[int]]) -> Iterator[str]:
    """Names triads that are those of several devices: what is found is true of none."""
    for triad, ids in of_triads.items():
        if len(ids) > 1:
            devices = join([str(each) for each in sorted(ids)])
            yield (
                f"the {triad} changes within the log, as its devices are {devices}: what is found is true of "
                "none of them; read a form with one device, or split the log where it changes"
            )


def _notices_apart(
    form: str, facts: Mapping[Triad, _TopicFacts], base: Triad, devices: Mapping[Triad, int]
) -> Iterator[str]:
    rates = {triad: each.rate for triad, each in facts.items()}
    if any(devices.values()):
        named = ", ".join(f"{triad} {device}" for triad, device in devices.items() if device)
        yield f"device ids: {named}"
    if min(rates.values()) < USABLE_RATE:
        yield (
            f"{' and '.join(SENSOR.values())} were logged at {min(rates.values()):.3g} Hz, too slow to pair "
            f"their readings in motion; {FASTER}"
        )
    elif max(rates.values()) > 1.2 * min(rates.values()):
        slow = next(triad for triad in TRIADS if triad != base)
        yield (
            f"{slow} was logged at {rates[slow]:.4g} Hz, {base} at {rates[base]:.4g} Hz: each reading of the "
            f"{slow} stands in several samples"
        )
    for triad, each in facts.items():
        if each.clipped:
            yield f"{triad}: PX4 counted {count_of('reading', each.clipped)} at the end of its range"


def _read_apart(
    log: ULogFile,
    topics: Mapping[Triad, UlogTopic],
    base: Triad,
    apart: float,
    decode: Callable[[Triad, UlogRecords], TriadSamples],
) -> Iterator[RawSamples]:
    def pieces() -> Iterator[TriadSamples]:
        for block in log.blocks([topic.name for topic in topics.values()], Damage()):
            for triad, topic in topics.items():
                if topic in block:
                    yield decode(triad, block[topic])

    return paired(pieces(), base, apart)


def _readings(triad: Triad, records: UlogRecords) -> TriadSamples:
    return TriadSamples(triad, _time(records), _axes(records), _temperature(records))


def _axes(records: UlogRecords) -> FloatArray:
    return np.stack([doubles(records[axis]) for axis in "xyz"], axis=-1)


def _temperature(records: UlogRecords) -> FloatArray | None:
    if "temperature" not in (records.dtype.names or ()):
        return None
    return doubles(records["temperature"])


def _unpacked(triad: Triad, records: UlogRecords) -> TriadSamples:
    """Splits batches: `samples` readings in units of `scale`, `dt` us apart, the last of them stamped."""
    most = records["x"].shape[1]
    number = np.arange(most)
    count = np.minimum(records["samples"].astype(np.int64), most)
    before = (count[:, np.newaxis] - 1 - number) * doubles(records["dt"])[:, np.newaxis] / 1e6
    valid = number < count[:, np.newaxis]
    time = (_time(records)[:, np.newaxis] - before)[valid]
    readings = (
        np.stack([records[axis][valid] for axis in "xyz"], axis=-1)
        * np.repeat(doubles(records["scale"]), count)[:, np.newaxis]
    )
    if "rotation" in (records.dtype.names or ()) and len(records):
        # Later firmware leaves it to the reader to turn a batch into the axes of the autopilot.
        turns = np.repeat(records["rotation"], count)
        for number in np.unique(turns):
            readings[turns == number] = readings[turns == number] @ _turned(int(number)).T
    temperature = _temperature(records)
    return TriadSamples(triad, time, readings, None if temperature is None else np.repeat(temperature, count))


def _turned(number: int) -> FloatArray:
    try:
        return rotation(number)
    except KeyError:
        raise LogError(f"a FIFO topic states rotation {number}, which is not known") from None


def _together(
    log: ULogFile, scan: _Scan, name: str, decode: Callable[[UlogRecords], RawSamples]
) -> Iterator[FlightImu]:
    """Finds the instances of a topic that holds both triads."""
    for topic, facts in sorted(scan.topics.items()):
        if topic.name != name or not _has(facts, *_FIELDS[name]):
            continue
        devices = _devices(log, scan, facts)
        warmth = None if "temperature_accel" in facts.names else _thermometer(scan, devices["accelerometer"])
        yield FlightImu(
            name=name if name == COMBINED else f"{name}_{topic.instance}",
            form=name,
            rate=facts.rate,
            count=facts.count,
            read=partial(_read_together, log, topic, decode, warmth),
            already_corrected=name != STATUS,
            serial=str(devices["accelerometer"] or ""),
            corrections=partial(_corrections, log, scan, devices),
            has_temperature="temperature_accel" in facts.names or warmth is not None,
            notices=(
                *_on_changes(_known_devices(scan, facts)),
                *_notices_together(facts),
                *scan.remarks,
            ),
        )


_FIELDS = {
    COMBINED: ("gyro_rad", "accelerometer_m_s2"),
    DELTAS: ("delta_angle", "delta_velocity"),
    STATUS: ("mean_accel", "mean_gyro"),
}


def _notices_together(facts: _TopicFacts) -> Iterator[str]:
    if facts.rate < USABLE_RATE:
        yield f"was logged at {facts.rate:.3g} Hz, too slow to follow motion; {FASTER}"


def _devices(log: ULogFile, scan: _Scan, facts: _TopicFacts) -> dict[Triad, int]:
    """Returns the devices a topic is about: its own, else those that PX4 had selected."""
    found: dict[Triad, int] = {}
    for triad, ids in _known_devices(scan, facts).items():
        primary = int(
            log.parameters.get("CAL_ACC_PRIME" if triad == "accelerometer" else "CAL_GYRO_PRIME", 0)
        )
        found[triad] = _only(ids) if ids else primary
    return found


def _known_devices(scan: _Scan, facts: _TopicFacts) -> dict[Triad, set[int]]:
    """Returns the ids that a topic states, else those that PX4 had selected."""
    selected = scan.topics.get(UlogTopic(SELECTION, 0))
    return {
        triad: facts.devices.get(name) or (selected.devices.get(name, set()) if selected else set())
        for triad, name in _DEVICE.items()
    }


def _thermometer(scan: _Scan, device: int) -> UlogTopic | None:
    """Finds the topic that holds the temperature of a device."""
    for topic, facts in scan.topics.items():
        is_of_device = _only(facts.devices.get("device_id", set())) == device != 0
        if topic.name in SENSOR.values() and _has(facts, "temperature") and is_of_device:
            return topic
    return None


def _read_together(
    log: ULogFile, topic: UlogTopic, decode: Callable[[UlogRecords], RawSamples], warmth: UlogTopic | None
) -> Iterator[RawSamples]:
    thermometer = Thermometer()
    for block in log.blocks([topic.name, *([warmth.name] if warmth else [])], Damage()):
        if warmth in block:
            thermometer.read(_time(block[warmth]), block[warmth]["temperature"])
        if topic not in block:
            continue
        samples = decode(block[topic])
        if warmth:
            samples.temperature = thermometer.at(_time(block[topic]))
        yield samples


def _combined(records: UlogRecords) -> RawSamples:
    force = doubles(records["accelerometer_m_s2"])
    if "accelerometer_timestamp_relative" in (records.dtype.names or ()):
        force[records["accelerometer_timestamp_relative"] == NO_ACCELEROMETER] = np.nan
    return RawSamples(_time(records), force, doubles(records["gyro_rad"]))


def _deltas(records: UlogRecords) -> RawSamples:
    """Divides what angle and velocity changed by through the time that took."""
    force, rate = (
        doubles(records[name]) / _interval(records, name)[:, np.newaxis]
        for name in ("delta_velocity", "delta_angle")
    )
    return RawSamples(_time(records), force, rate)


def _interval(records: UlogRecords, name: str) -> FloatArray:
    """Returns (n,) s; NaN where it is none."""
    stated = f"{name}_dt" if f"{name}_dt" in (records.dtype.names or ()) else "dt"
    if stated not in (records.dtype.names or ()):
        raise LogError(f"{DELTAS} has no field {name}_dt; read another form of this IMU")
    interval = doubles(records[stated]) / 1e6
    return np.where(interval > 0.0, interval, np.nan)


def _means(records: UlogRecords) -> RawSamples:
    temperature = None
    if "temperature_accel" in (records.dtype.names or ()):
        temperature = doubles(records["temperature_accel"])
    force, rate = (doubles(records[name]) for name in ("mean_accel", "mean_gyro"))
    return RawSamples(_time(records), force, rate, temperature)


def _corrects_as_now(log: ULogFile, scan: _Scan) -> bool:
    """Returns whether one library corrects all readings, as it does since drivers no longer do."""
    return log.release >= FIRST_RELEASE or any(map(_stamps_sensors, scan.topics.values()))


def _corrections(log: ULogFile, scan: _Scan, devices: Mapping[Triad, int]) -> dict[Triad, Corrections]:
    """Returns what PX4 did, by the parameters of the devices."""
    if not _corrects_as_now(log, scan):
        raise LogError(
            f"{log.path}: --undo-correction: is of PX4 before 1.11, whose drivers corrected as well; only "
            "later logs can be undone"
        )
    if unknown := [triad for triad in TRIADS if not devices[triad]]:
        raise LogError(
            f"{log.path}: --undo-correction: which device the {' and '.join(unknown)} was is not in the log, "
            f"or it changed; read {DELTAS}"
        )
    try:
        return {
            triad: over_time(
                log.parameters, scan.changes, partial(correction_of, triad=triad, device=devices[triad])
            )
            for triad in TRIADS
        }
    except CalibrationFileError as error:
        raise LogError(f"{log.path}: --undo-correction: {error.why}") from error
