"""Logs of ArduPilot: the IMUs as it flies by them, each reading (raw logging), and batches.

ArduPilot corrects readings before it logs them (AP_InertialSensor_Backend.cpp, `_rotate_and_correct_accel`);
those of IMU are low-pass filtered too. Only batches at the rate of the sensor are as the sensor gives them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from tumble.foundation.errors import CalibrationFileError, LogError
from tumble.foundation.files import once_per_file
from tumble.foundation.firmware import ardupilot
from tumble.foundation.firmware.correction import Corrections, over_time
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.foundation.units import TRIADS, Triad
from tumble.logs import dataflash_magnetometer
from tumble.logs.dataflash_file import MARK, PARAMETER, BinaryLog, DataflashRecords, TextLog
from tumble.logs.flight import FlightImu, Times, list_of, open_flight_imu
from tumble.logs.options import ReadOptions
from tumble.logs.pairing import CLOSE, Thermometer, TriadSamples, paired
from tumble.logs.track import LoggedImu, RawSamples
from tumble.logs.walk import Damage, doubles

IMU, BATCH, BATCH_DATA = "IMU", "ISBH", "ISBD"
RAW: Mapping[Triad, str] = {"accelerometer": "ACC", "gyroscope": "GYR"}
AXES: Mapping[Triad, tuple[str, str, str]] = {
    "accelerometer": ("AccX", "AccY", "AccZ"),
    "gyroscope": ("GyrX", "GyrY", "GyrZ"),
}
SOUGHT = "messages IMU, ACC and GYR, or ISBH and ISBD"
TEMPERATURES = ("T", "Temp")
BATCH_TRIADS: Mapping[int, Triad] = {0: "accelerometer", 1: "gyroscope"}
"""Triads by the type that a batch states."""
AT_SENSOR_RATE = 1
"""Bit of INS_LOG_BAT_OPT: batches are as the sensor gives them."""
MOST_PARAMETERS = 10_000
"""Names of parameters and changes of them that are kept; ArduPilot has some 1500."""
_MOST_WAITING = 64
"""Batches whose data have not come."""
_PLAIN = [IMU, *RAW.values()]
_NAMES = [*_PLAIN, *(f"{name}{number}" for name in _PLAIN for number in (1, 2, 3))]
_CORRECTS = re.compile("INS_(ACC|GYR|TCAL|LOG_BAT)|AHRS_ORIENTATION")

DataFlash: TypeAlias = BinaryLog | TextLog


@dataclass(frozen=True, slots=True, order=True)
class _Source:
    """Messages of one IMU: IMU, ACC, GYR, or batches of a triad."""

    kind: str
    instance: int


@dataclass(slots=True)
class _SourceFacts(Times):
    has_temperature: bool = False

    def note_each(self, time: FloatArray) -> None:
        """Counts samples, each with its time."""
        self.note(float(time[0]), float(time[-1]), len(time))


@dataclass(slots=True)
class _Scan:
    """Result of one pass over the whole log."""

    sources: dict[_Source, _SourceFacts] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    """First value of each parameter."""
    changes: list[tuple[float, str, float]] = field(default_factory=list)
    """Changes of correction parameters: time, s, name and value."""
    compasses: dict[int, Times] = field(default_factory=dict)
    """Magnetometers by their number."""
    remarks: tuple[str, ...] = ()


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of all IMUs, in each form in which they were logged."""
    return list_of(path, _imus(path), SOUGHT)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds an IMU; raises `LogError` where there is no such one, or several and none is named."""
    imus, scan = _imus(path), _scanned(path)
    compasses = dataflash_magnetometer.magnetometers_of(_opened(path), scan.compasses, scan.parameters, ())
    if options.need_imu or not compasses:
        list_of(path, imus, SOUGHT)
    clock = f"{path.resolve()}#time since start"
    return open_flight_imu(path, imus, imu, options, "dataflash", clock, compasses)


def parameters_in(path: Path) -> dict[str, float]:
    """Returns the parameters as they were when the log ended."""
    scan = _scanned(path)
    return {**scan.parameters, **{name: value for _, name, value in scan.changes}}


def _opened(path: Path) -> DataFlash:
    with open_regular(path) as file:
        return BinaryLog(path) if file.read(len(MARK)) == MARK else TextLog(path)


@once_per_file
def _scanned(path: Path) -> _Scan:
    damage, scan = Damage(), _Scan()
    batches = _Batches()
    names = [*_NAMES, BATCH, BATCH_DATA, PARAMETER, *dataflash_magnetometer.NAMES]
    for block in _opened(path).blocks(names, damage):
        for name, records in block.items():
            if name == PARAMETER:
                _note_parameters(scan, records)
        for source, records in _by_source(block):
            facts = scan.sources.setdefault(source, _SourceFacts())
            facts.note_each(_time(records))
            facts.has_temperature |= _temperature(records) is not None
        for instance, compass in dataflash_magnetometer.by_instance(block).items():
            time = dataflash_magnetometer.time_of(compass)
            scan.compasses.setdefault(instance, Times()).note(float(time[0]), float(time[-1]), len(time))
        for samples, source in batches.samples(block):
            scan.sources.setdefault(source, _SourceFacts()).note_each(samples.time)
    scan.remarks = damage.notices()
    return scan


def _note_parameters(scan: _Scan, records: DataflashRecords) -> None:
    names = records.dtype.names or ()
    if not {"Name", "Value"} <= set(names):
        return
    for time, name, value in zip(_time(records), records["Name"], records["Value"], strict=True):
        text = bytes(name).decode("ascii", "replace")
        if text not in scan.parameters:
            if len(scan.parameters) < MOST_PARAMETERS:
                scan.parameters[text] = float(value)
        elif _CORRECTS.match(text) and len(scan.changes) < MOST_PARAMETERS:
            scan.changes.append((float(time), text, float(value)))


def _time(records: DataflashRecords) -> FloatArray:
    """Returns (n,) s: when the sensor was read, else when it was logged."""
    names = records.dtype.names or ()
    for name, per_second in (("SampleUS", 1e6), ("TimeUS", 1e6), ("TimeMS", 1e3)):
        if name in names:
            return doubles(records[name]) / per_second
    return np.zeros(len(records))


def _temperature(records: DataflashRecords) -> FloatArray | None:
    for name in TEMPERATURES:
        if name in (records.dtype.names or ()):
            return doubles(records[name])
    return None


def _by_source(block: Mapping[str, DataflashRecords]) -> Iterator[tuple[_Source, DataflashRecords]]:
    """Splits messages by IMU: by field I, else, in older logs, by name, as IMU2."""
    for name, records in block.items():
        if name not in _NAMES or not len(records):
            continue
        kind = name.rstrip("123")
        if "I" in (records.dtype.names or ()):
            for instance in np.unique(records["I"]):
                yield _Source(kind, int(instance)), records[records["I"] == instance]
        else:
            yield _Source(kind, max(int(name[len(kind) :] or 1) - 1, 0)), records


def _imus(path: Path) -> list[FlightImu]:
    scan = _scanned(path)
    log = _opened(path)
    return [*_raw(log, scan), *_filtered(log, scan), *_batches(log, scan)]


def _axes(records: DataflashRecords, triad: Triad) -> FloatArray:
    names = AXES[triad]
    if not set(names) <= set(records.dtype.names or ()):
        return np.full((len(records), 3), np.nan)
    return np.stack([doubles(records[name]) for name in names], axis=-1)


def _serial(scan: _Scan, instance: int) -> str:
    number = instance + 1
    try:
        device = ardupilot.stored(scan.parameters, "accelerometer", number).device
    except CalibrationFileError:
        return ""
    return str(device or "")


def _filtered(log: DataFlash, scan: _Scan) -> Iterator[FlightImu]:
    for source, facts in sorted(scan.sources.items()):
        if source.kind == IMU and facts.rate:
            yield FlightImu(
                name=f"imu_{source.instance}",
                form="imu",
                rate=facts.rate,
                count=facts.count,
                read=partial(_read_filtered, log, source),
                already_corrected=True,
                serial=_serial(scan, source.instance),
                corrections=partial(_corrections, log.path, scan, source.instance, TRIADS),
                has_temperature=facts.has_temperature,
                notices=(
                    "low-pass filtered by ArduPilot: noise is lower than that of the sensor",
                    *scan.remarks,
                ),
            )


def _read_filtered(log: DataFlash, source: _Source) -> Iterator[RawSamples]:
    for block in log.blocks(_NAMES, Damage()):
        for found, records in _by_source(block):
            if found == source:
                force, rate = (_axes(records, triad) for triad in TRIADS)
                yield RawSamples(_time(records), force, rate, _temperature(records))


def _raw(log: DataFlash, scan: _Scan) -> Iterator[FlightImu]:
    instances = sorted({source.instance for source in scan.sources if source.kind in RAW.values()})
    for instance in instances:
        facts = {
            triad: found
            for triad, name in RAW.items()
            if (found := scan.sources.get(_Source(name, instance))) is not None and found.rate
        }
        if not facts:
            continue
        triads = tuple(facts)
        warmth = scan.sources.get(_Source(IMU, instance))
        has_temperature = warmth is not None and warmth.has_temperature
        slowest = min(each.rate for each in facts.values())
        base = max(triads, key=lambda triad: (facts[triad].rate, triad))
        yield FlightImu(
            name=f"raw_{instance}",
            form="raw",
            rate=slowest,
            count=facts[base].count,
            read=partial(_read_raw, log, instance, triads, base, max(CLOSE, 1.0 / slowest)),
            already_corrected=True,
            serial=_serial(scan, instance),
            triads=triads,
            corrections=partial(_corrections, log.path, scan, instance, triads),
            has_temperature=has_temperature,
            notices=scan.remarks,
        )


def _read_raw(
    log: DataFlash, instance: int, triads: tuple[Triad, ...], base: Triad, apart: float
) -> Iterator[RawSamples]:
    def pieces() -> Iterator[TriadSamples]:
        thermometer = Thermometer()
        for block in log.blocks(_NAMES, Damage()):
            found = {source.kind: each for source, each in _by_source(block) if source.instance == instance}
            if IMU in found and (degrees := _temperature(found[IMU])) is not None:
                thermometer.read(_time(found[IMU]), degrees)
            for triad in triads:
                if RAW[triad] in found:
                    records = found[RAW[triad]]
                    time = _time(records)
                    yield TriadSamples(triad, time, _axes(records, triad), thermometer.at(time))

    return paired(pieces(), base, apart) if len(triads) == len(TRIADS) else map(_alone, pieces())


def _alone(samples: TriadSamples) -> RawSamples:
    """Returns samples of one triad, NaN for the other."""
    unknown = np.full_like(samples.readings, np.nan)
    force, rate = (samples.readings if samples.triad == triad else unknown for triad in TRIADS)
    return RawSamples(samples.time, force, rate, samples.temperature)


class _Batches:
    """Batches that are being put together: a head, and the pieces of data that follow it."""

    def __init__(self) -> None:
        self._heads: dict[int, np.void] = {}

    def samples(self, block: Mapping[str, DataflashRecords]) -> Iterator[tuple[TriadSamples, _Source]]:
        """Returns the readings of the pieces in a block, in SI, by the multiplier and rate of their head."""
        for is_data, message in _in_order(*(_whole(block, *each) for each in _BATCH_COLUMNS.items())):
            number = int(message["N"])
            if is_data:
                head = self._heads.get(number)
                if head is not None and (found := _piece(head, message)) is not None:
                    yield found
                continue
            self._heads[number] = message
            if len(self._heads) > _MOST_WAITING:
                del self._heads[next(iter(self._heads))]


def _in_order(*kinds: DataflashRecords | None) -> Iterator[tuple[bool, np.void]]:
    """Returns heads, False, and data, True, as they were written: a number of a batch is given again."""
    written = [
        (float(message["TimeUS"]), kind, message)
        for kind, records in enumerate(kinds)
        if records is not None
        for message in records
    ]
    for _, kind, message in sorted(written, key=lambda each: each[:2]):
        yield bool(kind), message


_BATCH_COLUMNS = {
    BATCH: {"TimeUS", "N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate"},
    BATCH_DATA: {"TimeUS", "N", "seqno", "x", "y", "z"},
}


def _whole(block: Mapping[str, DataflashRecords], name: str, columns: set[str]) -> DataflashRecords | None:
    """Returns messages of that name if they have those columns."""
    records = block.get(name)
    return records if records is not None and columns <= set(records.dtype.names or ()) else None


def _piece(head: np.void, piece: np.void) -> tuple[TriadSamples, _Source] | None:
    triad = BATCH_TRIADS.get(int(head["type"]))
    rate, multiplier = float(head["smp_rate"]), float(head["mul"])
    readings = doubles(np.stack([piece[axis] for axis in "xyz"], axis=-1))
    first = int(piece["seqno"]) * len(readings)
    left = int(head["smp_cnt"]) - first
    if triad is None or not rate > 0.0 or not multiplier > 0.0 or left <= 0:
        return None
    time = float(head["SampleUS"]) / 1e6 + (first + np.arange(len(readings))) / rate
    source = _Source(f"batch_{triad}", int(head["instance"]))
    return TriadSamples(triad, time[:left], readings[:left] / multiplier), source


def _batches(log: DataFlash, scan: _Scan) -> Iterator[FlightImu]:
    option = scan.parameters.get("INS_LOG_BAT_OPT", 0.0)
    # One that was garbled means nothing.
    at_sensor_rate = math.isfinite(option) and bool(int(option) & AT_SENSOR_RATE)
    for source, facts in sorted(scan.sources.items()):
        triad = next((each for each in TRIADS if source.kind == f"batch_{each}"), None)
        if triad is not None:
            yield FlightImu(
                name=f"{source.kind}_{source.instance}",
                form="batch",
                rate=facts.rate,
                count=facts.count,
                read=partial(_read_batches, log, source),
                already_corrected=not at_sensor_rate,
                serial=_serial(scan, source.instance),
                triads=(triad,),
                corrections=partial(_corrections, log.path, scan, source.instance, (triad,)),
                notices=("batches of readings, with pauses between them", *scan.remarks),
            )


def _read_batches(log: DataFlash, source: _Source) -> Iterator[RawSamples]:
    batches = _Batches()
    for block in log.blocks([BATCH, BATCH_DATA], Damage()):
        found = [samples for samples, of in batches.samples(block) if of == source]
        if found:
            time = np.concatenate([each.time for each in found])
            yield _alone(TriadSamples(found[0].triad, time, np.vstack([each.readings for each in found])))


def _corrections(
    path: Path, scan: _Scan, instance: int, triads: tuple[Triad, ...]
) -> dict[Triad, Corrections]:
    """Returns what ArduPilot did, by its parameters."""
    if not scan.parameters:
        raise LogError(f"{path}: --undo-correction: the log holds no parameters (PARM)")
    number = instance + 1
    if number not in ardupilot.NUMBERS:
        raise LogError(f"{path}: --undo-correction: parameters of IMU {number} are not known")
    try:
        return {
            triad: over_time(
                scan.parameters, scan.changes, partial(ardupilot.correction_of, triad=triad, number=number)
            )
            for triad in triads
        }
    except CalibrationFileError as error:
        raise LogError(f"{path}: --undo-correction: {error.why}") from error
