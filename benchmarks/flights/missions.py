"""Missions of flying sets, drawn from seeds: what shakes, warms, ages and stalls, and what breaks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from benchmarks.flights.body import Body, fly
from benchmarks.flights.units import (
    Line,
    Shaking,
    Unit,
    digitised,
    draw_pace,
    draw_thermometer,
    draw_unit,
    read,
    stalled,
)
from benchmarks.redundancy_fault import InjectedFault, Kind, draw_fault
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

Drawn: TypeAlias = Kind | Literal["none", "two faults"]
CYCLE: tuple[Drawn, ...] = (
    *("jump", "ramp", "scale", "none", "noise", "jump", "two faults", "stuck", "frozen", "swapped axes"),
    *("jump", "ramp", "scale", "none", "spikes", "wrong sign", "dead", "duplicated", "jump", "two faults"),
)
"""Kinds of successive seeds."""
NUMBERS = (2, 2, 2, 3, 3, 3, 4, 4, 5, 6, 7, 8)
"""Numbers of units, drawn with equal chance."""
RATES_HZ = (10.0, 20.0, 50.0, 100.0, 100.0, 200.0, 200.0, 250.0, 400.0, 500.0, 1000.0)
ONE_RATE = 0.6
"""Share of the missions whose units all have one rate."""
LINES = (1, 2, 3)
SHAKEN = (1.0, 30.0)
"""m/s^2 of the strongest line, least and most; one mission in four is hardly shaken."""
CALM = 0.2
"""m/s^2 of it there."""
TURNED_SHARE = 0.02
"""rad/s of a line, a m/s^2."""
LINE_HZ = (25.0, 350.0)
ALIASED = 0.25
"""Share of the missions in which a line aliases to a slow frequency of one unit."""
ALIAS_HZ = (1.5, 4.0)
CLEAR_HZ = 0.8
"""A line aliased nearer to a standstill is an error of the unit itself: no mission has one."""
IDLING = 0.15
"""Share of the missions shaken at rest."""
WARMING = (3.0, 25.0)
"""K, usual and, in one mission of three, largest."""
TWO_FLIGHTS = 0.35
"""Share of the missions whose stored calibration comes from a flight before, and has aged."""
STALLS = 0.25
"""Share of the missions in which all units stall, and share in which one does."""
STALL_SECONDS = (0.05, 0.99)
REST_SECONDS = (8.0, 12.0)
MOTION_SECONDS = (38.0, 50.0)
FIRST_SECONDS = 112.0
FAULT_SECONDS = (115.0, 160.0)
FAULT_SECONDS_AGED = (75.0, 110.0)
AFTER_SECONDS = {"jump": 90.0, "ramp": 125.0, "scale": 90.0, "two faults": 90.0}
OTHERWISE_SECONDS = 50.0
APART_SECONDS = 30.0
"""From the first to the second of two faults."""
SECOND: tuple[Kind, ...] = ("jump", "scale", "noise", "stuck", "frozen", "dead")
LEAST = 0.2
"""m/s^2 of a jump or ramp, and a tenth of it in rad/s; in vibration a tenth of its amplitude is."""


@dataclass(frozen=True, slots=True)
class PlacedFault:
    """A fault and its unit."""

    unit: int
    fault: InjectedFault


@dataclass(frozen=True, slots=True)
class Flight:
    """A flown mission: its truth, and the recordings of all units."""

    body: Body
    units: tuple[Unit, ...]
    warming: float
    """K at the end."""
    recorded: tuple[Samples, ...]
    stalls: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(n, 2) s, of all units at once."""
    lonely: int = -1
    """Unit that stalls alone; negative where none does."""
    own_stalls: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(n, 2) s, of that unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """Parameters that were drawn from a seed; flying it draws the rest."""

    seed: int
    kind: Drawn
    rates_hz: tuple[float, ...]
    """Stated."""
    paces_hz: tuple[float, ...]
    """At which the units sample."""
    faults: tuple[PlacedFault, ...]
    motions: FloatArray
    duration: float
    shaking: Shaking
    warming: float
    has_aged: bool
    all_stall: bool
    one_stalls: bool
    precision: Literal["f32", "f64"]

    @property
    def onset(self) -> float:
        """Time at which the first fault has an effect, s: a gyroscope of wrong sign, when it moves."""
        if not self.faults:
            return self.duration
        fault = self.faults[0].fault
        if fault.kind == "wrong sign" and fault.sensor == "gyroscope":
            return float(self.motions[0, 0])
        return fault.start

    def fly(self) -> tuple[Flight | None, Flight]:
        """Simulates the flight before, where there is one, and the flight with the faults."""
        random = np.random.default_rng([self.seed, 3])
        warmth = np.random.default_rng([self.seed, 4])
        units = tuple(
            replace(draw_unit(random, rate, number, pace), thermometer=draw_thermometer(warmth))
            for number, (rate, pace) in enumerate(zip(self.rates_hz, self.paces_hz, strict=True))
        )
        if not self.has_aged:
            return None, self._flown(random, units)
        before = self._before(random, units)
        aged = tuple(
            unit.aged(random, share=0.1 if number == 0 else 1.0) for number, unit in enumerate(units)
        )
        return before, self._flown(random, aged)

    def _before(self, random: np.random.Generator, units: tuple[Unit, ...]) -> Flight:
        motions = drawn_motions(random, FIRST_SECONDS)
        body = fly(random, motions, FIRST_SECONDS, random.uniform(0.0, 0.15))
        recorded = tuple(
            digitised(read(random, unit, body, self.shaking, WARMING[0]), unit) for unit in units
        )
        return Flight(body, units, WARMING[0], recorded)

    def _flown(self, random: np.random.Generator, units: tuple[Unit, ...]) -> Flight:
        body = fly(random, self.motions, self.duration, random.uniform(0.0, 0.15))
        common = _stalls(random, self.duration, 2) if self.all_stall else np.zeros((0, 2))
        lonely = int(random.integers(len(units))) if self.one_stalls else -1
        own = _stalls(random, self.duration, 1)
        recorded = []
        for number, unit in enumerate(units):
            samples = read(random, unit, body, self.shaking, self.warming)
            for each in self.faults:
                samples = each.fault.inject(samples) if each.unit == number else samples
            spans = np.vstack([common, own]) if number == lonely else common
            recorded.append(stalled(digitised(samples, unit), spans))
        return Flight(body, units, self.warming, tuple(recorded), common, lonely, own)


def draw(seed: int) -> Mission:
    """Draws a mission; the same for the same seed."""
    random = np.random.default_rng([seed, 2])
    kind = CYCLE[seed % len(CYCLE)]
    count = int(random.choice(NUMBERS[3:] if kind == "two faults" else NUMBERS))
    one = random.random() < ONE_RATE
    rates = tuple(float(each) for each in random.choice(RATES_HZ, 1 if one else count))
    rates = rates * count if one else rates
    crystals = np.random.default_rng([seed, 5])
    paces = tuple(draw_pace(crystals, rate) for rate in rates)
    has_aged = bool(random.random() < TWO_FLIGHTS)
    span = FAULT_SECONDS_AGED if has_aged else FAULT_SECONDS
    start = 0.0 if kind == "wrong sign" else random.uniform(*span)
    duration = max(start, FAULT_SECONDS[0]) + AFTER_SECONDS.get(kind, OTHERWISE_SECONDS)
    strongest = CALM if random.random() < 0.25 else np.exp(random.uniform(*np.log(SHAKEN)))
    warmest = WARMING[1] if random.random() < 1.0 / 3.0 else WARMING[0]
    return Mission(
        seed=seed,
        kind=kind,
        rates_hz=rates,
        paces_hz=paces,
        faults=_faults(random, kind, count, start, float(strongest)),
        motions=drawn_motions(random, duration),
        duration=float(duration),
        shaking=_shaking(random, paces, float(strongest)),
        warming=float(random.uniform(0.0, warmest)),
        has_aged=has_aged,
        all_stall=bool(random.random() < STALLS),
        one_stalls=bool(random.random() < STALLS),
        precision="f32" if random.random() < 0.5 else "f64",
    )


def drawn_motions(random: np.random.Generator, duration: float) -> FloatArray:
    """Draws when the body moves (n, 2) s, up to the end."""
    found, end = [], 0.0
    while end < duration:
        start = end + random.uniform(*REST_SECONDS)
        end = start + random.uniform(*MOTION_SECONDS)
        found.append((start, end))
    return np.array(found)


def _faults(
    random: np.random.Generator, kind: Drawn, count: int, start: float, strongest: float
) -> tuple[PlacedFault, ...]:
    if kind == "none":
        return ()
    least = max(LEAST, 0.1 * strongest)
    first = 0 if random.random() < 0.5 else int(random.integers(1, count))
    if kind != "two faults":
        return (PlacedFault(first, draw_fault(random, kind, start, least)),)
    second = int(random.choice([each for each in range(count) if each != first]))
    kinds = [SECOND[int(index)] for index in random.integers(len(SECOND), size=2)]
    return tuple(
        PlacedFault(unit, draw_fault(random, which, start + later, least))
        for unit, which, later in zip((first, second), kinds, (0.0, APART_SECONDS), strict=True)
    )


def _shaking(random: np.random.Generator, paces: tuple[float, ...], strongest: float) -> Shaking:
    count = int(random.choice(LINES))
    aliased = random.random() < ALIASED
    lines = []
    for number in range(count):
        wander = float(random.uniform(0.0, 0.004))
        frequency = _frequency(random, paces, aliased and number == 0, wander)
        size = strongest / (1.0 + number)
        lines.append(
            Line(
                frequency=frequency,
                wander=wander,
                period=float(random.uniform(3.0, 20.0)),
                size=(
                    size * random.uniform(0.3, 1.0, 3),
                    TURNED_SHARE * size * random.uniform(0.3, 1.0, 3),
                ),
                phase=(random.uniform(0.0, 2.0 * np.pi, 3), random.uniform(0.0, 2.0 * np.pi, 3)),
            )
        )
    return Shaking(tuple(lines), float(random.uniform(0.005, 0.05)) if random.random() < IDLING else 0.0)


def _frequency(random: np.random.Generator, paces: tuple[float, ...], aliased: bool, wander: float) -> float:
    """Draws a line, Hz, that no unit aliases to a standstill."""
    slow = [pace for pace in paces if pace <= LINE_HZ[1]]
    while True:
        frequency = float(np.exp(random.uniform(*np.log(LINE_HZ))))
        if aliased and slow:
            pace = float(random.choice(slow))
            nearest = max(1.0, round(frequency / pace)) * pace
            frequency = nearest + float(random.choice([-1.0, 1.0]) * random.uniform(*ALIAS_HZ))
        margins = [min(CLEAR_HZ + wander * frequency, pace / 6.0) for pace in paces]
        apart = [abs(frequency - round(frequency / pace) * pace) for pace in paces]
        if all(one > other for one, other in zip(apart, margins, strict=True)):
            return frequency


def _stalls(random: np.random.Generator, duration: float, count: int) -> FloatArray:
    start = random.uniform(10.0, duration - 5.0, count)
    length = np.exp(random.uniform(np.log(STALL_SECONDS[0]), np.log(STALL_SECONDS[1]), count))
    return np.column_stack([start, start + length])
