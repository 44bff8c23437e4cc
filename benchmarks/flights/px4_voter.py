"""The voter of PX4 with default parameters, written from their published meaning, for comparison.

A sensor is invalid after 300 ms without a sample, or after 100 values in succession that equal the one
before. Units are compared with the mean of all by a filter of one twentieth a sample; the excess over 7 deg/s
or 1 m/s^2 is integrated, and the largest of three and more is faulty beyond 15 deg or 2 m/s
(`EKF2_SEL_IMU_RAT`, `_ANG`, `_ACC`, `_VEL`). It learns no errors: stored ones are subtracted before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

TIMEOUT = 0.3
"""s."""
EQUAL = 100
"""Values of single axes in succession."""
SMOOTHED = 0.05
"""Share of a new sample in the filtered difference."""
RATES = (1.0, float(np.radians(7.0)))
"""m/s^2 and rad/s of the difference from the mean that are tolerated."""
SUMS = (2.0, float(np.radians(15.0)))
"""m/s and rad of the integrated excess."""
LONGEST_STEP = 0.02
"""s that are integrated at most from one sample to the next."""


def events(units: Sequence[Samples]) -> list[Event]:
    """Returns the start, and the unit that is named first, if any, at the time of a sample."""
    time = units[0].time if len(units[0].time) > 1 else units[1].time
    named = [each for number, unit in enumerate(units) if (each := _invalid(unit, number, time)) is not None]
    if len(units) > 2:
        named += _inconsistent(units, time)
    start: Event = (float(time[0]), 0, "selected", {"reason": "start"})
    return [start, *sorted(named, key=lambda each: each[0])[:1]]


def _invalid(samples: Samples, number: int, time: FloatArray) -> Event | None:
    """Returns when the values of a unit are stale, or it is silent."""
    found = []
    both = np.hstack([samples.specific_force, samples.angular_rate])
    equal = np.abs(np.diff(both, axis=0)) < 1e-6
    for sensor in (0, 1):
        flat = equal[:, 3 * sensor : 3 * sensor + 3].ravel()
        place = np.arange(1, len(flat) + 1)
        count = place - np.maximum.accumulate(np.where(flat, 0, place))
        if (count > EQUAL).any():
            found.append((float(samples.time[int(np.argmax(count > EQUAL)) // 3 + 1]), "stale"))
    gaps = np.diff(np.append(samples.time, time[-1]))
    if (late := np.nonzero(gaps > TIMEOUT)[0]).size:
        found.append((float(samples.time[late[0]]) + TIMEOUT, "timeout"))
    return (*_first(found, number),) if found else None


def _first(found: Sequence[tuple[float, str]], number: int) -> Event:
    at, reason = min(found)
    return at, number, "unhealthy", {"reason": reason}


def _inconsistent(units: Sequence[Samples], time: FloatArray) -> list[Event]:
    """Returns when the integrated difference of a unit from the mean is too large."""
    found: list[Event] = []
    for sensor, channel in enumerate(("specific_force", "angular_rate")):
        readings = np.stack([_held(unit, channel, time) for unit in units])
        difference = readings - readings.mean(axis=0)
        steps = np.minimum(np.diff(time, prepend=time[0]), LONGEST_STEP)
        smooth = lfilter([SMOOTHED], [1.0, SMOOTHED - 1.0], difference, axis=1)
        sums = np.cumsum((np.linalg.norm(smooth, axis=-1) - RATES[sensor]) * steps, axis=1)
        # A sum that never falls below zero is the sum less its least so far.
        total = sums - np.minimum(np.minimum.accumulate(sums, axis=1), 0.0)
        if (beyond := (total > SUMS[sensor]).any(axis=0)).any():
            index = int(np.argmax(beyond))
            unit = int(total[:, index].argmax())
            found.append((float(time[index]), unit, "unhealthy", {"reason": channel}))
    return found


def _held(samples: Samples, channel: str, time: FloatArray) -> FloatArray:
    """Returns the last reading (n, 3) before each time."""
    index = np.clip(np.searchsorted(samples.time, time, side="right") - 1, 0, len(samples.time) - 1)
    return np.asarray(np.nan_to_num(getattr(samples, channel))[index])
