"""Everything a simulated turntable session is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias, TypeVar

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.grade import Grade, grade_names
from tumble.tools.simulate.scenario import (
    ScenarioError,
    Triple,
    is_finite,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

USUAL_RATE = 200.0
"""Hz, of a unit that a mapping leaves out."""
USUAL_MOUNTING = 1.0
"""deg, of a target that a mapping leaves out."""
REFERENCE = "reference"
"""Name of the reference among the units."""

RotationDeg: TypeAlias = float | Triple
"""A rotation vector in deg, or an angle in deg about an axis drawn uniformly over the sphere."""
Value = TypeVar("Value")
PerUnit: TypeAlias = Value | Mapping[str, Value]
"""One value for all units, or one by name: `reference`, `target_1`, `target_2` ..."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurntableScenario:
    """One reference and its targets on one structure, turned from rest to rest."""

    seed: int = 1
    """All that is random follows from it, on every machine alike."""

    grades: Sequence[str | Grade] = ("consumer", "industrial", "tactical")
    """One target each."""
    reference: str | Grade = "reference"
    perfect_reference: bool = False
    """Indicates whether the reference has bias and noise only: scale, non-orthogonality and alignment are
    exact."""
    rate_hz: PerUnit[float] = USUAL_RATE
    """Samples a second."""
    target_mounting_deg: PerUnit[RotationDeg] = USUAL_MOUNTING
    """Package of a target against the case of the reference."""
    lever_arm_m: Mapping[str, Triple] = field(default_factory=dict)
    """Place of a unit against the turning centre, m, case frame; at the centre if not given."""
    bias_instability: bool = True
    """Indicates whether noise has bias instability beside its white part."""
    quantisation: bool = True
    """Indicates whether outputs are quantised."""
    g_sensitivity: bool = True
    """Indicates whether gyroscopes respond to specific force."""
    faults: Mapping[str, Fault | Sequence[Fault]] = field(default_factory=dict)
    """Faults of each unit, by its name."""

    magnetometer: bool = False
    """Indicates whether all units have a magnetometer."""
    field_strength: float = 48.0
    """Strength of the Earth's field, uT."""
    dip_deg: float = 65.0
    """Angle by which it points below the horizon, to the north."""
    field_noise: float = 0.3
    """Noise of a sample of a magnetometer, uT."""
    field_difference: float = 0.0
    """uT eastwards that the field at the targets has more than at the reference, by steel of the room."""
    disturbed: int = 0
    """Number of the rest at which a magnet is near; 0 for none."""

    poses: PoseList = SIX_FACES
    """Poses that the table is commanded to, and that `poses.yaml` lists."""
    visits: Sequence[str] | None = None
    """Names of the poses in the order they are taken; each once, as listed, if not given."""
    tipped_deg: Mapping[str, float] = field(default_factory=dict)
    """Unreported error of the table at a pose, deg, by the name of the pose."""
    table_error_deg: float = 0.02
    """Error of the table at each pose, 1 sigma about each axis."""
    mounting_angle_deg: RotationDeg = 1.0
    """The structure that reference and targets share, `case_from_table`."""
    rest_seconds: float = 10.0
    """Time at each pose."""
    turn_rate_dps: float = 60.0
    """Largest rate of a turn, deg/s."""
    turn_acceleration_dps2: float = 120.0
    """Largest angular acceleration of a turn, deg/s^2."""
    turn_profile: Literal["smooth", "trapezoid"] = "smooth"
    """Raised cosine, or constant acceleration, rate and deceleration."""
    heading_turn_deg: float = 0.0
    """Turn about the vertical after each change of pose."""
    rates_dps: Sequence[float] = ()
    """deg/s at which the table turns about the vertical after each rest, both ways, before it rests again."""
    seconds_per_rate: float = 20.0
    """Time at each rate, s."""

    clocks: Literal["shared", "apart"] = "shared"
    """One clock stamps all units, or each has its own with an offset, a skew and a phase that are drawn."""
    clock_offset_seconds: float = 5.0
    """Clocks apart: offset, uniform up to this much either way."""
    clock_skew_ppm: float = 50.0
    """Clocks apart: skew, 1 sigma."""

    gravity: float = STANDARD_GRAVITY
    """m/s^2."""
    latitude_deg: float | None = 45.0
    """Latitude of the table, which sets the Earth's rate; `None` for an Earth that does not turn."""
    temperature_celsius: float = 25.0
    """Temperature at the start. Biases hold at 25 degC."""
    warm_up_kelvin: float = 0.0
    """Rise of the temperature in the long run."""
    warm_up_seconds: float = 300.0
    """Time constant of that rise."""

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        for each in fields(self):
            if not is_finite(getattr(self, each.name)):
                raise ScenarioError(f"{each.name} is {getattr(self, each.name)}; give finite numbers")
        if 0.0 in self.rates_dps or (self.rates_dps and self.seconds_per_rate <= 0.0):
            raise ScenarioError("a rate of zero, or for no time, is no turn; give rates and times above zero")
        grades = [grade for grade in (self.reference, *self.grades) if isinstance(grade, str)]
        _known("grade", grades, grade_names())
        poses = tuple(pose.name for pose in self.poses)
        _known("pose", [*(self.visits or ()), *self.tipped_deg], poses)
        by_name = (self.rate_hz, self.target_mounting_deg, self.lever_arm_m, self.faults)
        names = [name for value in by_name if isinstance(value, Mapping) for name in value]
        _known("unit", names, self.unit_names)
        refuse_beyond_bounds(**stated_by(self))

    @property
    def target_names(self) -> tuple[str, ...]:
        """`target_1`, `target_2` ..."""
        return tuple(f"target_{number}" for number in range(1, len(self.grades) + 1))

    @property
    def unit_names(self) -> tuple[str, ...]:
        """The reference, then the targets."""
        return (REFERENCE, *self.target_names)

    def grade_of(self, unit: str) -> Grade:
        """Grade of a unit by its name."""
        grade = dict(zip(self.unit_names, (self.reference, *self.grades), strict=True))[unit]
        return Grade.named(grade) if isinstance(grade, str) else grade

    def rate_of(self, unit: str) -> float:
        """Returns the sample rate of a unit, Hz."""
        rates = self.rate_hz
        return rates.get(unit, USUAL_RATE) if isinstance(rates, Mapping) else rates

    def mounting_of(self, unit: str) -> RotationDeg:
        """Returns the mounting of a unit against the case of the reference, which is the reference's own."""
        mountings = self.target_mounting_deg
        if unit == REFERENCE:
            return (0.0, 0.0, 0.0)
        return mountings.get(unit, USUAL_MOUNTING) if isinstance(mountings, Mapping) else mountings

    def faults_of(self, unit: str) -> tuple[Fault, ...]:
        """Returns what is wrong with a unit."""
        faults = self.faults.get(unit, ())
        return (faults,) if isinstance(faults, Fault) else tuple(faults)

    def visited(self) -> tuple[str, ...]:
        """Names of the poses in the order they are taken."""
        return tuple(pose.name for pose in self.poses) if self.visits is None else tuple(self.visits)


def _known(what: str, found: Sequence[str], known: Sequence[str]) -> None:
    for name in found:
        if name not in known:
            raise ScenarioError(f"unknown {what} {name!r}; known are {', '.join(known)}")
