"""Coverage of spins that are not as the model has them: wheels that slip, fast turns, coarse gyroscopes.

`python -m benchmarks.spin_disturbed [--sessions 200]`

Robot and sensors are those of `spin_session`, in numpy; what disturbs them is added here.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from rich.console import Console

from benchmarks.results import Content, machine, save
from benchmarks.spin import estimates
from benchmarks.spin_bound import GROUPS, quantities
from benchmarks.spin_session import Course, Motion, PlayedSpin, fit, play
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL

BASE_SEED = 52_000
COVERAGE = (0.93, 1.0)
"""Wide intervals are no fault where something slips."""
NOT_SHOWN = {("slips along itself, one way", "lever arm")}
"""A robot that slips along itself turns about another point, and nothing shows that."""
SLIP = 0.1
"""m/s."""
TILT = float(np.radians(1.0))
QUIET = 0.02
"""Share of a step of a coarse gyroscope that its noise is, 1-sigma."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Disturbances of a session beside the motion."""

    slip: float = 0.0
    """m/s, sideways or ahead as drawn, as soon as the robot turns at half its speed."""
    with_robot: bool = False
    """Indicates whether the slip keeps its direction on the robot, not on the floor."""
    step: float = 0.0
    """rad/s: resolution of the gyroscope; zero for none."""


def cells() -> dict[str, tuple[Motion, Disturbance]]:
    """Returns all rows of the table by name."""
    ways = {"one way": (3.0,), "both ways": (3.0, -3.0)}
    found: dict[str, tuple[Motion, Disturbance]] = {}
    for way, turns in ways.items():
        usual = Motion(turns=turns, tilt=TILT)
        found[f"1 rad/s, {way}"] = usual, Disturbance()
        found[f"4 rad/s, {way}"] = Motion(turns=turns, tilt=TILT, speed=4.0), Disturbance()
        found[f"slips along the floor, {way}"] = usual, Disturbance(slip=SLIP)
        found[f"slips along itself, {way}"] = usual, Disturbance(slip=SLIP, with_robot=True)
        for step in (0.01, 0.03, 0.1):
            found[f"gyroscope in steps of {step:g} rad/s, {way}"] = usual, Disturbance(step=step)
    return found


def slipping(course: Course, velocity: FloatArray, with_robot: bool) -> FloatArray:
    """(n, 2) acceleration, forward and left on the robot, m/s^2, of a robot that slips with this velocity.

    A velocity that turns with the robot is accelerated by the rate times it, across it.
    """
    share = np.minimum(np.abs(course.rate) / (0.5 * np.abs(course.rate).max()), 1.0)
    slip = 0.5 * (1.0 - np.cos(np.pi * share))[:, None] * velocity
    change = np.gradient(slip, course.time, axis=0)
    ahead, left = change[:, 0], change[:, 1]
    if with_robot:
        return np.stack([ahead - course.rate * slip[:, 1], left + course.rate * slip[:, 0]], axis=1)
    cosine, sine = np.cos(course.heading), np.sin(course.heading)
    return np.stack([cosine * ahead + sine * left, cosine * left - sine * ahead], axis=1)


def disturb(played: PlayedSpin, disturbance: Disturbance, random: np.random.Generator) -> None:
    """Puts the disturbance into the readings of a session."""
    bearing = random.uniform(-np.pi, np.pi)
    if disturbance.slip:
        velocity = disturbance.slip * np.array([np.cos(bearing), np.sin(bearing)])
        moved = slipping(played.course, velocity, disturbance.with_robot)
        played.accelerometer[:] = played.accelerometer + moved @ played.unit.floor[:2]
    if disturbance.step:
        played.gyroscope[:] = disturbance.step * np.round(played.gyroscope / disturbance.step)


def judged(motion: Motion, disturbance: Disturbance, seed: tuple[int, int]) -> tuple[FloatArray, bool]:
    """(13,) errors over sigma of the quantities of a session, and whether sigmas were widened.

    Raises `CoreError` where the session is refused.
    """
    random = np.random.default_rng([BASE_SEED, *seed])
    noise = QUIET * disturbance.step
    played = play(motion, random, noise=(0.02, noise)) if noise else play(motion, random)
    disturb(played, disturbance, random)
    found = fit(played)
    value, sigma = estimates(found)
    return (value - quantities(played.unit)) / sigma, found["widening"] > 1.0


def row(name: str, number: int, sessions: int) -> Content:
    """Returns the figures of one row."""
    motion, disturbance = cells()[name]
    one = partial(judged, motion, disturbance)
    outcomes = []
    for session in range(sessions):
        try:
            outcomes.append(one((number, session)))
        except _core.CoreError:
            continue
    off = np.abs([errors for errors, _ in outcomes])
    return {
        "name": name,
        "refused": sessions - len(outcomes),
        "said": float(np.mean([said for _, said in outcomes])),
        "groups": {group: held(off[:, columns]) for group, columns in GROUPS.items()},
    }


def held(off: FloatArray) -> Content:
    """Share of the known errors that intervals hold, share within three sigma, and the largest, in sigma."""
    known = off[np.isfinite(off)]
    if not known.size:
        return {"coverage": None, "within_three": None, "largest": None}
    return {
        "coverage": float((known <= INTERVAL).mean()),
        "within_three": float((known <= 3.0).mean()),
        "largest": float(known.max()),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=200, help="simulated sessions a row")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console(width=220)
    console.print(f"{len(cells())} rows of {options.sessions} sessions, seeds from {BASE_SEED}")
    rows: list[Content] = []
    for number, name in enumerate(cells()):
        rows.append(row(name, number, options.sessions))
        console.print(rows[-1])
    if not options.no_save:
        content: Content = {"machine": machine(), "sessions": options.sessions, "rows": rows}
        console.print(f"written to {save('spin_disturbed', content)}")


if __name__ == "__main__":
    main()
