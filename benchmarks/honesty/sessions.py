"""Sessions of each procedure without imperfection."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.honesty.motion import (
    FloatArray,
    Motion,
    Segment,
    attitude_after,
    attitude_with_up,
    turned_by,
    visits,
)
from benchmarks.honesty.session import (
    AXES,
    FLICKER,
    STATED,
    TRIADS,
    TURN_RATE,
    WALK,
    WHITE,
    Relation,
    Session,
    Unit,
    drawn_unit,
)

FACES = np.array([[0, 0, 1], [1, 0, 0], [0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
"""(6, 3) directions that point up, each a quarter of a turn from the one before."""
LIKE_THE_LAST = np.radians(30.0)
"""rad between two orientations that a hand takes for different ones."""


def by_hand(rng: np.random.Generator) -> Session:
    """A unit held still in eighteen orientations."""
    ups: list[FloatArray] = []
    while len(ups) < 18:
        up = rng.normal(size=3)
        up /= np.linalg.norm(up)
        if not ups or abs(up @ ups[-1]) < np.cos(LIKE_THE_LAST):
            ups.append(up)
    attitudes = [attitude_with_up(ups[0], float(rng.uniform(0.0, 2.0 * np.pi)))]
    for up in ups[1:]:
        attitudes.append(attitude_after(attitudes[-1], up, float(rng.uniform(-0.5, 0.5))))
    segments = visits(attitudes, float(rng.uniform(3.0, 5.0)), TURN_RATE)
    return Session("multipose", rng, segments, attitudes[0], [drawn_unit("imu", rng)])


def on_table(rng: np.random.Generator) -> Session:
    """A target beside a reference on a table that shows six faces, twice."""
    attitudes = [attitude_with_up(FACES[0], 0.0)]
    for up in [*FACES[1:], *FACES]:
        attitudes.append(_tipped(attitude_after(attitudes[-1], up, 0.0), rng, np.radians(0.02)))
    segments = visits(attitudes, float(rng.uniform(4.0, 6.0)), TURN_RATE)
    reference = drawn_unit("reference", rng, grade=0.0)
    reference.bias = {"accelerometer": rng.normal(0.0, 1e-3, 3), "gyroscope": rng.normal(0.0, 1e-5, 3)}
    reference.noise = {"accelerometer": 0.002, "gyroscope": 0.0002}
    return Session("turntable", rng, segments, attitudes[0], [reference, drawn_unit("target", rng)])


def _tipped(attitude: FloatArray, rng: np.random.Generator, sigma: float) -> FloatArray:
    tipped: FloatArray = attitude @ turned_by(rng.normal(0.0, sigma, 3), np.ones(1))[0]
    return tipped


def on_the_spot(rng: np.random.Generator) -> Session:
    """A robot that stands, turns three times each way on a tilted floor, and stands again."""
    up = np.array([*rng.normal(0.0, np.radians(2.0), 2), 1.0])
    up /= np.linalg.norm(up)
    floor = _tipped(np.eye(3), rng, np.radians(0.7))
    mounted = attitude_with_up(up, float(rng.uniform(0.0, 2.0 * np.pi)))
    start = floor @ mounted
    turns = float(rng.uniform(2.0, 3.0)) * 2.0 * np.pi
    seconds = turns / TURN_RATE
    # The robot turns about the vertical of the floor, here in body axes.
    axis = mounted.T @ np.array([0.0, 0.0, 1.0])
    segments = [Segment(6.0, np.zeros(3), 0)]
    for sign in (1.0, -1.0):
        segments += [Segment(seconds, sign * turns * axis, -1), Segment(3.0, np.zeros(3), len(segments))]
    unit = drawn_unit("imu", rng, grade=1.0)
    # Without equipment before it, its scale and angles are within what the procedure assumes.
    unit.matrix = {triad: np.eye(3) for triad in unit.matrix}
    session = Session("spin", rng, segments, start, [unit])
    session.lever_arm = np.array([*rng.normal(0.0, 0.05, 2), 0.0])
    return session


def at_rest(rng: np.random.Generator) -> Session:
    """A unit that lies still for a quarter of an hour, with white noise, flicker and random walk."""
    attitude = attitude_with_up(rng.normal(size=3), float(rng.uniform(0.0, 2.0 * np.pi)))
    unit = drawn_unit("imu", rng)
    session = Session(
        "noise", rng, [Segment(float(rng.uniform(600.0, 1500.0)), np.zeros(3), 0)], attitude, [unit], 50.0
    )
    session.words, unit.head = ["--json"], STATED
    for triad in TRIADS:
        white = np.full(3, unit.noise[triad] / np.sqrt(session.rate_hz))
        unit.terms[triad, WHITE] = white
        unit.terms[triad, FLICKER] = white * np.exp(rng.uniform(np.log(3e-3), np.log(0.5), 3))
        unit.terms[triad, WALK] = white * np.exp(rng.uniform(np.log(1e-4), np.log(0.05), 3))
    unit.reads.append(_slow_noise(unit, rng))
    return session


def _slow_noise(
    unit: Unit, rng: np.random.Generator
) -> Callable[[Motion, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Flicker of two-sided spectrum B^2 / (2 pi f), and random walk of K per root second."""

    def noisy(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        step = float(motion.time[1] - motion.time[0])
        out = []
        for triad, values in zip(TRIADS, (force, rate), strict=True):
            flicker = unit.terms[triad, FLICKER] * _flicker(len(values), step, rng)
            walk = np.cumsum(rng.normal(0.0, np.sqrt(step), (len(values), 3)), axis=0)
            out.append(values + flicker + unit.terms[triad, WALK] * walk)
        return out[0], out[1]

    return noisy


def _flicker(count: int, step: float, rng: np.random.Generator) -> FloatArray:
    """(count, 3) flicker of strength 1, out of four times as long a record."""
    length = 4 * count
    frequency = np.fft.rfftfreq(length, step)[1:]
    size = np.sqrt(length / (2.0 * np.pi * frequency * step) / 2.0)[:, None]
    drawn = size * (rng.normal(size=(len(size), 3)) + 1j * rng.normal(size=(len(size), 3)))
    record: FloatArray = np.fft.irfft(np.vstack([np.zeros((1, 3)), drawn]), length, axis=0)
    return record[:count]


REFERENCE = 25.0
"""degC about which drift is drawn."""


def through_temperatures(rng: np.random.Generator) -> Session:
    """A unit that lies still for an hour in a box that warms and cools."""
    low, high = float(rng.uniform(-10.0, 10.0)), float(rng.uniform(40.0, 70.0))
    attitude = attitude_with_up(rng.normal(size=3), float(rng.uniform(0.0, 2.0 * np.pi)))
    unit = drawn_unit("imu", rng)
    session = Session("thermal", rng, [Segment(3600.0, np.zeros(3), 0)], attitude, [unit], 5.0)
    session.words = ["--json"]
    unit.head = f"{STATED},temperature"
    unit.thermometer.append(lambda motion, _: temperature(motion, low, high))
    for triad, slope in zip(TRIADS, (1e-3, 1e-4), strict=True):
        drawn = rng.normal(size=(3, 3)) * slope * np.array([[1.0], [5e-3], [3e-5]])
        for k, axis in enumerate(AXES):
            powers = drawn[:, k]
            unit.thermal[f"{triad} {axis}", "bias per K"] = lambda at, c=powers: float(  # type: ignore[misc]
                c[0] + 2.0 * c[1] * (at - REFERENCE) + 3.0 * c[2] * (at - REFERENCE) ** 2
            )
            unit.thermal[f"{triad} {axis}", "mean hysteresis"] = lambda _: 0.0
        white = np.full(3, unit.noise[triad] / np.sqrt(session.rate_hz))
        unit.terms[triad, FLICKER] = 0.03 * white
        unit.terms[triad, WALK] = 1e-4 * white
        unit.reads.append(_drift(triad, drawn, low, high))
    unit.reads.append(_slow_noise(unit, rng))
    return session


def temperature(motion: Motion, low: float, high: float) -> FloatArray:
    """(n,) degC: from the lowest to the highest and back."""
    turn = 2.0 * np.pi * motion.time / motion.time[-1]
    warmth: FloatArray = low + (high - low) * 0.5 * (1.0 - np.cos(turn))
    return warmth


def _drift(
    triad: str, powers: FloatArray, low: float, high: float
) -> Callable[[Motion, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    def drifted(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        above = (temperature(motion, low, high) - REFERENCE)[:, None]
        drift = powers[0] * above + powers[1] * above**2 + powers[2] * above**3
        return (force + drift, rate) if triad == TRIADS[0] else (force, rate + drift)

    return drifted


def on_one_body(rng: np.random.Generator) -> Session:
    """Two units on one body, which lies still, is turned and pushed about by hand, and lies still."""
    attitude = attitude_with_up(rng.normal(size=3), 0.0)
    segments = [Segment(6.0, np.zeros(3), 0)]
    for _ in range(60):
        axis = rng.normal(size=3)
        turn = float(rng.uniform(0.3, 1.2)) * axis / np.linalg.norm(axis)
        segments.append(Segment(float(rng.uniform(0.4, 1.2)), turn, -1))
    segments.append(Segment(6.0, np.zeros(3), 1))
    primary, secondary = drawn_unit("primary", rng), drawn_unit("secondary", rng)
    axis = rng.normal(size=3)
    mounted = turned_by(axis / np.linalg.norm(axis) * float(rng.uniform(0.0, 3.0)), np.ones(1))[0]
    stretch = np.diag(1.0 + rng.normal(0.0, 0.005, 3))
    primary.matrix = {triad: np.eye(3) for triad in TRIADS}
    # Rotation and lever arm are found beside a gyroscope whose scale is not known.
    secondary.matrix = {TRIADS[0]: mounted, TRIADS[1]: stretch @ mounted}
    session = Session("align", rng, segments, attitude, [primary, secondary])
    session.words, session.roles = ["--json"], ("--primary", "--secondary")
    session.between = Relation(
        mounted, rng.uniform(-0.15, 0.15, 3), float(rng.uniform(-0.5, 0.5)), float(rng.normal(0.0, 2e-5))
    )
    frequency, phase = rng.uniform(0.2, 2.5, (6, 3)), rng.uniform(0.0, 2.0 * np.pi, (6, 3))

    def pushed(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = 2.0 * np.pi * frequency * motion.time[:, None, None] + phase
        # A hand begins and ends gently.
        held = np.convolve(motion.pose < 0, np.hanning(51) / np.hanning(51).sum(), "same") * (motion.pose < 0)
        return force + 0.6 * held[:, None] * np.sin(turn).sum(axis=1), rate

    def elsewhere(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        arm = session.between.lever_arm
        pull = np.cross(motion.acceleration, arm) + np.cross(motion.rate, np.cross(motion.rate, arm))
        return force + pull, rate

    primary.sees.append(pushed)
    secondary.sees += [pushed, elsewhere]
    secondary.stamps.append(session.between.stamped)
    return session


SESSIONS: dict[str, Callable[[np.random.Generator], Session]] = {
    "multipose": by_hand,
    "turntable": on_table,
    "spin": on_the_spot,
    "noise": at_rest,
    "thermal": through_temperatures,
    "align": on_one_body,
}
"""Session of each procedure without imperfection."""
