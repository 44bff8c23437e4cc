"""Units on a table that moves by commands: they measure its motion as it happens."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate.fault import AXES
from tumble.tools.simulate.live.fault import LiveFault
from tumble.tools.simulate.live.samples import NONE, Samples
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.turntable.procedure import SimulatedTurntable, simulate_turntable
from tumble.tools.simulate.turntable.scenario import TurntableScenario
from tumble.tools.simulate.unit import PPM, SimulatedUnit, TriadTruth
from tumble.tools.table.axes import body_motion, cross_matrix, level_from_table
from tumble.tools.table.simulated import SimulatedTable

MOST_ROWS = 2_000_000
"""Samples of noise, of all units together, that are made ahead."""
SHORTEST_STRETCH, LONGEST_STRETCH = 10.0, 300.0
"""s of noise that are made at once."""
OVERLAP = 0.2
"""Share of a stretch over which the next one takes its place."""

_CENTRE = (0.0, 0.0, 0.0)


def session_at_rest(scenario: LiveScenario, seconds: float, seed: int, **changes: Any) -> SimulatedTurntable:  # noqa: ANN401
    """Simulates a session of the units on a table at rest."""
    reference, *targets = scenario.usual_grades
    plain = TurntableScenario(
        seed=seed,
        grades=targets,
        reference=reference,
        rate_hz=scenario.rate_hz,
        lever_arm_m=scenario.lever_arm_m,
        visits=("Z up",),
        rest_seconds=seconds,
        table_error_deg=0.0,
        clocks="apart",
        clock_offset_seconds=scenario.clock_offset_seconds,
        clock_skew_ppm=scenario.clock_skew_ppm,
        gravity=scenario.gravity,
    )
    return simulate_turntable(plain, **changes)


class Noise:
    """Noise of all units without end, in stretches that the simulator of sessions makes.

    A stretch goes over to the next with weights whose squares add up to one, so that no variance changes and
    nothing jumps. Bias instability slower than a stretch is left out.
    """

    def __init__(self, scenario: LiveScenario) -> None:
        self._scenario = scenario
        rows = MOST_ROWS / (len(scenario.usual_grades) * scenario.rate_hz)
        self._seconds = max(SHORTEST_STRETCH, min(LONGEST_STRETCH, rows, 2.0 * scenario.end))
        self._maker = ThreadPoolExecutor(1, thread_name_prefix="noise")
        self._length = int(self._seconds * scenario.rate_hz) - 2
        self._overlap = int(OVERLAP * self._length)
        # The first is there before anybody waits for it.
        self._stretches: dict[int, Future[dict[str, FloatArray]]] = {0: self._maker.submit(self._make, 0)}
        self._stretches[0].result()

    def rows(self, unit: str, first: int, count: int) -> FloatArray:
        """Returns noise (count, 6) of specific force and angular rate, from sample number `first` on."""
        numbers = np.arange(first, first + count)
        step = self._length - self._overlap
        noise = np.zeros((count, 6))
        for stretch in range(max(0, first // step - 1), (first + count) // step + 1):
            place = numbers - stretch * step
            weight = self._weight(place, stretch)
            inside = weight > 0.0
            if inside.any():
                made = self._stretch(stretch)[unit][place[inside]]
                noise[inside] += weight[inside, np.newaxis] * made
        return noise

    def close(self) -> None:
        """Stops the simulation of noise."""
        self._maker.shutdown(wait=True, cancel_futures=True)

    def _weight(self, place: NDArray[np.intp], stretch: int) -> FloatArray:
        """Returns how much of a stretch is in samples at these places of it; the first begins at once."""
        rise = np.ones(len(place)) if stretch == 0 else np.clip((place + 0.5) / self._overlap, 0.0, 1.0)
        fall = np.clip((self._length - place - 0.5) / self._overlap, 0.0, 1.0)
        weight = np.sin(0.5 * np.pi * rise) * np.sin(0.5 * np.pi * fall)
        inside: FloatArray = np.where((place >= 0) & (place < self._length), weight, 0.0)
        return inside

    def _stretch(self, number: int) -> dict[str, FloatArray]:
        for each in (number, number + 1):
            if each not in self._stretches:
                self._stretches[each] = self._maker.submit(self._make, each)
        for old in [each for each in self._stretches if each < number - 1]:
            del self._stretches[old]
        return self._stretches[number].result()

    def _make(self, number: int) -> dict[str, FloatArray]:
        seed = (self._scenario.seed + number * 0x9E3779B97F4A7C15) % 2**64
        # The clock of a unit, which decides how many samples it takes, is that of the bench.
        even = replace(self._scenario, clock_skew_ppm=0.0)
        # Exact numbers without the rotation of the Earth leave nothing but noise beside the truth.
        session = session_at_rest(even, self._seconds, seed, quantisation=False, latitude_deg=None)
        felt = session.rests[0].specific_force
        return {unit.name: _noise_of(unit, felt) for unit in session.units}


@dataclass(frozen=True, slots=True)
class _Setup:
    """The structure on the table, and the Earth below it."""

    case_from_table: FloatArray
    earth_rate: FloatArray
    gravity: FloatArray


class TableUnit:
    """One unit on the table, `unit`; a `Feed`."""

    def __init__(
        self,
        unit: SimulatedUnit,
        session: SimulatedTurntable,
        table: SimulatedTable,
        noise: Noise,
        lever_arm: tuple[float, float, float],
        faults: tuple[LiveFault, ...],
    ) -> None:
        self.unit = unit
        self._setup = _Setup(session.R_e, session.earth_rate, np.array([0.0, 0.0, session.scenario.gravity]))
        self._table = table
        self._noise = noise
        self._lever_arm = np.array(lever_arm)
        self._slips = [fault for fault in faults if fault.kind == "moved"]
        self._rate = session.scenario.rate_of(unit.name)
        self._next = 0

    def until(self, now: float) -> Samples:
        """See `Feed`."""
        clock = self.unit.clock
        skew = clock.skew * PPM
        # The simulator's clock ticks evenly by itself, and gains by its skew.
        end = max(self._next, int((now * self._rate - clock.phase) * (1.0 + skew)) + 1)
        if end == self._next:
            return NONE
        numbers = np.arange(self._next, end)
        noise = self._noise.rows(self.unit.name, self._next, len(numbers))
        self._next = end
        taken = (clock.phase + numbers / (1.0 + skew)) / self._rate
        began = clock.phase / self._rate
        own = began * (1.0 + skew) + clock.offset + numbers / self._rate
        force, rate = self.felt(taken)
        grade, accelerometer, gyroscope = self.unit.grade, self.unit.accelerometer, self.unit.gyroscope
        return Samples(
            taken,
            own,
            _reading(accelerometer, force, force, noise[:, :3], grade.accelerometer.range),
            _reading(gyroscope, rate, force, noise[:, 3:], grade.gyroscope.range),
        )

    def felt(self, taken: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns specific force and angular rate (n, 3) where it sits, case frame of the reference.

        m/s^2 and rad/s, at times (n,), s of the bench's clock.
        """
        states = self._table.states(taken)
        case = self._setup.case_from_table
        turned, speeding = (each @ case.T for each in body_motion(self._table.axes, *states))
        case_from_level = case @ np.swapaxes(level_from_table(self._table.axes, states[0]), 1, 2)
        force = case_from_level @ self._setup.gravity
        if (arm := self._lever_arm).any():
            # f + alpha x r + w (w . r) - r |w|^2, the last two being w x (w x r)
            force = force + speeding @ cross_matrix(arm.tolist()) + (turned @ arm)[:, np.newaxis] * turned
            force -= (turned * turned).sum(axis=1)[:, np.newaxis] * arm
        rate = turned + case_from_level @ self._setup.earth_rate
        for slip in self._slips:
            about = np.radians(slip.bad) * np.eye(3)[AXES.index(slip.axis)]
            slipped = (taken >= slip.start)[:, np.newaxis]
            moved = _core.rotation_matrix(about)
            force, rate = (np.where(slipped, each @ moved.T, each) for each in (force, rate))
        return force, rate


def _reading(
    truth: TriadTruth, felt: FloatArray, force: FloatArray, noise: FloatArray, largest: float
) -> FloatArray:
    """Y = M u + b + G f + noise (n, 3) in steps, within the range, as the simulator of sessions does."""
    analogue = felt @ truth.M.T + truth.b + force @ truth.g_sensitivity.T + noise
    step = truth.quantisation
    reading: FloatArray = np.clip(np.round(analogue / step) * step if step else analogue, -largest, largest)
    return reading


def _noise_of(unit: SimulatedUnit, force: FloatArray) -> FloatArray:
    """Returns what a unit at rest reads beside the truth, (n, 6)."""
    accelerometer = unit.samples.accelerometer - unit.accelerometer.M @ force - unit.accelerometer.b
    gyroscope = unit.samples.gyroscope - unit.gyroscope.b - unit.gyroscope.g_sensitivity @ force
    return np.hstack([accelerometer, gyroscope])


def units_on(
    table: SimulatedTable, scenario: LiveScenario, faults: Mapping[str, tuple[LiveFault, ...]]
) -> tuple[SimulatedTurntable, dict[str, TableUnit], Noise]:
    """Puts units on a table; returns their session, their feeds, and their noise to close."""
    session = session_at_rest(scenario, 1.0, scenario.seed)
    noise = Noise(scenario)
    feeds = {
        unit.name: TableUnit(
            unit,
            session,
            table,
            noise,
            tuple(scenario.lever_arm_m.get(unit.name, _CENTRE)),  # type: ignore[arg-type]
            faults.get(unit.name, ()),
        )
        for unit in session.units
    }
    return session, feeds, noise
