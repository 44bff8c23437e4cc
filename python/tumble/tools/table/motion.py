"""Motion of an axis: at constant acceleration, at constant rate, and braking."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray


def travel_time(distance: float, rate: float, acceleration: float) -> float:
    """Time, s, from rest to rest over a distance, rad, no faster than `rate` and `acceleration`."""
    distance = abs(distance)
    if distance * acceleration < rate * rate:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / rate + rate / acceleration


@dataclass(frozen=True, slots=True)
class Stretch:
    """Motion at constant acceleration, from `start` until the next one begins."""

    start: float
    """s."""
    angle: float
    rate: float
    acceleration: float
    """rad, rad/s, rad/s^2."""

    def state(self, t: float) -> tuple[float, float]:
        """Returns angle and rate at a time."""
        since = t - self.start
        return (
            self.angle + (self.rate + 0.5 * self.acceleration * since) * since,
            self.rate + self.acceleration * since,
        )


class AxisMotion:
    """Where an axis was and will be: its commands, laid out in time."""

    def __init__(self, angle: float = 0.0) -> None:
        self._stretches = [Stretch(-math.inf, angle, 0.0, 0.0)]

    def state(self, t: float) -> tuple[float, float]:
        """Returns angle and rate at a time, s."""
        stretch = next(stretch for stretch in reversed(self._stretches) if stretch.start <= t)
        return (stretch.angle, stretch.rate) if math.isinf(stretch.start) else stretch.state(t)

    def states(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns angles, rates and accelerations (n,) at times (n,), s."""
        starts = np.array([stretch.start for stretch in self._stretches])
        which = np.searchsorted(starts, times, side="right") - 1
        begin, angle, rate, acceleration = np.array(
            [
                (0.0 if math.isinf(each.start) else each.start, each.angle, each.rate, each.acceleration)
                for each in self._stretches
            ]
        )[which].T
        since = times - begin
        return angle + (rate + 0.5 * acceleration * since) * since, rate + acceleration * since, acceleration

    @property
    def end(self) -> float:
        """Time of the last change, s; before any command, minus infinity."""
        return self._stretches[-1].start

    def goto(self, t: float, angle: float, rate: float, acceleration: float) -> None:
        """From `t` on brake to rest, then go from rest to rest to `angle`."""
        self._brake(t, 0.0, acceleration)
        at = self._stretches[-1]
        distance = angle - at.angle
        way = math.copysign(1.0, distance)
        fastest = min(rate, math.sqrt(abs(distance) * acceleration))
        if fastest == 0.0:
            return
        self._speed_up(at.start, way * fastest, acceleration)
        at = self._stretches[-1]
        ramp = 0.5 * fastest * fastest / acceleration
        cruise = max(0.0, abs(distance) - 2.0 * ramp) / fastest
        self._speed_up(at.start + cruise, 0.0, acceleration)
        # The end is the commanded one, not where sums of roundings end.
        self._stretches[-1] = Stretch(self._stretches[-1].start, angle, 0.0, 0.0)

    def turn(self, t: float, rate: float, acceleration: float) -> None:
        """From `t` on get to a rate, and keep it."""
        self._brake(t, rate, acceleration)

    def forget_before(self, t: float) -> None:
        """Forgets motion before `t`; earlier times cannot be queried any more."""
        while len(self._stretches) > 1 and self._stretches[1].start <= t:
            del self._stretches[0]

    def _brake(self, t: float, rate: float, acceleration: float) -> None:
        """Cancels motion planned after `t`, and changes over to a rate."""
        angle, now = self.state(t)
        while self._stretches[-1].start >= t:
            self._stretches.pop()
        self._stretches.append(Stretch(t, angle, now, 0.0))
        self._speed_up(t, rate, acceleration)

    def _speed_up(self, t: float, rate: float, acceleration: float) -> None:
        """Changes over to a rate from `t` on, which lies in the last stretch."""
        angle, now = self._stretches[-1].state(t)
        change = rate - now
        if change != 0.0:
            ramp = Stretch(t, angle, now, math.copysign(acceleration, change))
            t += abs(change) / acceleration
            angle, _ = ramp.state(t)
            self._stretches.append(ramp)
        self._stretches.append(Stretch(t, angle, rate, 0.0))
