"""Simulated recordings that are served as if they were taken just now: faces, a spin, a flight."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tumble.foundation.recording import Chunk
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.flight.files import flight_truth
from tumble.tools.simulate.flight.procedure import simulate_flight
from tumble.tools.simulate.flight.scenario import USUAL_UNITS, FlightUnit, unit_names
from tumble.tools.simulate.live.fault import LiveFault
from tumble.tools.simulate.live.samples import Samples
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.spin.files import spin_truth
from tumble.tools.simulate.spin.procedure import simulate_spin
from tumble.tools.simulate.spin.scenario import Step
from tumble.tools.simulate.turntable.files import truth_content
from tumble.tools.simulate.turntable.procedure import simulate_turntable
from tumble.tools.simulate.turntable.scenario import REFERENCE
from tumble.tools.simulate.unit import PPM, ClockTruth

ROBOT = "imu"
"""Name of the one unit of a robot, and of that in a hand."""
BY_HAND_DEG = 2.0
"""Error with which a hand holds a face, deg, 1 sigma about each axis."""
HAND_RATE_DPS = 90.0
LAST_REST = 5.0
"""s for which a robot stands still after its turns."""


class PlayedUnit:
    """A recording that is given out as its time comes; a `Feed`."""

    def __init__(self, samples: Chunk, clock: ClockTruth) -> None:
        taken = (samples.time - clock.offset) / (1.0 + clock.skew * PPM)
        self._samples = Samples(taken, samples.time, samples.accelerometer, samples.gyroscope)
        self._given = 0

    def until(self, now: float) -> Samples:
        """See `Feed`."""
        end = int(np.searchsorted(self._samples.taken, now, side="right"))
        first, self._given = self._given, max(self._given, end)
        return self._samples.where(slice(first, self._given))


@dataclass(frozen=True, slots=True)
class Playback:
    """Units with their recordings, and what is true of them."""

    feeds: Mapping[str, PlayedUnit]
    truth: Mapping[str, Any]
    duration: float
    """s."""


def names_of(scenario: LiveScenario) -> tuple[str, ...]:
    """Returns the names of the units of a motion."""
    count = len(scenario.usual_grades)
    match scenario.motion:
        case "spin" | "hand":
            return (ROBOT,)
        case "flight":
            return unit_names(count)
    return (REFERENCE, *(f"target_{number}" for number in range(1, count)))


def playback(scenario: LiveScenario, faults: Mapping[str, tuple[LiveFault, ...]]) -> Playback:
    """Simulates what is to be served; raises `ScenarioError` where it cannot be."""
    players: dict[str, Callable[[LiveScenario, dict[str, list[Fault]]], Playback]] = {
        "six-faces": _six_faces,
        "spin": _spin,
        "flight": _flight,
    }
    slips = {
        name: [
            Fault("moved", axis=each.axis, start=each.start, size=each.bad)
            for each in found
            if each.kind == "moved"
        ]
        for name, found in faults.items()
    }
    return players[scenario.motion](scenario, slips)


def _six_faces(scenario: LiveScenario, slips: dict[str, list[Fault]]) -> Playback:
    reference, *targets = scenario.usual_grades
    session = simulate_turntable(
        seed=scenario.seed,
        grades=targets,
        reference=reference,
        rate_hz=scenario.rate_hz,
        lever_arm_m=scenario.lever_arm_m,
        faults=slips,
        table_error_deg=BY_HAND_DEG,
        turn_rate_dps=HAND_RATE_DPS,
        rest_seconds=scenario.rest_seconds,
        clocks="apart",
        clock_offset_seconds=scenario.clock_offset_seconds,
        clock_skew_ppm=scenario.clock_skew_ppm,
        gravity=scenario.gravity,
    )
    feeds = {unit.name: PlayedUnit(unit.samples, unit.clock) for unit in session.units}
    return Playback(feeds, truth_content(session), session.duration)


def _spin(scenario: LiveScenario, slips: dict[str, list[Fault]]) -> Playback:
    plan: Sequence[Step] = (
        Step("rest", scenario.rest_seconds),
        Step("turn", turns=3.0),
        Step("rest", LAST_REST),
    )
    spin = simulate_spin(
        seed=scenario.seed,
        plan=plan,
        grade=scenario.usual_grades[0],
        rate_hz=scenario.rate_hz,
        gravity=scenario.gravity,
        faults=slips.get(ROBOT, []),
    )
    feed = PlayedUnit(spin.samples, ClockTruth(0.0, 0.0, 0.0))
    return Playback({ROBOT: feed}, spin_truth(spin), float(spin.samples.time[-1]))


def _flight(scenario: LiveScenario, slips: dict[str, list[Fault]]) -> Playback:
    generator = np.random.default_rng(scenario.seed)
    names = names_of(scenario)
    units = []
    for number, (name, grade) in enumerate(zip(names, scenario.usual_grades, strict=True)):
        usual = USUAL_UNITS[min(number, len(USUAL_UNITS) - 1)]
        offset, skew = generator.uniform(-1.0, 1.0), generator.standard_normal()
        units.append(
            FlightUnit(
                grade=grade,
                lever_arm_m=scenario.lever_arm_m.get(name, usual.lever_arm_m),
                mounting_deg=usual.mounting_deg,
                ageing=usual.ageing,
                rate_hz=scenario.rate_hz,
                clock_offset_seconds=scenario.clock_offset_seconds * offset if number else 0.0,
                clock_skew_ppm=scenario.clock_skew_ppm * skew if number else 0.0,
                faults=slips.get(name, ()),
            )
        )
    flight = simulate_flight(
        seed=scenario.seed, units=units, rest_seconds=scenario.rest_seconds, gravity=scenario.gravity
    )
    feeds = {unit.name: PlayedUnit(unit.samples, unit.clock) for unit in flight.units}
    return Playback(feeds, flight_truth(flight), flight.duration)
