"""Units as people write them, and the evidence of the values themselves for their unit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.log_time import DATES
from tumble.foundation.recording import ASSUMED, AT_REST, FloatArray
from tumble.foundation.unit_values import UNIT_VALUES
from tumble.logs.options import COUNTS
from tumble.logs.triads import largest_each, whole_ones
from tumble.logs.unit_evidence import (
    ASKED,
    CERTAIN,
    COUNTED_IN_FRACTIONS,
    IMU_RATE,
    RATE_UNITS,
    StillReadings,
    Usual,
    log_likelihood_of_rate_unit,
    log_likelihood_of_step,
    ordered,
)

Quantity: TypeAlias = Literal["accelerometer", "gyroscope", "time", "temperature", "magnetometer"]

UNITS: Mapping[Quantity, Mapping[str, float]] = {
    "accelerometer": UNIT_VALUES["accelerometer"],
    "gyroscope": UNIT_VALUES["gyroscope"],
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "temperature": {"degC": 1.0, "K": 1.0, "degF": 1.0 / 1.8},
    "magnetometer": UNIT_VALUES["magnetometer"],
}
"""SI value of one unit (of a difference, for temperature); microtesla for a magnetometer."""

SHOWN_AT_REST = ("m/s^2", "g", "mg")
"""Units that a resting accelerometer shows: cm/s^2, in which it reads nearly as in mg, has to be stated."""

TEMPERATURE_ZERO: Mapping[str, float] = {"degC": 0.0, "K": 273.15, "degF": 32.0}
"""Reading of each unit at 0 degC."""

POSSIBLE_TEMPERATURE = (-80.0, 200.0)
"""degC: data sheets of IMUs end at -55 and 175 degC."""

SPELLINGS: Mapping[Quantity, Mapping[str, str]] = {
    "accelerometer": {
        "m/s^2": "m/s^2",
        "m/s2": "m/s^2",
        "m/s/s": "m/s^2",
        "m/sec^2": "m/s^2",
        "m_s2": "m/s^2",
        "m_s_2": "m/s^2",
        "m_s^2": "m/s^2",
        "m_per_s2": "m/s^2",
        "ms2": "m/s^2",
        "ms-2": "m/s^2",
        "m*s^-2": "m/s^2",
        "ms^-2": "m/s^2",
        "m.s-2": "m/s^2",
        "mps2": "m/s^2",
        "mpss": "m/s^2",
        "mss": "m/s^2",
        "g": "g",
        "gs": "g",
        "g0": "g",
        "gee": "g",
        "mg": "mg",
        "milli_g": "mg",
        "cm/s^2": "cm/s^2",
        "cm/s2": "cm/s^2",
        "cm_s2": "cm/s^2",
        "cm_s^2": "cm/s^2",
        "gal": "cm/s^2",
    },
    "gyroscope": {
        "rad/s": "rad/s",
        "rad": "rad/s",
        "rad/sec": "rad/s",
        "rad_s": "rad/s",
        "rad_per_s": "rad/s",
        "rads": "rad/s",
        "radps": "rad/s",
        "rad*s^-1": "rad/s",
        "rads^-1": "rad/s",
        "rps": "rad/s",
        "deg/s": "deg/s",
        "deg/sec": "deg/s",
        "deg_s": "deg/s",
        "deg_per_s": "deg/s",
        "degs": "deg/s",
        "degps": "deg/s",
        "dps": "deg/s",
        "°/s": "deg/s",
        "mrad/s": "mrad/s",
        "mrad_s": "mrad/s",
        "mdeg/s": "mdeg/s",
        "mdeg_s": "mdeg/s",
        "mdps": "mdeg/s",
        "rpm": "rpm",
        "r/min": "rpm",
        "rev/min": "rpm",
    },
    "time": {
        "s": "s",
        "sec": "s",
        "secs": "s",
        "second": "s",
        "seconds": "s",
        "ms": "ms",
        "msec": "ms",
        "millis": "ms",
        "milliseconds": "ms",
        "us": "us",
        "usec": "us",
        "micros": "us",
        "microseconds": "us",
        "ns": "ns",
        "nsec": "ns",
        "nanos": "ns",
        "nanosec": "ns",
        "nanoseconds": "ns",
    },
    "temperature": {
        "degc": "degC",
        "deg_c": "degC",
        "c": "degC",
        "°c": "degC",
        "celsius": "degC",
        "k": "K",
        "kelvin": "K",
        "degf": "degF",
        "deg_f": "degF",
        "f": "degF",
        "°f": "degF",
        "fahrenheit": "degF",
    },
    "magnetometer": {
        "ut": "uT",
        "microtesla": "uT",
        "microt": "uT",
        "nt": "nT",
        "nanotesla": "nT",
        "t": "T",
        "tesla": "T",
        "gauss": "G",
        "gs": "G",
        "ga": "G",
        "g": "G",
        "mgauss": "mG",
        "milligauss": "mG",
        "mga": "mG",
        "mg": "mG",
    },
}

IN_WORDS: Mapping[Quantity, Mapping[str, str]] = {
    "accelerometer": {
        **dict.fromkeys(("m/(s^2)", "m/sec/sec", "m/second^2", "m.s^-2", "m*s-2", "m/s/s", "ms^2"), "m/s^2"),
        **dict.fromkeys(("meter/s^2", "meters/s^2", "metre/s^2", "metres/s^2"), "m/s^2"),
        **dict.fromkeys(("meter/second^2", "meters/second^2", "meters/sec^2", "mpersecsquared"), "m/s^2"),
        **dict.fromkeys(("g's", "gees", "gn", "g_n", "gravity", "gravities", "standardgravity"), "g"),
        **dict.fromkeys(("millig", "milli-g", "mgs", "mgee"), "mg"),
        **dict.fromkeys(("cm/s/s", "cm/sec^2", "cms2", "cms-2", "cms^-2", "cm/(s^2)", "gals"), "cm/s^2"),
    },
    "gyroscope": {
        **dict.fromkeys(("rad/second", "radian/s", "radians/s", "radian/sec", "radians/sec"), "rad/s"),
        **dict.fromkeys(("radian/second", "radians/second", "radianpersecond", "radianspersecond"), "rad/s"),
        **dict.fromkeys(("rads-1", "rad*s-1", "rad.s-1", "rad.s^-1", "radians-1", "radianss-1"), "rad/s"),
        **dict.fromkeys(("deg/second", "degree/s", "degrees/s", "degree/sec", "degrees/sec"), "deg/s"),
        **dict.fromkeys(("degree/second", "degrees/second", "degreepersecond", "degreespersecond"), "deg/s"),
        **dict.fromkeys(("degs-1", "degs^-1", "deg*s-1", "deg*s^-1", "deg.s-1", "deg.s^-1"), "deg/s"),
        **dict.fromkeys(("degrees-1", "degreess-1", "degreess^-1"), "deg/s"),
        **dict.fromkeys(("°s-1", "°s^-1", "°/sec", "°/second", "°ps"), "deg/s"),
        **dict.fromkeys(("mrad/sec", "mrads-1", "mrads^-1"), "mrad/s"),
        **dict.fromkeys(("mdeg/sec", "m°/s", "mdegs-1", "mdegs^-1"), "mdeg/s"),
    },
    "time": {
        **dict.fromkeys(("msecs", "millisec", "millisecs", "millisecond"), "ms"),
        **dict.fromkeys(("usecs", "microsec", "microsecs", "microsecond"), "us"),
        **dict.fromkeys(("nsecs", "nanosecs", "nanosecond"), "ns"),
    },
    "temperature": {
        **dict.fromkeys(("degreec", "degreesc", "deg.c", "degcelsius", "degreecelsius"), "degC"),
        **dict.fromkeys(("degreescelsius", "°celsius", "centigrade", "degcentigrade", "°"), "degC"),
        **dict.fromkeys(("kelvins", "degk", "°k"), "K"),
        **dict.fromkeys(("degreef", "degreesf", "deg.f", "degfahrenheit", "degreefahrenheit"), "degF"),
        **dict.fromkeys(("degreesfahrenheit", "°fahrenheit"), "degF"),
    },
    "magnetometer": {
        **dict.fromkeys(("microteslas", "micro-tesla"), "uT"),
        **dict.fromkeys(("nanoteslas", "nano-tesla"), "nT"),
        "teslas": "T",
        "milli-gauss": "mG",
    },
}
"""Spellings that stand in brackets and in attributes, but in no name of a column."""
SIGNS: Mapping[str, str] = {
    "⁻²": "^-2",
    "⁻¹": "^-1",
    "²": "^2",
    "**": "^",
    "µ": "u",
    "μ": "u",
    "º": "°",
    "˚": "°",
    "℃": "°c",
    "℉": "°f",
    "·": "",
    "⋅": "",
}
"""Signs for which a spelling has others, in this order."""
SINCE = " since "
"""Word before the moment from which a unit of time counts, as conventions of climate data write it."""

SLOWEST_HZ, FASTEST_HZ = 0.5, 50_000.0
"""Rates at which IMUs sample; a time with another rate is in another unit, or no time."""

_SURROUNDING = 0.15
"""Smallest ratio of the singular values of directions that surround a centre; six faces have 0.87."""
_BURSTS_WITHIN = 128
"""Samples that hold several bursts, or a whole one."""
_IN_BURST = 0.1
"""Share of the mean step: successive stamps closer than that belong to one burst."""
_WINDOW = 32
_SAMPLES_PER_SPIKE, _FEW_SAMPLES = 1000, 20
IMPOSSIBLE_RAD_PER_S = 40.0
"""Faster than any IMU at work turns."""
LARGEST_READING = 1e12
"""Larger than any reading, counts of 32 bits included."""
LARGEST_SI = 1e6
"""m/s^2 or rad/s: beyond the range of any sensor; what reads more is a garbled line."""
LARGEST_TIME = 1e11
"""s, three thousand years."""
_RANGES_G = (2.0, 4.0, 8.0, 16.0, 32.0)
"""Usual ranges of accelerometers."""
_IMPOSSIBLE_DEG_PER_S = 4500.0
_LARGEST_BIAS_DEG_PER_S = 100.0


def find_unit(text: str, quantity: Quantity) -> str | None:
    """Returns the unit a piece of text names, in our spelling, or None if it names none of that quantity."""
    plain = " ".join(text.lower().split())
    for sign, other in SIGNS.items():
        plain = plain.replace(sign, other)
    if quantity == "time":
        plain = plain.partition(SINCE)[0]
    plain = plain.replace(" ", "")
    return SPELLINGS[quantity].get(plain) or IN_WORDS[quantity].get(plain)


def credible(readings: FloatArray) -> FloatArray:
    """Returns (n, 3) readings, those larger than any sensor's in any unit as NaN."""
    large = ~(np.abs(readings) < LARGEST_READING)
    return np.where(large.any(axis=1, keepdims=True), np.nan, readings) if large.any() else readings


def peak(readings: FloatArray) -> float:
    """Returns the largest finite reading of (n, 3), but for the few that garbled lines may have made."""
    largest = largest_each(whole_ones(readings))
    left_out = -(-len(largest) // _SAMPLES_PER_SPIKE) if len(largest) >= _FEW_SAMPLES else 0
    place = len(largest) - 1 - left_out
    return float(np.partition(largest, place)[place]) if len(largest) else 0.0


def rest_norm(vectors: FloatArray) -> float:
    """Returns the typical length of (n, 3) vectors while they change least, NaN where there are none."""
    pieces = _pieces(vectors)
    if pieces.size == 0:
        return math.nan
    scatter = pieces.var(axis=2).sum(axis=0)
    quiet = scatter <= np.quantile(scatter, 0.3)
    return float(np.median(np.linalg.norm(pieces[:, quiet].mean(axis=2), axis=0)))


def length_of_gravity(means: FloatArray) -> float:
    """Returns the length of gravity that means at rest, (n, 3), show together: a bias has one side in all.

    It is the radius of the sphere through them, and their usual length where they do not surround its centre.
    """
    lengths = np.linalg.norm(means, axis=1)
    usual = float(np.median(lengths))
    if not usual > 0.0:
        return usual
    scaled = means / usual
    design = np.column_stack([2.0 * scaled, np.ones(len(means))])
    solved, _, rank, _ = np.linalg.lstsq(design, (scaled**2).sum(axis=1), rcond=_SURROUNDING)
    if rank < design.shape[1]:
        return usual
    return usual * math.sqrt(max(0.0, float(solved[3] + solved[:3] @ solved[:3])))


def smallest_norm(vectors: FloatArray) -> float:
    """Returns the smallest length that short means of (n, 3) vectors have, NaN where there are none."""
    pieces = _pieces(vectors)
    return float(np.linalg.norm(pieces.mean(axis=2), axis=0).min()) if pieces.size else math.nan


def _pieces(vectors: FloatArray) -> FloatArray:
    """Finite vectors in short stretches, (3, count, window)."""
    finite = whole_ones(vectors)
    window = max(1, min(_WINDOW, len(finite) // 4))
    count = len(finite) // window
    pieces: FloatArray = finite[: count * window].T.reshape(3, count, window)
    return pieces


def guess_accelerometer_unit(norm_at_rest: float) -> str | None:
    """Returns the unit in which a resting accelerometer reads that length, None if no unit fits."""
    return next((name for name in SHOWN_AT_REST if is_gravity(norm_at_rest, name)), None)


def is_gravity(norm_at_rest: float, unit: str) -> bool:
    """Returns whether a resting accelerometer may read that length in a unit."""
    return 0.75 <= norm_at_rest * UNITS["accelerometer"][unit] / STANDARD_GRAVITY <= 1.3


def guess_range(norm_at_rest: float) -> float | None:
    """Returns the range, g, of a sensor of 16 bits that reads so many counts at rest; None if none fits."""
    return next((span for span in _RANGES_G if 0.9 <= norm_at_rest * span / COUNTS <= 1.1), None)


def guess_gyroscope_unit(smallest: float, peak: float, rest: StillReadings | None) -> tuple[str | None, str]:
    """Returns the unit of a gyroscope, and why: from its smallest and largest reading, and from a rest.

    None if no unit fits.
    """
    if peak > _IMPOSSIBLE_DEG_PER_S or smallest > _LARGEST_BIAS_DEG_PER_S:
        return None, ""
    is_fast = peak > IMPOSSIBLE_RAD_PER_S
    too_fast = f"peak of {peak:.4g} is too fast for rad/s"
    if rest is None:
        return ("deg/s", too_fast) if is_fast else ("rad/s", ASSUMED)
    (likely, _), *others = _rate_units(rest, [name for name in RATE_UNITS if name != "rad/s" or not is_fast])
    if others[0][1] > CERTAIN:  # units.md, eq. 6
        return likely, too_fast if is_fast and likely == "deg/s" else AT_REST
    fitting = {name for name, odds in others if odds <= CERTAIN}
    return "rad/s" if "rad/s" in fitting else likely, ASSUMED


def rate_unit_at_rest(rest: StillReadings) -> str | None:
    """Returns the unit that bias and noise at rest show; None where several may be."""
    (likely, _), (_, odds), *_ = _rate_units(rest, list(RATE_UNITS))
    return likely if odds > CERTAIN else None  # units.md, eq. 6


def _rate_units(rest: StillReadings, names: Sequence[str]) -> list[tuple[str, float]]:
    """Returns units, the likeliest first, each with how much less likely it is than that, in logarithms."""
    return ordered(
        {
            name: math.log(RATE_UNITS[name]) + log_likelihood_of_rate_unit(rest, UNITS["gyroscope"][name])
            for name in names
        }
    )


def in_celsius(values: FloatArray, unit: str) -> FloatArray:
    """Converts (n,) temperatures of a unit to degC."""
    return (values - TEMPERATURE_ZERO[unit]) * UNITS["temperature"][unit]


def possible_temperature(values: FloatArray, unit: str) -> bool:
    """Returns whether an IMU can have (n,) temperatures of a unit; taken for granted where none is known."""
    celsius = in_celsius(values[np.isfinite(values)], unit)
    low, high = POSSIBLE_TEMPERATURE
    return not len(celsius) or bool(low <= celsius.min() and celsius.max() <= high)


@dataclass(frozen=True, slots=True)
class TimeGuess:
    """The unit of time stamps that state none."""

    name: str
    reason: str
    others: tuple[str, ...] = ()
    """Units that fit nearly as well."""
    is_open: bool = False
    """True where one of these fits as well."""


def guess_time_unit(time: FloatArray, rates: Usual = IMU_RATE, samples: int | None = None) -> TimeGuess:
    """Returns the unit of time stamps: from their size if they count from 1970, else from their step.

    A counter of microseconds may have the size of seconds since 1970, but not their step. `rates` are those
    at which such sensors sample, `samples` is the length of the log, where it is known.
    """
    step = usual_step(time)
    if math.isnan(step):
        return TimeGuess("s", ASSUMED)
    possible = {name: scale for name, scale in UNITS["time"].items() if is_imu_step(step * scale)}
    for name, scale in possible.items():
        if counts_from_1970(_stamps(time) * scale):
            return TimeGuess(name, "size of the stamps, counted from 1970")
    if not possible:
        # The nearest, which whoever reads the log refuses by its rate.
        # A product of these may be too small, or too large, for a number.
        parts = math.log(step) + math.log(rates.median)
        nearest = min(UNITS["time"], key=lambda name: abs(parts + math.log(UNITS["time"][name])))
        return TimeGuess(nearest, f"step of {step:.6g} between samples")
    has_fractions = bool((_stamps(time) % 1.0).any())
    fractions = {name: math.log(COUNTED_IN_FRACTIONS) * (has_fractions and name != "s") for name in possible}
    (name, _), *others = ordered(
        {
            name: log_likelihood_of_step(step * scale, samples, rates) + fractions[name]
            for name, scale in possible.items()
        }
    )
    fitting = tuple(other for other, odds in others if odds < CERTAIN)
    is_open = any(odds < ASKED for _, odds in others)  # units.md, eq. 6
    return TimeGuess(name, ASSUMED if fitting else f"step of {step:.6g} between samples", fitting, is_open)


def counts_from_1970(time: FloatArray) -> bool:
    """Returns whether most of (n,) times, s, are dates of recordings."""
    return len(time) > 0 and DATES[0] <= float(np.median(time)) <= DATES[1]


def usual_step(time: FloatArray) -> float:
    """Returns the median step between successive (n,) times that advances, NaN where none does.

    Where readers stamp several samples in one burst, it is that of the samples: a share of the step between
    bursts.
    """
    stamps = _stamps(time)
    steps = np.diff(stamps)
    steps = steps[steps > 0.0]
    if not len(steps):
        return math.nan
    median = float(np.median(steps))
    long = stamps[_BURSTS_WITHIN:] - stamps[:-_BURSTS_WITHIN]
    mean = float(np.median(long)) / _BURSTS_WITHIN if len(long) else median
    return mean if median < _IN_BURST * mean else median


def _stamps(time: FloatArray) -> FloatArray:
    """Omits numbers that are no time in any unit."""
    return time[np.abs(time) < LARGEST_TIME / UNITS["time"]["ns"]]


def odd_step(step: float) -> str:
    """Describes a distance of stamps, s, that no IMU has; empty where an IMU may have it."""
    if is_imu_step(step):
        return ""
    rate = 1.0 / step if step else math.inf
    return f"a sample every {step:.6g} s, {rate:.4g} Hz, is none of an IMU"


def is_imu_step(step: float) -> bool:
    """Returns whether an IMU samples with that time between samples, s; taken for granted where it is NaN."""
    return not (step * FASTEST_HZ < 1.0 or step * SLOWEST_HZ > 1.0)
