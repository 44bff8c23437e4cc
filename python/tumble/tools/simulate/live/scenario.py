"""Everything a live bench is made of: its motion, the units on it, and their lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias, get_args

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate.grade import Grade, grade_names
from tumble.tools.simulate.live.fault import LiveFault
from tumble.tools.simulate.scenario import (
    FASTEST_RATE_HZ,
    SLOWEST_RATE_HZ,
    ScenarioError,
    Triple,
    is_finite,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

Motion: TypeAlias = Literal["table", "six-faces", "hand", "spin", "flight"]
TransportName: TypeAlias = Literal["udp", "pty", "tcp", "mavlink"]

MOTIONS: dict[Motion, str] = {
    "table": "a rate table, commanded over TCP",
    "six-faces": "units turned by hand, face after face",
    "hand": "one unit in a hand, which turns it from orientation to orientation",
    "spin": "a robot that stands still, then turns on the spot",
    "flight": "a redundant set on a quadrotor",
}
MOST_UNITS = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveScenario:
    """Units that are served live, as they move."""

    seed: int = 1
    """All that is random follows from it."""
    motion: Motion = "table"
    grades: Sequence[str | Grade] = ()
    """One unit each, the first being the reference, or the primary; what is usual if none is given."""
    rate_hz: float = 200.0
    """Samples a second of every unit, by its own clock."""
    rest_seconds: float = 10.0
    """Duration of the first rest, and of that at every face or orientation; a table rests until it has a
    command."""
    lever_arm_m: Mapping[str, Triple] = field(default_factory=dict)
    """Places of units on a table against the turning centre, m, case frame; at the centre if not given."""
    table_profile: str = "scpi"
    """Words that the table understands, and what its axes may do."""
    told: bool = False
    """Indicates whether a hand turns only on request."""

    transport: TransportName = "udp"
    host: str = "127.0.0.1"
    """Address to which datagrams go, and at which TCP is served."""
    port: int = 9000
    """Port of the first unit, the next one's is one more; 0 for any free ones."""
    table_port: int = 5025
    """Port of the table; 0 for a free one."""

    clock_offset_seconds: float = 5.0
    """Offset of each clock but the first, uniform up to this much either way."""
    clock_skew_ppm: float = 50.0
    """Skew, 1 sigma."""
    delay_seconds: float = 0.002
    """Delay of every sample on its way."""
    jitter_seconds: float = 0.001
    """Mean of the additional delay of a sample, which has an exponential distribution."""
    batch_seconds: float = 0.0
    """Samples that are sent together: all of so many s; 0 for each alone."""
    faults: Mapping[str, Sequence[LiveFault]] = field(default_factory=dict)
    """Faults of each unit, by its name."""

    speed: float = 1.0
    """Simulated s in a second of this machine's clock."""
    duration_seconds: float | None = None
    """Duration; by default that of the motion, and unlimited on a table."""
    gravity: float = STANDARD_GRAVITY
    """m/s^2."""

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        for objection in self._objections():
            raise ScenarioError(objection)
        refuse_beyond_bounds(**stated_by(self))

    def _objections(self) -> Iterator[str]:
        for each in fields(self):
            if not is_finite(getattr(self, each.name)):
                yield f"{each.name} is {getattr(self, each.name)}; give finite numbers"
        if self.motion not in get_args(Motion):
            yield f"unknown motion {self.motion!r}; known are {', '.join(get_args(Motion))}"
        if self.transport not in get_args(TransportName):
            yield f"unknown transport {self.transport!r}; known are {', '.join(get_args(TransportName))}"
        for grade in self.grades:
            if isinstance(grade, str) and grade not in grade_names():
                yield f"unknown grade {grade!r}; known are {', '.join(grade_names())}"
        if len(self.grades) > MOST_UNITS:
            yield f"{len(self.grades)} units; {MOST_UNITS} at most"
        if not SLOWEST_RATE_HZ <= self.rate_hz <= FASTEST_RATE_HZ:
            limits = f"{SLOWEST_RATE_HZ:g} to {FASTEST_RATE_HZ:g}"
            yield f"rate_hz is {self.rate_hz:g}; give {limits} samples a second"
        for name in ("speed", "gravity", "rest_seconds", "duration_seconds"):
            if (value := getattr(self, name)) is not None and not value > 0.0:
                yield f"{name} is {value:g}; make it positive"
        for name in (
            "clock_offset_seconds",
            "clock_skew_ppm",
            "delay_seconds",
            "jitter_seconds",
            "batch_seconds",
        ):
            if not getattr(self, name) >= 0.0:
                yield f"{name} is {getattr(self, name):g}; make it zero or more"
        for name, most in (("port", (1 << 16) - MOST_UNITS), ("table_port", (1 << 16) - 1)):
            if not 0 <= getattr(self, name) <= most:
                yield f"{name} is {getattr(self, name)}; give 0 to {most}"

    @property
    def usual_grades(self) -> tuple[str | Grade, ...]:
        """Returns the grades, those that are usual where none were given."""
        if self.grades:
            return tuple(self.grades)
        match self.motion:
            case "spin" | "hand":
                return ("consumer",)
            case "flight":
                return ("industrial", "consumer", "consumer")
        return ("reference", "consumer", "industrial", "tactical")

    @property
    def uptime(self) -> float:
        """For how long the units were on before it begins, s: no clock shows less than nothing."""
        return 1.0 + self.clock_offset_seconds

    @property
    def end(self) -> float:
        """Latest time of the end, s."""
        return math.inf if self.duration_seconds is None else self.duration_seconds
