"""Everything a simulated spin is made of: the robot, what it does, and the floors it does it on."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, field, fields
from typing import Literal, TypeAlias

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate.fault import AXES, Fault
from tumble.tools.simulate.grade import Grade, grade_names
from tumble.tools.simulate.scenario import (
    FASTEST_RATE_HZ,
    SLOWEST_RATE_HZ,
    STEEPEST_DEG,
    ScenarioError,
    Triple,
    is_finite,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

StepKind: TypeAlias = Literal["rest", "turn", "drive"]

SHORTEST_STEP = 0.1
"""s."""

_NUMBER = r"[-+]?\d+(?:\.\d+)?"
_FORMS: dict[StepKind, re.Pattern[str]] = {
    "rest": re.compile(rf"rest\s+(?P<seconds>{_NUMBER})"),
    "turn": re.compile(rf"(?P<turns>{_NUMBER})\s+turns?"),
    "drive": re.compile(
        rf"drive\s+(?P<seconds>{_NUMBER})(?:\s+tilt\s+(?P<floor_tilt_deg>{_NUMBER}))?"
        rf"(?:\s+uphill\s+(?P<uphill_deg>{_NUMBER}))?(?:\s+bend\s+(?P<bend_deg>{_NUMBER}))?"
    ),
}


@dataclass(frozen=True, slots=True)
class Step:
    """Next motion of the robot: `rest 5`, `3 turns`, `drive 8`, `drive 8 tilt 2 uphill 90 bend 45`."""

    kind: StepKind
    seconds: float = 0.0
    """Rest and drive."""
    turns: float = 0.0
    """Turn: counter-clockwise positive. Drive: bend on the way."""
    floor_tilt_deg: float | None = None
    """Drive: tilt of the floor at its end; as before if not given."""
    uphill_deg: float | None = None
    """Drive: uphill at its end, counter-clockwise from the first forward; as before if not given."""

    @classmethod
    def parse(cls, text: str) -> Step:
        """Reads one step; raises `ScenarioError` in one line."""
        for kind, form in _FORMS.items():
            if found := form.fullmatch(text.strip()):
                figures = {name: float(figure) for name, figure in found.groupdict().items() if figure}
                if "bend_deg" in figures:
                    figures["turns"] = figures.pop("bend_deg") / 360.0
                return cls(kind, **figures)
        raise ScenarioError(
            f"step {text.strip()!r} is not a step; write `rest 5`, `3 turns`, `-3 turns`, `drive 8` or "
            "`drive 8 tilt 2 uphill 90 bend 45` (deg), with commas between"
        )


@dataclass(frozen=True, slots=True)
class SimulatedDisturbance:
    """Something that lifts and tilts the robot for a while, and sets it down as it was."""

    start: float
    """s."""
    seconds: float
    tilt_deg: float = 0.0
    """Largest tilt, about the robot's left axis."""
    lift_m: float = 0.0
    """Largest height."""

    @classmethod
    def picked_up(cls, start: float) -> SimulatedDisturbance:
        """Lifts it by a hand's breadth, tilted, for two seconds."""
        return cls(start, 2.0, tilt_deg=12.0, lift_m=0.3)

    @classmethod
    def over_a_sill(cls, start: float) -> SimulatedDisturbance:
        """Pushes it over a sill of 2 cm."""
        return cls(start, 0.6, tilt_deg=4.0, lift_m=0.02)

    @classmethod
    def lifted(cls, start: float) -> SimulatedDisturbance:
        """Lifts it straight up by half a metre within two seconds."""
        return cls(start, 2.0, lift_m=0.5)


USUAL_PLAN = (Step("rest", 6.0), Step("turn", turns=3.0), Step("turn", turns=-3.0), Step("rest", 2.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class SpinScenario:
    """A wheeled robot that stands still, then turns on the spot."""

    seed: int = 1
    """All that is random follows from it, on every machine alike."""

    plan: Sequence[Step] = USUAL_PLAN
    turn_rate: float = 1.0
    """rad/s, once the robot has got up to it."""
    turn_acceleration: float = 2.0
    """rad/s^2 at most, while it gets up to it and stops; unevenness and slips come on top."""
    drive_speed: float = 0.5
    """m/s."""
    unevenness: float = 0.0
    """Share by which the rate goes up and down, as of wheels out of round."""
    unevenness_hz: float = 0.9
    """Frequency of the unevenness at full rate."""
    slips: float = 0.0
    """Slips of the wheels a turn, each a dip of the rate: the robot turns less than its wheels do."""
    slow_turn: float = 0.0
    """rad/s that the robot turns with while it seems to stand still before the first turn."""
    vibration: float = 0.0
    """m/s^2 while the motors run."""
    disturbances: Sequence[SimulatedDisturbance] = ()

    floor_tilt_deg: float = 1.0
    uphill_deg: float = 40.0
    """Counter-clockwise from forward, at the first heading."""
    roll_deg: float = 3.0
    pitch_deg: float = -2.0
    yaw_deg: float = 0.0
    """Mounting of the IMU in the robot: floor_from_case = R_z(yaw) R_y(pitch) R_x(roll)."""
    lever_arm_m: Triple = (0.10, -0.06, 0.0)
    """The IMU from the turning axis: forward, left, up."""

    grade: str | Grade = "consumer"
    accelerometer_noise: float | None = None
    """Noise of one sample, m/s^2; that of the grade if not given."""
    gyroscope_noise: float | None = None
    """Noise of one sample, rad/s."""
    accelerometer_bias: Triple | None = None
    """m/s^2; drawn from the grade if not given."""
    gyroscope_bias: Triple | None = None
    """rad/s."""
    matrix_errors: float = 0.0
    """Share of the grade's scale, non-orthogonality and alignment errors: 0 is a unit calibrated before."""
    gyroscope_scale: float = 0.0
    """Scale error of the gyroscope."""
    accelerometer_range: float | None = None
    """m/s^2; that of the grade if not given."""
    bias_instability: bool = True
    quantisation: bool = True
    rate_hz: float = 100.0
    """Samples a second."""
    faults: Sequence[Fault] = field(default=())
    """Faults of the recording; times in s."""

    gravity: float = STANDARD_GRAVITY
    """m/s^2."""
    latitude_deg: float | None = None
    """Sets the Earth's rate, for a robot that faces north at first; `None` for none."""
    temperature_celsius: float = 25.0

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        for objection in self._objections():
            raise ScenarioError(objection)
        refuse_beyond_bounds(**stated_by(self))

    def _objections(self) -> Iterator[str]:
        if isinstance(self.grade, str) and self.grade not in grade_names():
            yield f"unknown grade {self.grade!r}; known are {', '.join(grade_names())}"
        if not self.plan:
            yield "the plan has no step; give at least a rest and a turn"
        for step in self.plan:
            yield from _step_objections(step)
        for each in fields(self):
            if not is_finite(getattr(self, each.name)):
                yield f"{each.name} is {getattr(self, each.name)}; give finite numbers"
        for name in ("turn_rate", "turn_acceleration", "unevenness_hz", "gravity", "accelerometer_range"):
            if (value := getattr(self, name)) is not None and not value > 0.0:
                yield f"{name} is {value:g}; make it positive"
        not_negative = (
            "accelerometer_noise",
            "gyroscope_noise",
            "slips",
            "vibration",
            "matrix_errors",
            "drive_speed",
        )
        for name in not_negative:
            if (value := getattr(self, name)) is not None and not value >= 0.0:
                yield f"{name} is {value:g}; make it zero or more"
        for name in ("lever_arm_m", "accelerometer_bias", "gyroscope_bias"):
            if (vector := getattr(self, name)) is not None and len(vector) != len(AXES):
                yield f"{name} has {len(vector)} numbers; give one for each of x, y and z"
        if not 0.0 <= self.unevenness < 1.0:
            yield f"unevenness is {self.unevenness:g}; give a share from 0 to below 1"
        if not SLOWEST_RATE_HZ <= self.rate_hz <= FASTEST_RATE_HZ:
            limits = f"{SLOWEST_RATE_HZ:g} to {FASTEST_RATE_HZ:g}"
            yield f"rate_hz is {self.rate_hz:g}; give {limits} samples a second"
        if not 0.0 <= self.floor_tilt_deg < STEEPEST_DEG:
            yield f"floor_tilt_deg is {self.floor_tilt_deg:g}; give 0 to {STEEPEST_DEG:g} deg"
        if not -1.0 < self.gyroscope_scale < 1.0:
            yield f"gyroscope_scale is {self.gyroscope_scale:g}; give the error, such as 0.01 for 1 %"
        if self.latitude_deg is not None and not -90.0 <= self.latitude_deg <= 90.0:
            yield f"latitude_deg is {self.latitude_deg:g}; give -90 to 90 deg"
        for each_time in self.disturbances:
            if not all(math.isfinite(figure) for figure in astuple(each_time)):
                yield f"{each_time} holds a number that is not finite"
            if each_time.start < 0.0:
                yield f"a disturbance at {each_time.start:g} s, before the recording; give a time from 0 on"
            if not each_time.seconds >= SHORTEST_STEP:
                yield f"a disturbance of {each_time.seconds:g} s; make it {SHORTEST_STEP:g} s or longer"

    @property
    def unit_grade(self) -> Grade:
        """Returns the grade by its figures."""
        return Grade.named(self.grade) if isinstance(self.grade, str) else self.grade


def parse_plan(text: str) -> tuple[Step, ...]:
    """Reads `rest 5, 3 turns, -3 turns, rest 2`; raises `ScenarioError` in one line."""
    return tuple(Step.parse(part) for part in text.split(",") if part.strip())


def _step_objections(step: Step) -> Iterator[str]:
    if step.kind != "turn" and not SHORTEST_STEP <= step.seconds < math.inf:
        yield f"a {step.kind} of {step.seconds:g} s; make it {SHORTEST_STEP:g} s or longer"
    if step.kind == "turn" and not 0.0 < abs(step.turns) < math.inf:
        yield f"a turn of {step.turns:g} turns; give how often, counter-clockwise positive"
    if step.floor_tilt_deg is not None and not 0.0 <= step.floor_tilt_deg < STEEPEST_DEG:
        yield f"a drive to a floor that tilts by {step.floor_tilt_deg:g} deg; give 0 to {STEEPEST_DEG:g} deg"
    if not is_finite((step.turns, step.uphill_deg or 0.0)):
        yield f"a {step.kind} with a number that is not finite; give finite numbers"
