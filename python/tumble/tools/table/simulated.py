"""A simulated table: it moves within its limits, by any clock."""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import TracebackType

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.tools.table.axes import Axis, AxisLimits
from tumble.tools.table.motion import AxisMotion
from tumble.tools.table.registry import TableAddress

DEG = np.pi / 180.0


def _axis(name: str, about: tuple[float, float, float], rate: float, angle: float | None = None) -> Axis:
    """Creates an axis of figures in deg: 360 deg/s^2 for small ones, less for one that carries others."""
    span = None if angle is None else (-angle * DEG, angle * DEG)
    return Axis(name, about, AxisLimits(rate * DEG, rate * DEG, span))


PRESETS = {
    "one-axis": (_axis("table", (0.0, 0.0, 1.0), 360.0),),
    "two-axis": (
        _axis("outer", (1.0, 0.0, 0.0), 60.0, 185.0),
        _axis("inner", (0.0, 0.0, 1.0), 180.0),
    ),
    "three-axis": (
        _axis("outer", (0.0, 0.0, 1.0), 60.0),
        _axis("middle", (1.0, 0.0, 0.0), 90.0, 185.0),
        _axis("inner", (0.0, 1.0, 0.0), 180.0),
    ),
}
"""Tables as they are sold, by their number of axes; the first axis stands on the floor."""


def open_simulated(address: TableAddress) -> SimulatedTable:
    """Opens `simulated:one-axis|two-axis|three-axis?speed=1`; raises `TableError` for another table."""
    address.refuse_other_settings("speed")
    preset = address.place or "two-axis"
    if preset not in PRESETS:
        raise TableError(f"{address.text}: no such table; known: {', '.join(PRESETS)}")
    speed = address.number("speed", 1.0)
    return SimulatedTable(PRESETS[preset], lambda: speed * clock.now(), name=address.text)


class SimulatedTable:
    """Axes that obey at once and exactly; where they are follows from the clock, without a thread.

    Safe to be commanded from one thread and looked at from another.
    """

    remarks: tuple[str, ...] = ()

    def __init__(
        self, axes: tuple[Axis, ...], now: Callable[[], float] = clock.now, name: str = "simulated"
    ) -> None:
        self.name = name
        self.address = ""
        self.documents: dict[str, str] = {}
        self.axes = axes
        self._now = now
        self._motions = [AxisMotion() for _ in axes]
        self._lock = threading.Lock()

    def prepare(self) -> None:
        """See `RateTable`."""

    def __enter__(self) -> SimulatedTable:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def enable(self) -> None:
        """See `RateTable`."""

    def goto(self, angles: FloatArray, rate: FloatArray, acceleration: FloatArray) -> None:
        """See `RateTable`."""
        self.move(slice(None), angles, rate, acceleration)

    def move(self, axes: slice, angles: FloatArray, rate: FloatArray, acceleration: FloatArray) -> None:
        """Starts to move some of the axes to their angles, as tables with a command an axis."""
        with self._lock:
            now = self._now()
            each = zip(self._motions[axes], angles[axes], rate[axes], acceleration[axes], strict=True)
            for motion, *figures in each:
                motion.goto(now, *map(float, figures))

    def rate(self, rates: FloatArray, acceleration: FloatArray) -> None:
        """See `RateTable`."""
        self.turn(slice(None), rates, acceleration)

    def turn(self, axes: slice, rates: FloatArray, acceleration: FloatArray) -> None:
        """Starts to turn some of the axes at their rates."""
        with self._lock:
            now = self._now()
            for motion, *figures in zip(self._motions[axes], rates[axes], acceleration[axes], strict=True):
                motion.turn(now, *map(float, figures))

    def stop(self) -> None:
        """See `RateTable`."""
        self.rate(np.zeros(len(self.axes)), np.array([axis.limits.acceleration for axis in self.axes]))

    def settled(self) -> bool:
        """See `RateTable`."""
        with self._lock:
            return all(motion.end <= self._now() for motion in self._motions)

    def position(self) -> FloatArray:
        """See `RateTable`."""
        angles: FloatArray = self.states(np.array([self._now()]))[0][0]
        return angles

    def states(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns angles, rates and accelerations (n, axes) at times (n,), s of its clock."""
        with self._lock:
            columns = [motion.states(times) for motion in self._motions]
        angles, rates, accelerations = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
        return angles, rates, accelerations

    def forget_before(self, t: float) -> None:
        """Forgets motion before `t`, s of its clock."""
        with self._lock:
            for motion in self._motions:
                motion.forget_before(t)
