"""The state machine of a spin as a program drives it: the one that a device and a live spin run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast

from numpy.typing import ArrayLike

from tumble import _core
from tumble.acquisition.acquire import corrected
from tumble.calibration.document import Calibration
from tumble.calibration.temperature_counts import TemperatureCounts
from tumble.foundation.arrays import column
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import local_gravity
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.results import Precision, Rest
from tumble.procedures.spin.failure import SpinFailure
from tumble.procedures.spin.gravity import bias_sigma
from tumble.procedures.spin.messages import explain
from tumble.procedures.spin.outputs import describe_spin
from tumble.procedures.spin.preset import TurnPreset
from tumble.procedures.spin.result import Spin
from tumble.procedures.spin.settings import DEFAULT, DEFAULT_TURNS, core_settings

SpinState = Literal["still", "spin", "done", "failed"]
SpinEventKind = Literal["still began", "still broken", "still done", "spin began", "done", "failed"]


@dataclass(frozen=True, slots=True)
class LiveSpinOptions:
    """Requested motion of the robot, and prior knowledge of the place."""

    still: float = DEFAULT.still
    """s to stand still."""
    turns: float = DEFAULT_TURNS
    """Full turns to make on the spot, in either direction or both."""
    rate: float = DEFAULT.rate
    """rad/s to turn at."""
    duration: float | None = None
    """s to turn for, where that was preset."""
    wait: float | None = None
    """s to wait for the robot to stand still; as the core has it if not given."""
    level_floor: bool = False
    """Assume that the floor is level, as the published method does."""
    gravity: float | None = None
    """m/s^2; standard, or that of `latitude` and `height`, if not given."""
    latitude: float | None = None
    """deg."""
    height: float | None = None
    """m above the ellipsoid."""
    gravity_uncertainty: float | None = None
    """1-sigma, m/s^2; as docs/theory/uncertainty.md has it if not given."""

    @property
    def preset(self) -> TurnPreset:
        """The turn that is asked for."""
        return TurnPreset(self.duration, self.rate, self.turns)


@dataclass(frozen=True, slots=True)
class SpinEvent:
    """One thing that happened in the course of a spin."""

    time: float
    """s of the samples' clock."""
    kind: SpinEventKind


class SpinMachine:
    """Stands still, then turns: takes samples as they come, and has the result when it is `done`.

    >>> import numpy as np
    >>> from tumble import Chunk, SpinMachine
    >>> machine = SpinMachine()
    >>> time = np.arange(600) / 100
    >>> noise = np.random.default_rng(1).normal(0.0, 0.01, (600, 6))
    >>> still = Chunk(time, noise[:, :3] + (0.0, 0.0, 9.80665), 0.1 * noise[:, 3:])
    >>> [(event.kind, round(event.time, 1)) for event in machine.push(still)]
    [('still began', 0.2), ('still done', 5.2)]
    >>> machine.state, round(machine.progress["turned"], 2)
    ('spin', 0.0)

    A `calibration` of the unit is applied first. A workstation has f64 and so uses it; `precision` `f32`
    shows what a device would find. All it keeps are sums, so that its memory does not grow.

    Raises `ProcedureError`, in one line, where `options` make no sense.

    Method: docs/theory/spin.md.
    """

    def __init__(
        self,
        options: LiveSpinOptions | None = None,
        *,
        calibration: Calibration | None = None,
        precision: Precision = "f64",
    ) -> None:
        self.options = options or LiveSpinOptions()
        self.calibration = calibration
        self.temperatures = TemperatureCounts(calibration)
        self.precision = precision
        place = local_gravity(
            self.options.gravity,
            self.options.latitude,
            self.options.height,
            self.options.gravity_uncertainty,
        )
        self.gravity, self.gravity_source, self.gravity_sigma = place.value, place.source, place.sigma
        self.bias_sigma = bias_sigma(place, calibration)
        """m/s^2: the accelerometer's bias along the vertical from the uncertainty of gravity."""
        self.settings = core_settings(
            {
                "gravity": self.gravity,
                "still": self.options.still,
                "rate": self.options.rate,
                "level_floor": self.options.level_floor,
                **({} if self.options.wait is None else {"still_timeout": self.options.wait}),
            },
            turns=self.options.turns,
            latitude=self.options.latitude,
            bias_instability=calibration.bias_instability if calibration else None,
        )
        self._core = _core.SpinMachine(self.settings, precision)
        self._core.start()
        self.span = (math.nan, math.nan)
        """s, of the spin so far: since when the robot has stood still, and the last event."""

    def push(
        self, samples: Chunk | tuple[ArrayLike, ArrayLike, ArrayLike], moving: ArrayLike | None = None
    ) -> tuple[SpinEvent, ...]:
        """Adds successive raw samples, and returns the events.

        `samples` are a chunk, or time (n,) s, specific force (n, 3) m/s^2 and angular rate (n, 3) rad/s;
        `moving` (n,) is 1 where wheels turn, 0 where they stand, NaN where nobody knows.

        Raises `ArrayError` for what are no samples.
        """
        chunk = self.corrected(samples if isinstance(samples, Chunk) else Chunk(*samples))  # type: ignore[arg-type]
        wheels = None if moving is None else column(moving, "moving")
        return self.push_corrected(chunk, wheels)

    def push_corrected(self, chunk: Chunk, moving: FloatArray | None = None) -> tuple[SpinEvent, ...]:
        """Adds samples corrected by the calibration; all else is as for `push`."""
        happened = self._core.push(chunk.time, chunk.accelerometer, chunk.gyroscope, moving)
        for time, kind in happened:
            self.span = (time if kind == "still began" else self.span[0], time)
        return tuple(SpinEvent(time, cast("SpinEventKind", kind)) for time, kind in happened)

    def corrected(self, chunk: Chunk) -> Chunk:
        """Applies the calibration of the unit, where there is one."""
        self.temperatures.add(len(chunk), chunk.temperature)
        return Chunk(chunk.time, *corrected(chunk, self.calibration))

    def tick(self, time: float) -> tuple[SpinEvent, ...]:
        """Reports the time, s of the samples' clock: samples that stop coming fail the spin."""
        kind = self._core.tick(time)
        return () if kind is None else (SpinEvent(time, cast("SpinEventKind", kind)),)

    @property
    def state(self) -> SpinState:
        """`still` while the robot is to stand, `spin` while it is to turn, then `done` or `failed`."""
        return cast("SpinState", self._core.state)

    @property
    def is_over(self) -> bool:
        """Returns whether it is done, or has failed."""
        return self.state in ("done", "failed")

    @property
    def progress(self) -> _core.SpinProgress:
        """Progress: time stood and angle turned, with the wanted ones; rate, rad/s; at rest."""
        return self._core.progress

    @property
    def failure(self) -> SpinFailure | None:
        """Reason of the failure, if any; `tumble.procedures.spin.messages.explain` puts it in words."""
        failure = self._core.failure
        return None if failure is None else SpinFailure.of_core(*failure)

    def read_bias_instability(self, samples: Chunk) -> None:
        """Reads bias instability off the samples of the spin, corrected, which sums do not show."""
        self._core.read_bias_instability(samples.time, samples.accelerometer, samples.gyroscope)

    def result(
        self,
        rests: tuple[Rest, ...] = (),
        blocks: _core.SpinBlockFigures | None = None,
    ) -> Spin:
        """Returns what was found, once it is `done`; `rests` and `blocks` are for the pictures.

        Raises `ProcedureError`, in one line, where it failed, or is not done.
        """
        failure = self.failure
        if failure is not None:
            raise ProcedureError(explain(failure))
        if self.state != "done":
            raise ProcedureError(f"the spin is not done: it is at {self.state!r}; push more samples")
        return describe_spin(
            self._core.figures(),
            blocks,
            rests,
            self.span,
            label="spin 1",
            gravity=self.gravity,
            gravity_sigma=self.bias_sigma,
            level_floor=self.options.level_floor,
            preset=self.options.preset,
        )
