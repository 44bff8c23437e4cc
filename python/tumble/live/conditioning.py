"""From what a device sends to what estimators may take: SI units, time that runs forwards, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FEW_SAMPLES, FloatArray
from tumble.foundation.words import count_of
from tumble.live.clock import ArrivalClock, CountingClock, DeviceClock, StampGate, without_absurd
from tumble.live.readings import Readings, StreamFacts, joined
from tumble.live.reordering import ReorderBuffer
from tumble.live.source import LiveChunk, PolledSource, Source, SourceChangedError, UnreadableSourceError
from tumble.logs.checks import clocks_clash
from tumble.logs.conversion import Conversion, case_from_log, conversion_for, notices_on_axes
from tumble.logs.magnetometer import field_scale
from tumble.logs.options import ReadOptions
from tumble.logs.read_as import ReadAs
from tumble.logs.track import RawSamples, StatedUnit
from tumble.logs.units import IMPOSSIBLE_RAD_PER_S, UNITS, Quantity

HEAD_SAMPLES = 20
"""Samples, best taken at rest, from which units are decided that nobody stated."""
MOST_WITHOUT_NUMBER = 50
"""Successive samples without a number beyond which the sensor, or how it is read, is at fault."""
IMPOSSIBLE_READING = 1e4, 1e3
"""m/s^2 and rad/s that no sensor on a robot reads."""
FASTEST_TO_REFUSE = 5
"""Successive samples too fast for rad/s; a single one was corrupted on the way."""
FEWEST_CLASHES = 10
"""Samples that share a stamp but not readings: fewer, right after the start, are no share of all yet."""
STRAY_STAMPS = 20.0
"""Times the usual distance of the first stamps from their median beyond which one is corrupt; even: 2."""
STRAY_READINGS = 1000.0
"""The same of the first readings, beyond which one does not show its unit."""

_ARRIVAL = "arrival"
_BEFORE = "it was read so before"
"""Reason of a unit of a source that was opened anew, or whose recording goes on."""

EMPTY = LiveChunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


class Conditioner:
    """Turns readings into chunks that are fit to use.

    Samples that may overtake each other on the way are put in order within `reorder_window` s; with 0 they
    are taken in the order in which they come.
    """

    def __init__(self, options: ReadOptions, reorder_window: float = 0.0) -> None:
        self.without_number = 0
        """Samples left out because the time or a channel is no finite number."""
        self.late = 0
        """Samples left out because they are no newer than the one before."""
        self._read = 0
        """Samples whose time and readings were looked at."""
        self._clashes = 0
        """Those of the late ones that share the stamp of the one before but not its readings."""
        self._latest: FloatArray = np.full(6, np.nan)
        """(6,) readings of the sample before."""
        self.impossible = 0
        """Samples left out because no sensor reads that, or no clock shows it."""
        self.cut_off = 0
        """Samples left out because they came together with the end of the source, behind it."""
        self.undecided = 0
        """Samples left out because the source was lost before they were enough to decide units from."""
        self.refusal: LogError | None = None
        """Error that `take` and `due` raise next: good samples had come before it."""
        self._before: tuple[Conversion, StreamFacts] | None = None
        """Units and statements by which the source was read before it was opened anew."""
        self._units_before: Mapping[str, str] = {}
        """Units by quantity in which an earlier process read the source, whose recording goes on."""
        self._options = options
        self._device_clock = DeviceClock()
        self._arrival_clock = ArrivalClock()
        self._counting_clock = CountingClock(options.rate) if options.rate is not None else None
        self._head: list[Readings] = []
        self._facts: StreamFacts | None = None
        self._conversion: Conversion | None = None
        self._from_field: FloatArray | None = None
        """(3, 3) from the axes and unit of a magnetometer to the case and uT."""
        self._gate = StampGate()
        self._order = ReorderBuffer(reorder_window) if reorder_window > 0.0 and options.rate is None else None
        self._without_number_in_succession = 0
        self._too_fast_in_succession = 0

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """Returns whether rad/s is a guess, which later readings may contradict."""
        return self._known is not None and self._known[0].gyroscope_unit.is_guessed_radians

    @property
    def stamped(self) -> bool:
        """Returns whether times are the device's own, as far as is known."""
        return self._known is None or self._known[0].time_unit.reason != _ARRIVAL

    @property
    def _known(self) -> tuple[Conversion, StreamFacts] | None:
        """Returns units and statements, of now or of before the source was opened anew; None before any."""
        if self._conversion is None or self._facts is None:
            return self._before
        return self._conversion, self._facts

    @property
    def is_decided(self) -> bool:
        """Returns whether samples were enough to decide units from."""
        return self._conversion is not None

    @property
    def units(self) -> Mapping[str, str]:
        """Returns units by quantity in which the recording is read, whether stated, shown or assumed."""
        if self._known is None:
            return self._units_before
        conversion, facts = self._known
        names = {
            "accelerometer": conversion.accelerometer_unit.name,
            "gyroscope": conversion.gyroscope_unit.name,
            "time": conversion.time_unit.name if self.stamped else "",
            "temperature": conversion.temperature_unit,
            "magnetometer": "" if facts.magnetometer_unit is None else facts.magnetometer_unit.name,
        }
        # Counts have no unit of the stream.
        return {quantity: name for quantity, name in names.items() if name in UNITS[cast(Quantity, quantity)]}

    @property
    def lasting_units(self) -> dict[str, str]:
        """Returns those of them that hold for a recording that goes on: what was assumed is assumed anew."""
        assumed = "gyroscope" if self.gyroscope_unit_is_assumed else None
        return {quantity: name for quantity, name in self.units.items() if quantity != assumed}

    def go_on_in(self, units: Mapping[str, str]) -> None:
        """Reads on in the units of a recording that goes on; another one that is stated is refused."""
        self._units_before = units

    @property
    def notices(self) -> tuple[str, ...]:
        """Yields notices on assumptions and on samples that were left out."""
        if self._known is None:
            return ()
        conversion, facts = self._known
        notices = [*facts.notices, *notices_on_axes(self._options)]
        units = (conversion.gyroscope_unit, conversion.time_unit)
        notices += [unit.doubt for unit in units if unit.doubt]
        if not self.stamped:
            notices.append(
                "samples carry no time, so that of their arrival is used: delays on the way count as motion"
            )
        if self.without_number:
            notices.append(f"left out {count_of('sample', self.without_number)} without a number")
        if self.impossible:
            notices.append(
                f"left out {count_of('sample', self.impossible)} that no sensor reads or no clock says"
            )
        if self._order is not None and self._order.sorted:
            notices.append(f"sorted {count_of('sample', self._order.sorted)} that others had overtaken")
        if self.late:
            notices.append(f"left out {count_of('sample', self.late)} that came twice or out of order")
        if self.cut_off:
            notices.append(
                f"left out {count_of('sample', self.cut_off)} that came after a restart, before the source "
                "was opened again"
            )
        if self.undecided:
            notices.append(
                f"left out {count_of('sample', self.undecided)}, too few to show their units, before the "
                "source was opened again"
            )
        return tuple(notices)

    def follow(self, previous: Conditioner) -> None:
        """Goes on with the units of the source that this one is the return of, and with its counts.

        A unit holds until another is stated, which is refused: none is guessed anew within a recording.
        """
        self.without_number, self.late = previous.without_number, previous.late
        self.impossible, self.cut_off = previous.impossible, previous.cut_off
        self.undecided = previous.undecided + sum(map(len, previous._head))
        self._read, self._clashes = previous._read, previous._clashes
        self._before, self._from_field = previous._known, previous._from_field
        self._units_before = previous._units_before
        if self._order is not None and previous._order is not None:
            self._order.sorted = previous._order.sorted

    def take(self, readings: Readings, facts: StreamFacts, arrival: float) -> LiveChunk:
        """Returns what can be used by now: nothing until there are samples enough to decide units from.

        `arrival` is when the readings came, s of `clock.now()`.

        Raises `LogError` where no unit fits or a stated one contradicts the values, where sample after sample
        is no number, and where the device started anew; `SourceChangedError` where it states another unit.
        Samples before the reason are returned, and the error is raised at the next call.
        """
        self._raise_refusal()
        self._refuse_other_units(facts, len(readings))
        chunk = self._taken(readings, facts, arrival)
        if not len(chunk):
            self._raise_refusal()
        return chunk

    def _raise_refusal(self) -> None:
        if self.refusal is not None:
            raise self.refusal

    def _refuse_other_units(self, facts: StreamFacts, count: int) -> None:
        """Raises `SourceChangedError` where a stream now states another unit than it was read in."""
        if self._known is not None and (facts is self._known[1] or facts == self._known[1]):
            return
        for quantity, name in self.units.items():
            stated: StatedUnit | None = getattr(facts, f"{quantity}_unit")
            by_user = getattr(self._options, f"{quantity}_unit", None) is not None
            if stated is None or by_user or stated.name == name:
                continue
            if quantity == "time" and self._counting_clock is not None:
                continue
            self.cut_off += count
            raise SourceChangedError(
                f"{facts.source}: the {quantity} was read in {name} so far, and is now stated in "
                f"{stated.name} ({stated.reason}): readings in another unit are another recording; start "
                "again"
            )
        if self._conversion is not None:
            self._facts = facts

    def _taken(self, readings: Readings, facts: StreamFacts, arrival: float) -> LiveChunk:
        samples = readings.samples
        samples.time = self._stamps(samples, arrival)
        magnetic = self._microtesla(readings.magnetic, facts)
        if self._conversion is not None:
            return self._ordered(Readings(self._conversion(samples), readings.moving, magnetic), arrival)
        self._head.append(Readings(_with_numbers(samples), readings.moving, magnetic))
        if sum(map(len, self._head)) < HEAD_SAMPLES:
            return EMPTY
        head, self._head = joined(self._head), []
        if facts.has_time or self._counting_clock is not None:
            head = self._without_stray_stamps(head)
        else:
            self._gate.believe_pauses()
        self._facts = facts
        self._conversion = self._decide(_without_stray_readings(head.samples), facts)
        return self._ordered(Readings(self._conversion(head.samples), head.moving, head.magnetic), arrival)

    def _microtesla(self, magnetic: FloatArray | None, facts: StreamFacts) -> FloatArray | None:
        """Returns readings of a magnetometer in uT and the case frame; rows of zeros hold none.

        It is there, without a reading, while all cells of its columns are empty.
        """
        if magnetic is None:
            return None
        if self._from_field is None:
            _, scale = field_scale(facts.source, facts.magnetometer_unit, self._options)
            self._from_field = case_from_log(self._options.axes) * scale
        empty = ~magnetic.any(axis=1)
        if empty.all():
            return None
        found: FloatArray = magnetic @ self._from_field.T
        found[empty] = np.nan
        return found

    def due(self) -> LiveChunk:
        """Returns samples that have waited long enough for others by now."""
        self._raise_refusal()
        return self._waiting_until(clock.now())

    def held(self) -> LiveChunk:
        """Returns all samples that wait for others: where a source ends, none comes any more."""
        return self._waiting_until(np.inf)

    def _waiting_until(self, now: float) -> LiveChunk:
        if self._order is None:
            return EMPTY
        readings, arrival = self._order.due(now)
        return self._checked(readings, arrival) if len(readings) else EMPTY

    def _ordered(self, readings: Readings, arrival: float) -> LiveChunk:
        if self._order is not None and self.stamped and len(readings):
            readings, arrival = self._order.push(readings, arrival)
        return self._checked(readings, arrival) if len(readings) else EMPTY

    def _stamps(self, samples: RawSamples, arrival: float) -> FloatArray:
        if self._counting_clock is not None:
            return self._counting_clock.stamp(len(samples))
        if samples.time is None:
            return self._arrival_clock.stamp(len(samples), arrival)
        return self._device_clock.stamp(samples.time)

    def _decide(self, head: RawSamples, facts: StreamFacts) -> Conversion:
        if self._before is not None:
            # Those of before hold, once the readings show no others.
            conversion_for(self._in_units_so_far(facts), self._options, head)
            return self._before[0]
        facts = self._in_units_so_far(facts)
        if facts.has_time or self._counting_clock is not None:
            return conversion_for(facts, self._options, head)
        arrived = replace(facts, time_unit=StatedUnit("s", _ARRIVAL))
        return conversion_for(arrived, replace(self._options, time_unit=None), head)

    def _in_units_so_far(self, facts: StreamFacts) -> StreamFacts:
        """Returns statements with the units of before where the stream states none."""
        unstated: dict[str, Any] = {
            f"{quantity}_unit": StatedUnit(name, _BEFORE)
            for quantity, name in self.units.items()
            if getattr(facts, f"{quantity}_unit") is None
        }
        return replace(facts, **unstated)

    def _checked(self, readings: Readings, arrival: float) -> LiveChunk:
        samples, moving, magnetic = readings.samples, readings.moving, readings.magnetic
        assert samples.time is not None, "every sample was stamped"
        self._read += len(samples)
        before, self._latest = self._latest, np.r_[samples.accelerometer[-1], samples.gyroscope[-1]]
        if not self._are_ordinary(samples.time, samples.accelerometer, samples.gyroscope):
            samples = _with_numbers(samples)
            kept = self._fit_to_use(samples, before)
            if not kept.any():
                return EMPTY
            readings = Readings(samples, moving, magnetic).part(kept)
            samples, moving, magnetic = readings.samples, readings.moving, readings.magnetic
        assert samples.time is not None, "every sample was stamped"
        return LiveChunk(
            samples.time,
            samples.accelerometer,
            samples.gyroscope,
            samples.temperature,
            moving,
            arrival,
            field=magnetic,
        )

    def _fit_to_use(self, samples: RawSamples, before: FloatArray) -> NDArray[np.bool_]:
        """Returns for each sample whether to keep it; counts the others.

        `before` (6,) are the readings of the sample before them.
        """
        assert samples.time is not None, "every sample was stamped"
        numbers = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope])
        finite: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(numbers), axis=1)
        self._count_without_number(finite)
        possible = finite & self._possible(samples.accelerometer, samples.gyroscope)
        newest_before = self._gate.newest
        # NaN would hide every later time from a running maximum.
        believed = self._gate.believed(np.where(possible, samples.time, np.nan))
        if self._gate.ran_back > 0.0:
            of_before = np.arange(len(believed)) < len(believed) - self._gate.left
            believed &= of_before
            finite &= of_before
            self.cut_off += self._gate.left
            self.refusal = self._restarted(self._gate.ran_back)
        self.impossible += int((finite & ~believed).sum())
        time = np.where(believed, samples.time, -np.inf)
        newest = np.maximum.accumulate(np.concatenate([[newest_before], time]))[:-1]
        late = believed & (time <= newest)
        self.late += int(late.sum())
        values = np.vstack([before, numbers[:, 1:]])
        self._clashes += int((late & (time == newest) & (values[1:] != values[:-1]).any(axis=1)).sum())
        self._refuse_coarse_clock()
        kept: NDArray[np.bool_] = believed & ~late
        return kept

    def _refuse_coarse_clock(self) -> None:
        """Has the source refused where too many samples share a stamp, as a log of it would be."""
        if self._clashes >= FEWEST_CLASHES and clocks_clash(self._clashes, self._read):
            self.refusal = UnreadableSourceError(
                f"{self._name}: {self._clashes} of {self._read} samples share the time stamp of the one "
                "before but not its readings: the clock of the device is too coarse; give the rate of its "
                "samples with --rate, or send finer stamps"
            )

    def _are_ordinary(self, time: FloatArray, accelerometer: FloatArray, gyroscope: FloatArray) -> bool:
        """Returns whether nothing is to be left out or counted, as is usual; a quick test of one sample."""
        fastest = IMPOSSIBLE_RAD_PER_S if self.gyroscope_unit_is_assumed else IMPOSSIBLE_READING[1]
        possible = _all_within(accelerometer, IMPOSSIBLE_READING[0]) and _all_within(gyroscope, fastest)
        if not (possible and self._gate.believes_all(time)):
            return False
        self._without_number_in_succession = self._too_fast_in_succession = 0
        return True

    def _without_stray_stamps(self, head: Readings) -> Readings:
        """Omits first samples whose stamp is nowhere near those of the others."""
        stamps = head.samples.time
        assert stamps is not None, "every sample was stamped"
        stray = _stray(stamps, STRAY_STAMPS)
        self.impossible += int(stray.sum())
        return head.part(~stray)

    def _possible(self, accelerometer: FloatArray, gyroscope: FloatArray) -> NDArray[np.bool_]:
        """Returns for each sample whether a sensor can measure it; raises `LogError` for a wrong unit."""
        strongest, fastest = (np.abs(triad).max(axis=1) for triad in (accelerometer, gyroscope))
        limits = IMPOSSIBLE_READING
        possible: NDArray[np.bool_] = (strongest <= limits[0]) & (fastest <= limits[1])
        if self.gyroscope_unit_is_assumed:
            too_fast = possible & (fastest > IMPOSSIBLE_RAD_PER_S)
            self._refuse_degrees(too_fast, fastest)
            possible &= ~too_fast
        return possible

    def _count_without_number(self, finite: NDArray[np.bool_]) -> None:
        self.without_number += int((~finite).sum())
        for good in finite:
            self._without_number_in_succession = 0 if good else self._without_number_in_succession + 1
            if self._without_number_in_succession >= MOST_WITHOUT_NUMBER:
                self.refusal = LogError(
                    f"{self._name}: {MOST_WITHOUT_NUMBER} samples in a row are not numbers; check the "
                    "sensor, and what the device sends against --columns"
                )

    def _restarted(self, ran_back: float) -> LogError:
        return LogError(
            f"{self._name}: time ran back by {ran_back:.6g} s to an earlier time: the device "
            "restarted, or two devices send at once; correct that and start again"
        )

    def _refuse_degrees(self, too_fast: NDArray[np.bool_], fastest: FloatArray) -> None:
        for fast, rate in zip(too_fast, fastest, strict=True):
            self._too_fast_in_succession = self._too_fast_in_succession + 1 if fast else 0
            if self._too_fast_in_succession >= FASTEST_TO_REFUSE:
                raise LogError(
                    f"{self._name}: gyroscope was assumed to be in rad/s, as no unit is stated, but reads "
                    f"{float(rate):.4g}; give --gyroscope-unit (deg/s?)"
                )

    @property
    def _name(self) -> str:
        return "" if self._facts is None else self._facts.source


class ConditionedSource(PolledSource):
    """A source whose readings a `Conditioner` makes fit to use."""

    def __init__(self, options: ReadOptions, reorder_window: float = 0.0) -> None:
        self._conditioner = Conditioner(options, reorder_window)

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """See `Source`."""
        return self._conditioner.gyroscope_unit_is_assumed

    @property
    def stamped(self) -> bool:
        """See `Source`."""
        return self._conditioner.stamped

    @property
    def read_as(self) -> ReadAs | None:
        """See `Source`."""
        return ReadAs(units=self._conditioner.lasting_units) if self._conditioner.is_decided else None

    def go_on_as(self, before: ReadAs) -> None:
        """See `Source`."""
        self._conditioner.go_on_in(before.units)

    def follow(self, previous: Source) -> None:
        """Reads on as the source was read that this one is the return of."""
        if isinstance(previous, ConditionedSource):
            self._conditioner.follow(previous._conditioner)


def _all_within(triad: FloatArray, limit: float) -> bool:
    """Returns whether all of (n, 3) readings are finite and within the limit, whatever their sign."""
    if len(triad) > FEW_SAMPLES:
        return bool(np.abs(triad).max() <= limit)
    for x, y, z in triad.tolist():
        if not (-limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit):
            return False
    return True


def _with_numbers(samples: RawSamples) -> RawSamples:
    return RawSamples(
        samples.time,
        without_absurd(samples.accelerometer),
        without_absurd(samples.gyroscope),
        None if samples.temperature is None else without_absurd(samples.temperature),
    )


def _without_stray_readings(samples: RawSamples) -> RawSamples:
    """Replaces readings of a triad that are far too large for a moment by NaN."""

    def usual(triad: FloatArray) -> FloatArray:
        return np.where(_stray(np.abs(triad).max(axis=1), STRAY_READINGS)[:, np.newaxis], np.nan, triad)

    return replace(samples, accelerometer=usual(samples.accelerometer), gyroscope=usual(samples.gyroscope))


def _stray(values: FloatArray, times: float) -> NDArray[np.bool_]:
    """Returns for each of (n,) values whether it is many usual distances from the median."""
    if not np.isfinite(values).any():
        return np.zeros(len(values), dtype=np.bool_)
    off = np.abs(values - np.nanmedian(values))
    usual = float(np.nanmedian(off))
    # Where most values are the same nothing is usual.
    stray: NDArray[np.bool_] = off > times * usual if usual > 0.0 else np.zeros(len(off), dtype=np.bool_)
    return stray
