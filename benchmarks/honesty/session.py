"""Sessions as users have them: a motion, units with errors, a file each, and the words that are typed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.honesty.motion import FloatArray, Motion, Segment, moved

TURN_RATE = 1.0
"""rad/s, mean of a turn."""
AXES = "xyz"
TRIADS = ("accelerometer", "gyroscope")
WHITE, FLICKER, WALK = "white noise", "bias instability", "random walk"
"""Terms of noise by the words of results."""


UNNAMED = "time,ax,ay,az,gx,gy,gz"
STATED = "time,ax,ay,az,gx [rad/s],gy [rad/s],gz [rad/s]"
"""Heads of a file: a unit that moves shows by itself whether it is in rad/s."""


@dataclass
class Unit:
    """An inertial sensor: y = M u + b + noise, and what makes it depart from that."""

    name: str
    matrix: dict[str, FloatArray]
    """(3, 3) M of each triad."""
    bias: dict[str, FloatArray]
    """(3,) m/s^2 and rad/s."""
    noise: dict[str, float]
    """Standard deviation of a sample."""
    sees: list[Callable[[Motion, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]] = field(
        default_factory=list
    )
    """Changes of the force and rate that reach the sensor, (n, 3) each."""
    reads: list[Callable[[Motion, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]] = field(
        default_factory=list
    )
    """Changes of what it reads, (n, 3) each."""
    rounds: list[Callable[[Motion, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]] = field(
        default_factory=list
    )
    """Roundings of that, behind all else."""
    stamps: list[Callable[[FloatArray], FloatArray]] = field(default_factory=list)
    """Changes of its time stamps, (n,) s."""
    clock: tuple[FloatArray, FloatArray] = field(default_factory=lambda: (np.zeros(0), np.zeros(0)))
    """True times of the samples that were written, and their stamps, (n,) s."""
    rows: list[Callable[[list[str]], list[str]]] = field(default_factory=list)
    """Changes of the lines of its file, without the head."""
    head: str = UNNAMED
    is_filtered: bool = False
    """True if its readings are behind the motion."""
    decimals: tuple[int, int] = (9, 9)
    """Decimals of forces and rates in the file."""
    scale: tuple[float, float] = (1.0, 1.0)
    """Unit of the file over m/s^2 and rad/s."""
    drift: dict[str, FloatArray] = field(default_factory=dict)
    """(3,) mean of what imperfections add to the bias, which is part of the truth."""

    terms: dict[tuple[str, str], FloatArray] = field(default_factory=dict)
    """(3,) each term of noise, by triad and name, SI units."""
    thermal: dict[tuple[str, str], Callable[[float], float]] = field(default_factory=dict)
    """Each parameter of the drift at a temperature, degC, by channel and name."""
    thermometer: list[Callable[[Motion, FloatArray], FloatArray]] = field(default_factory=list)
    """Readings of its thermometer, then changes of them, (n,) degC; none without a thermometer."""

    def late_at(self, time: float) -> FloatArray:
        """(m,) s by which stamps within two seconds of a true time are behind, without those that repeat."""
        true, stamped = self.clock
        near = (np.abs(true - time) < 2.0) & (np.diff(stamped, prepend=-np.inf) > 0.0)
        return (true - stamped)[near]

    def true_bias(self, triad: str) -> FloatArray:
        """(3,) bias, as a mean over the recording."""
        return self.bias[triad] + self.drift.get(triad, np.zeros(3))


@dataclass(frozen=True)
class Relation:
    """Place of a second unit beside the first, and its clock."""

    rotation: FloatArray
    """(3, 3) second from first."""
    lever_arm: FloatArray
    """(3,) m, from the first to the second, in the axes of the first."""
    offset: float
    """s to be added to the second's time, at its zero."""
    skew: float
    """Growth of the offset."""

    def stamped(self, time: FloatArray) -> FloatArray:
        """(n,) s by the second's clock at times of the first's."""
        return time - self.offset - self.skew * time


@dataclass
class Session:
    """One session of a procedure."""

    procedure: str
    rng: np.random.Generator
    segments: list[Segment]
    start: FloatArray
    """(3, 3) world from body at the begin."""
    units: list[Unit]
    rate_hz: float = 100.0
    words: list[str] = field(default_factory=list)
    """Options that are typed."""
    between: Relation = field(default_factory=lambda: Relation(np.eye(3), np.zeros(3), 0.0, 0.0))
    """Truth of two units on one body."""
    roles: tuple[str, ...] = ()
    """Option that names the file of each unit; none where files are arguments."""
    lever_arm: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) m from the axis of the robot to the sensor, in body axes."""
    plans: list[Callable[[list[Segment]], list[Segment]]] = field(default_factory=list)
    """Changes of what the person does."""

    def write(self, folder: Path) -> list[str]:
        """Writes the files; returns the command as it is typed."""
        segments = self.segments
        for plan in self.plans:
            segments = plan(segments)
        motion = moved(segments, self.start, self.rate_hz)
        force = motion.force + np.cross(motion.acceleration, self.lever_arm)
        force += np.cross(motion.rate, np.cross(motion.rate, self.lever_arm))
        files = []
        for k, unit in enumerate(self.units):
            path = folder / f"{unit.name}.csv"
            path.write_text(_text(unit, motion, force, self.rng))
            files += [*self.roles[k : k + 1], str(path)]
        return [self.procedure, *files, *self.words, "-o", str(folder / "out")]


def _text(unit: Unit, motion: Motion, force: FloatArray, rng: np.random.Generator) -> str:
    seen = force.copy(), motion.rate.copy()
    for change in unit.sees:
        seen = change(motion, *seen)
    read = tuple(
        seen[k] @ unit.matrix[triad].T + unit.bias[triad] + rng.normal(0.0, unit.noise[triad], seen[k].shape)
        for k, triad in enumerate(("accelerometer", "gyroscope"))
    )
    for change in (*unit.reads, *unit.rounds):
        read = change(motion, *read)
    time = motion.time.copy()
    for stamp in unit.stamps:
        time = stamp(time)
    unit.clock = motion.time, time
    figures = [f"%.{places}f" for places in unit.decimals for _ in range(3)]
    values = [unit.scale[0] * read[0], unit.scale[1] * read[1]]
    if unit.thermometer:
        shown = np.zeros(len(time))
        for change_shown in unit.thermometer:
            shown = change_shown(motion, shown)
        values, figures = [*values, shown], [*figures, "%.4f"]
    form = ",".join(["%.6f", *figures])
    rows = [form % tuple(row) for row in np.column_stack([time, *values]).tolist()]
    for change_rows in unit.rows:
        rows = change_rows(rows)
    return "\n".join([unit.head, *rows, ""])


def drawn_unit(name: str, rng: np.random.Generator, grade: float = 1.0) -> Unit:
    """A unit of a consumer's grade, or of a share of its errors."""

    def matrix(scale: float, angle: float) -> FloatArray:
        return np.eye(3) + np.diag(rng.normal(0.0, scale, 3)) + rng.normal(0.0, angle, (3, 3))

    return Unit(
        name,
        {
            "accelerometer": matrix(0.01 * grade, np.radians(0.3) * grade),
            "gyroscope": matrix(0.01 * grade, np.radians(0.3) * grade),
        },
        {"accelerometer": rng.normal(0.0, 0.2 * grade, 3), "gyroscope": rng.normal(0.0, 0.02 * grade, 3)},
        {
            "accelerometer": 0.02 * float(rng.uniform(0.5, 2.0)),
            "gyroscope": 0.002 * float(rng.uniform(0.5, 2.0)),
        },
    )
