"""From the numbers of a log to SI units and the case frame."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray, ResolvedUnit
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of
from tumble.logs.options import COUNTS, AxisValues, ReadOptions
from tumble.logs.stated_units import is_counts
from tumble.logs.track import WRITTEN, RawSamples, StatedUnit
from tumble.logs.triads import change_axes, gathered, largest_each, whole
from tumble.logs.unit_evidence import (
    IMU_RATE,
    MAGNETOMETER_RATE,
    RATE_UNITS,
    StillReadings,
    Usual,
    rest_in,
)
from tumble.logs.units import (
    LARGEST_READING,
    UNITS,
    Quantity,
    credible,
    find_unit,
    guess_accelerometer_unit,
    guess_gyroscope_unit,
    guess_range,
    guess_time_unit,
    in_celsius,
    is_gravity,
    is_imu_step,
    peak,
    possible_temperature,
    rate_unit_at_rest,
    rest_norm,
    smallest_norm,
    usual_step,
)

LIKE_GRAVITY = 0.03
"""Relative error of the length that an accelerometer reads at rest, bias and scale together.

By chance 1.5 % of gyroscopes have such a bias in deg/s; twice of it, 3 %.
"""
AS_NUMBERS = ResolvedUnit("counts", 1.0, "option: readings as they stand")
NOT_RECORDED = ResolvedUnit("none", 1.0, "not recorded")
_AXES = {"x": 0, "y": 1, "z": 2}


class Stating(Protocol):
    """Statements of a log or a live stream about itself: all that decides a conversion, besides values."""

    @property
    def source(self) -> str:
        """Argument by which a user names it."""

    @property
    def rate(self) -> float | None:
        """Samples per second, Hz, where it has no time of its own."""

    @property
    def accelerometer_unit(self) -> StatedUnit | None:
        """Unit of the accelerometer, where it is stated."""

    @property
    def gyroscope_unit(self) -> StatedUnit | None:
        """Unit of the gyroscope, where it is stated."""

    @property
    def time_unit(self) -> StatedUnit | None:
        """Unit of time, where it is stated."""

    @property
    def temperature_unit(self) -> StatedUnit | None:
        """Unit of temperature, where it is stated."""


@dataclass(frozen=True, slots=True)
class TriadConversion:
    """`case[i] = factor[i] (log[source[i]] - zero[source[i]])`."""

    source: tuple[int, int, int]
    zero: FloatArray
    """(3,) of the log's axes, in its unit."""
    factor: FloatArray
    """(3,) of the case axes, SI for one unit of the log; negative where an axis is turned round."""
    _shift: FloatArray | None = field(init=False)
    """(3,) of the case axes, to be taken off."""
    _stretch: FloatArray | None = field(init=False)

    def __post_init__(self) -> None:
        zero = self.zero[list(self.source)]
        object.__setattr__(self, "_shift", zero if zero.any() else None)
        object.__setattr__(self, "_stretch", self.factor if (self.factor != 1.0).any() else None)

    @property
    def changes_nothing(self) -> bool:
        """Returns whether the log's axes and unit are those of the case."""
        return self.source == (0, 1, 2) and self._shift is None and self._stretch is None

    def __call__(self, values: FloatArray) -> FloatArray:
        """Converts (n, 3) in place where no axis changes places."""
        if self.source != (0, 1, 2):
            values = gathered([values[:, axis] for axis in self.source])
        change_axes(values, self._shift, self._stretch)
        return values


@dataclass(frozen=True, slots=True)
class Conversion:
    """Everything between the numbers of one track and SI; a `Transform`."""

    accelerometer: TriadConversion
    gyroscope: TriadConversion
    time_scale: float
    temperature_unit: str
    accelerometer_unit: ResolvedUnit
    gyroscope_unit: ResolvedUnit
    time_unit: ResolvedUnit
    temperature_fault: str = ""
    """Reason why temperatures are left out; empty where they are read."""
    temperature_remark: str = ""
    _changes_nothing: bool = field(init=False)

    def __post_init__(self) -> None:
        scalars_stay = (self.time_scale, self.temperature_unit, self.temperature_fault) == (1.0, "degC", "")
        triads_stay = self.accelerometer.changes_nothing and self.gyroscope.changes_nothing
        object.__setattr__(self, "_changes_nothing", triads_stay and scalars_stay)

    def __call__(self, samples: RawSamples) -> RawSamples:
        """Converts samples that nobody else holds: arrays are changed in place."""
        if self._changes_nothing:
            return samples
        with np.errstate(over="ignore", invalid="ignore"):
            return self._converted(samples)

    def _converted(self, samples: RawSamples) -> RawSamples:
        time = samples.time
        if time is not None and self.time_scale != 1.0:
            # Division by 1e9 rounds once where multiplication by 1e-9 would round twice.
            time = time / round(1.0 / self.time_scale)
        temperature = None if self.temperature_fault else samples.temperature
        if temperature is not None and self.temperature_unit != "degC":
            temperature = in_celsius(temperature, self.temperature_unit)
        return RawSamples(
            time,
            self.accelerometer(samples.accelerometer),
            self.gyroscope(samples.gyroscope),
            temperature,
            samples.bad_lines,
            samples.received,
        )


def conversion_for(
    track: Stating,
    options: ReadOptions,
    head: RawSamples,
    triads: Collection[Triad] = TRIADS,
    samples: int | None = None,
    *,
    alone: bool = True,
) -> Conversion:
    """Decides the units of a track: what options state, else what the log states, else what its head shows.

    `triads` are those that are recorded, `samples` is their number, where it is known. A log that is not
    `alone` is one of several poses, over which whoever opens them judges the counts given.

    Raises `LogError` where options make no sense, no unit fits the values, two fit alike, or a stated unit
    contradicts them.
    """
    rotation = case_from_log(options.axes)
    if options.accelerometer_sign not in (1, -1):
        raise LogError(f"--accelerometer-sign {options.accelerometer_sign}: give 1 or -1")
    head = replace(
        head,
        accelerometer=_credible(track, "accelerometer", head.accelerometer, triads),
        gyroscope=_credible(track, "gyroscope", head.gyroscope, triads),
    )
    accelerometer_zero = _per_axis(options.accelerometer_zero, "--accelerometer-zero")
    gyroscope_zero = _per_axis(options.gyroscope_zero, "--gyroscope-zero")
    accelerometer_unit, accelerometer_scale = gyroscope_unit, gyroscope_scale = NOT_RECORDED, np.ones(3)
    if "accelerometer" in triads:
        accelerometer_unit, accelerometer_scale = _accelerometer(
            track, options, head, accelerometer_zero, alone=alone
        )
    time_unit = _time(track, options, head, triads, samples)
    if "gyroscope" in triads:
        rest = None
        if "accelerometer" in triads and options.channel is None and not options.as_numbers:
            interval = _interval(head, time_unit, options.rate or track.rate)
            force = (head.accelerometer - accelerometer_zero) * accelerometer_scale
            # Times that no IMU has show no rest.
            if is_imu_step(interval):
                rest = rest_in(force, head.gyroscope - gyroscope_zero, interval)
        alone_triad = "accelerometer" not in triads
        gyroscope_unit, gyroscope_scale = _gyroscope(
            track, options, head, gyroscope_zero, rest, alone=alone_triad
        )
    temperature_name, temperature_fault, temperature_remark = _temperature(track, options, head)
    return Conversion(
        _triad(rotation, accelerometer_zero, options.accelerometer_sign * accelerometer_scale),
        _triad(rotation, gyroscope_zero, gyroscope_scale),
        time_unit.scale,
        temperature_name,
        accelerometer_unit,
        gyroscope_unit,
        time_unit,
        temperature_fault,
        temperature_remark,
    )


def _credible(track: Stating, triad: Triad, readings: FloatArray, recorded: Collection[Triad]) -> FloatArray:
    """Returns only plausible readings, from which units are guessed."""
    if triad not in recorded or (len(readings) and _core.largest(readings) < LARGEST_READING):
        return readings
    numbers = whole(readings)
    if not numbers.any():
        raise LogError(
            f"{track.source}: {triad} holds no number in its first {len(readings)} samples; check its columns"
        )
    kept = credible(readings)
    if not np.isfinite(kept).any():
        smallest = float(largest_each(readings[numbers]).min())
        raise LogError(
            f"{track.source}: {triad} reads {smallest:.4g} and more in its first {len(readings)} samples, "
            "which no sensor says; check its columns"
        )
    return kept


def _triad(rotation: FloatArray, zero: FloatArray, scale: FloatArray) -> TriadConversion:
    x, y, z = (int(index) for index in np.abs(rotation).argmax(axis=1))
    return TriadConversion((x, y, z), zero, rotation @ scale)


def notices_on_axes(options: ReadOptions) -> tuple[str, ...]:
    """Describes the axes that the user changed."""
    notices = []
    if options.accelerometer_sign == -1:
        notices.append("sign of the accelerometer changed to read +g up")
    if options.axes.replace(" ", "") != "x,y,z":
        handed = ", which is assumed to be left-handed" if is_mirrored(options.axes) else ""
        notices.append(f"case axes x, y, z are {options.axes} of the log{handed}")
    return tuple(notices)


def is_mirrored(axes: str) -> bool:
    """Returns whether these axes make a left-handed log right-handed; raises `LogError` for invalid axes."""
    return float(np.linalg.det(case_from_log(axes))) < 0.0


def case_from_log(axes: str) -> FloatArray:
    """Reads `y,-x,z` as a (3, 3) matrix from the log's axes to those of the case."""
    matrix = np.zeros((3, 3))
    words = [word.strip().lower() for word in axes.split(",")]
    for row, word in enumerate(words[:3]):
        letter = word.lstrip("+-")
        if letter in _AXES:
            matrix[row, _AXES[letter]] = -1.0 if word.startswith("-") else 1.0
    if len(words) != 3 or abs(float(np.linalg.det(matrix))) != 1.0:
        raise LogError(f"--axes {axes}: needs each of x, y and z once, with or without a sign, as y,-x,z")
    return matrix


def _per_axis(value: AxisValues, name: str) -> FloatArray:
    numbers = list(value) if isinstance(value, Sequence) else [value] * 3
    if len(numbers) != 3 or not all(np.isfinite(numbers)):
        raise LogError(f"{name} {value}: give one number, or three for x, y and z")
    return np.array(numbers, dtype=np.float64)


def counts_per_axis(value: AxisValues, name: str) -> FloatArray:
    """Returns the counts per unit of (3,) axes; raises `LogError` where they are none."""
    scale = _per_axis(value, name)
    if (scale == 0.0).any():
        raise LogError(f"{name} {value}: counts per unit cannot be zero")
    return scale


def stated_unit(
    source: str,
    quantity: Quantity,
    found: StatedUnit | None,
    option: str | None,
    scale: AxisValues | None = None,
) -> StatedUnit | None:
    """Returns the statement of the user, else that of the log; None where neither states a unit.

    Raises `LogError` where the user names no unit of that quantity, columns of the log state several, or one
    states a unit that is unknown and the user gives neither a unit nor a `scale`.
    """
    if option is None:
        if found is not None and found.unknown:
            if scale is None:
                raise LogError(f"{source}: {unknown_said(quantity, found)}")
            return None
        if found is not None and found.others:
            units = ", ".join((found.name, *found.others))
            raise LogError(
                f"{source}: columns of one sensor, the {quantity}, are in several units: {units}; convert "
                f"them to one, or state that of all with --{quantity}-unit"
            )
        return found
    name = find_unit(option, quantity)
    if name is None:
        known = ", ".join(UNITS[quantity])
        raise LogError(f"--{quantity}-unit {option}: not a unit of {quantity}; known: {known}")
    said = (found.name or found.unknown) if found else name
    return StatedUnit(name, "option" if said == name else f"option, log says {said}")


def unknown_said(quantity: Quantity, found: StatedUnit) -> str:
    """Names the column and the text that state an unknown unit, and the options that state a known one."""
    known = ", ".join(UNITS[quantity])
    unit = f"--{quantity}-unit ({known})"
    scale = f"--{quantity}-scale (counts per unit)"
    if quantity == "temperature":
        remedy = f"it is not used; state {unit}, or convert the column"
    elif quantity == "time":
        remedy = f"state {unit} or --rate, or convert the column"
    elif is_counts(found.unknown):
        remedy = f"give {scale} and {unit}"
    else:
        remedy = f"state {unit}, or {scale}"
    return f"column {found.column} states {found.unknown}, which is no known unit of {quantity}: {remedy}"


def _unit(quantity: Quantity, stated: StatedUnit) -> tuple[ResolvedUnit, FloatArray]:
    """Returns the unit and its SI value for each of (3,) axes."""
    value = UNITS[quantity][stated.name]
    return ResolvedUnit(stated.name, value, stated.reason), np.full(3, value)


def _with_counts(
    quantity: Quantity, stated: StatedUnit | None, counts: AxisValues
) -> tuple[ResolvedUnit, FloatArray]:
    """Returns the unit and the (3,) SI value of one count."""
    unit_name = stated.name if stated else next(iter(UNITS[quantity]))
    scale = UNITS[quantity][unit_name] / counts_per_axis(counts, f"--{quantity}-scale")
    unit = ResolvedUnit("counts", float(scale.mean()), f"option: counts per {unit_name}", per=unit_name)
    return unit, scale


def _accelerometer(
    track: Stating, options: ReadOptions, head: RawSamples, zero: FloatArray, *, alone: bool
) -> tuple[ResolvedUnit, FloatArray]:
    if options.as_numbers and options.channel is None and options.accelerometer_unit is None:
        return AS_NUMBERS, np.ones(3)
    stated = stated_unit(
        track.source,
        "accelerometer",
        track.accelerometer_unit,
        options.accelerometer_unit,
        options.accelerometer_scale,
    )
    if options.channel is not None:
        return _of_one_axis(track, "accelerometer", stated, options.accelerometer_scale)
    if options.as_numbers:
        return AS_NUMBERS, np.ones(3)
    readings = head.accelerometer - zero if zero.any() else head.accelerometer
    if options.accelerometer_scale is not None:
        unit, scale = _with_counts("accelerometer", stated, options.accelerometer_scale)
        if alone:
            check_counts(track.source, rest_norm(readings * scale))
        return unit, scale
    norm = rest_norm(readings)
    likely = guess_accelerometer_unit(norm)
    if stated is None:
        if likely is None:
            raise LogError(_no_accelerometer_unit(track, head, norm))
        stated = StatedUnit(likely, f"norm at rest is {norm:.4g}")
    elif likely is not None and not is_gravity(norm, stated.name):
        raise LogError(
            f"{track.source}: accelerometer is stated in {stated.name} ({stated.reason}) but reads "
            f"{norm:.4g} at rest, as it would in {likely}; read it with --accelerometer-unit {likely}"
        )
    if stated.reason == WRITTEN:
        stated = StatedUnit(stated.name, f"{WRITTEN}; norm at rest is {norm:.4g}")
    return _unit("accelerometer", stated)


def _of_one_axis(
    track: Stating, triad: Triad, stated: StatedUnit | None, counts: AxisValues | None
) -> tuple[ResolvedUnit, FloatArray]:
    """Returns the unit of a single-axis sensor, whose values show none: one axis has no norm at rest."""
    if counts is not None:
        return _with_counts(triad, stated, counts)
    if stated is None:
        raise LogError(
            f"{track.source}: one axis does not show its unit; give --{triad}-unit, as --{triad}-unit "
            f"{next(iter(UNITS[triad]))}"
        )
    return _unit(triad, stated)


def check_counts(source: str, norm: float) -> None:
    """Half or twice gravity is no scale error that a sensor has, but one that a user makes."""
    if not 0.5 < norm / STANDARD_GRAVITY < 2.0:
        raise LogError(
            f"{source}: accelerometer reads {norm:.4g} m/s^2 at rest with the scale "
            "given, not about 9.8; check --accelerometer-scale (counts per unit), --accelerometer-unit "
            "and --accelerometer-zero"
        )


def _no_accelerometer_unit(track: Stating, head: RawSamples, norm: float) -> str:
    if not np.nan_to_num(head.accelerometer).any():
        return f"{track.source}: accelerometer reads 0 in its first {len(head)} samples: it is dead"
    read = f"{track.source}: accelerometer reads {norm:.6g} at rest, which is neither m/s^2, g nor mg"
    if span := guess_range(norm):
        return (
            f"{read}: it looks like raw counts of 16 bits, {COUNTS / span:.0f} a g, of a range of "
            f"± {span:.0f} g; give --counts {span:.0f},250 where "
            "that of the gyroscope is ± 250 deg/s (or 500, 1000, 2000), "
            "else --accelerometer-scale (counts per unit) and --accelerometer-unit"
        )
    return (
        f"{read}; for raw counts give --accelerometer-scale (counts per unit) and --accelerometer-unit, else "
        "the unit"
    )


def _temperature(track: Stating, options: ReadOptions, head: RawSamples) -> tuple[str, str, str]:
    """Returns the unit of temperatures, why they are left out, and a remark; both are empty as a rule."""
    values, found = head.temperature, track.temperature_unit
    if found is not None and found.unknown and options.temperature_unit is None:
        return "degC", "" if values is None else unknown_said("temperature", found), ""
    stated = stated_unit(track.source, "temperature", found, options.temperature_unit)
    name = stated.name if stated else "degC"
    if values is None or options.temperature_unit is not None or possible_temperature(values, name):
        return name, "", ""
    seen = f"temperature reads {np.nanmin(values):.6g} to {np.nanmax(values):.6g}"
    if stated is None and possible_temperature(values, "K"):
        return "K", "", f"{seen}, which is none of an IMU in degC: it is read in K"
    said = f"{stated.name}, which the log states" if stated else "degC or K"
    return (
        name,
        (
            f"{seen} in its first {count_of('sample', len(head))}, which is none of an IMU in {said}: it "
            "is not used; state its unit with --temperature-unit, or convert counts of a register to degC"
        ),
        "",
    )


def _interval(head: RawSamples, unit: ResolvedUnit, rate: float | None) -> float:
    """Returns the usual time between samples, s; NaN where nothing shows it."""
    if head.time is not None:
        return usual_step(head.time) * unit.scale
    return 1.0 / rate if rate else math.nan


def _gyroscope(
    track: Stating,
    options: ReadOptions,
    head: RawSamples,
    zero: FloatArray,
    rest: StillReadings | None,
    *,
    alone: bool,
) -> tuple[ResolvedUnit, FloatArray]:
    """Returns unit and scale of a gyroscope; `alone` is true where no accelerometer was recorded with it."""
    if options.as_numbers and options.channel is None and options.gyroscope_unit is None:
        return AS_NUMBERS, np.ones(3)
    stated = stated_unit(
        track.source, "gyroscope", track.gyroscope_unit, options.gyroscope_unit, options.gyroscope_scale
    )
    if options.channel is not None:
        return _of_one_axis(track, "gyroscope", stated, options.gyroscope_scale)
    if options.as_numbers:
        return AS_NUMBERS, np.ones(3)
    if options.gyroscope_scale is not None:
        return _with_counts("gyroscope", stated, options.gyroscope_scale)
    readings = head.gyroscope - zero if zero.any() else head.gyroscope
    fastest = peak(readings)
    if stated is None:
        smallest = smallest_norm(readings)
        likely, reason = guess_gyroscope_unit(smallest, fastest, rest)
        if likely is None:
            raise LogError(
                f"{track.source}: gyroscope reads {smallest:.6g} to {fastest:.6g}, "
                "which is neither rad/s nor deg/s; for raw counts give --gyroscope-scale (counts per unit) "
                "and --gyroscope-unit, else the unit"
            )
        unit, scale = _unit("gyroscope", StatedUnit(likely, reason))
        doubt = _assumed_rate(unit.name) if unit.is_assumed else ""
        return replace(unit, doubt=(_as_gravity(readings) if alone else "") or doubt), scale
    if rest is not None and (likely := rate_unit_at_rest(rest)) is not None and stated.name in RATE_UNITS:
        _refuse_contradicted_rate(track, stated, likely, rest)
    return _unit("gyroscope", stated)


def _as_gravity(readings: FloatArray) -> str:
    """Returns a doubt where readings (n, 3) of a gyroscope have the length of gravity, and always that."""
    lengths = rest_norm(readings), smallest_norm(readings)
    for unit in ("m/s^2", "g"):
        gravity = STANDARD_GRAVITY / UNITS["accelerometer"][unit]
        if all(abs(length - gravity) < LIKE_GRAVITY * gravity for length in lengths):
            return (
                f"the gyroscope reads {lengths[0]:.4g} all the time, the length of gravity in {unit}, and no "
                "accelerometer is recorded: if it is one, name its columns, as --columns ax=gx,ay=gy,az=gz"
            )
    return ""


def _assumed_rate(unit: str) -> str:
    return (
        f"the gyroscope is assumed to be in {unit}: neither the log nor its readings show a unit; state it "
        "with --gyroscope-unit"
    )


def _refuse_contradicted_rate(track: Stating, stated: StatedUnit, likely: str, rest: StillReadings) -> None:
    """Raises `LogError` where the log states one unit and its readings at rest show another.

    A unit that the user states is taken all the same.
    """
    if stated.name == likely or stated.reason.startswith("option"):
        return
    raise LogError(
        f"{track.source}: gyroscope is stated in {stated.name} ({stated.reason}) but reads {rest.rate:.4g} "
        f"across gravity while it stands still, with a noise of {rest.noise:.2g} per sqrt(Hz), as it would "
        f"in {likely}; read it with --gyroscope-unit {likely}"
    )


def _time(
    track: Stating, options: ReadOptions, head: RawSamples, triads: Collection[Triad], samples: int | None
) -> ResolvedUnit:
    rate = options.rate or track.rate
    if options.rate is not None or head.time is None:
        stated_unit(track.source, "time", None, options.time_unit)
        return ResolvedUnit("s", 1.0, f"sample number over {rate:g} Hz" if rate else "sample number")
    stated = stated_unit(track.source, "time", track.time_unit, options.time_unit)
    if stated is None:
        return _guessed_time(track, head.time, IMU_RATE if triads else MAGNETOMETER_RATE, samples)
    return ResolvedUnit(stated.name, UNITS["time"][stated.name], stated.reason)


def _guessed_time(track: Stating, time: FloatArray, rates: Usual, samples: int | None) -> ResolvedUnit:
    """Returns the unit that is likeliest; raises `LogError` where another one is as likely."""
    guess, step = guess_time_unit(time, rates, samples), usual_step(time)
    units = UNITS["time"]
    rate = f"{1.0 / (step * units[guess.name]):.4g} Hz in {guess.name}"
    others = " and ".join(f"{1.0 / (step * units[other]):.4g} Hz in {other}" for other in guess.others)
    if guess.is_open:
        raise LogError(
            f"{track.source}: time has no unit and advances by {step:.6g} a sample, which is {rate} or "
            f"{others}; state its unit with --time-unit"
        )
    doubt = (
        f"time is assumed to be in {guess.name}: {rate}, where it would be {others}; state it with "
        "--time-unit"
        if guess.others
        else ""
    )
    return ResolvedUnit(guess.name, units[guess.name], guess.reason, doubt)


def without_time(samples: RawSamples) -> RawSamples:
    """Drops the time of a log whose time is not to be used."""
    return replace(samples, time=None)
