"""Everything a simulated flight is made of: what carries the units, how it moves, and the units on board."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Literal, TypeAlias, get_args

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate.fault import Fault
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

FlightMotion: TypeAlias = Literal["quadrotor", "vehicle"]

PRIMARY = "primary"
"""Name of the first unit; the others are `secondary_1`, `secondary_2` ..."""
MOST_FLIGHTS = 1000
SHORTEST_SECONDS = 1.0
HIGHEST_HZ = 500.0
"""Highest frequency of vibration: a quarter of the rate at which it is simulated."""
MOST_PPM = 1e5


@dataclass(frozen=True, slots=True, kw_only=True)
class Vibration:
    """Vibration of the structure while the motors run, the same at all places but for `flexing`."""

    specific_force: float
    """Root mean square of each axis, m/s^2."""
    angular_rate: float
    """Root mean square of each axis, rad/s."""
    tones_hz: tuple[float, ...]
    """Frequencies of the motors, which have half of the power."""
    band_hz: tuple[float, float]
    """Half-power frequencies of the broad band, which has the other half."""
    at_rest: float = 0.0
    """Share of it while the motors do not run: an idling engine; 1 for vibration that never stops."""
    flexing: float = 0.05
    """Vibration that each place but the primary's has to itself, as a share of the common one."""


VIBRATIONS: dict[FlightMotion, Vibration] = {
    "quadrotor": Vibration(
        specific_force=4.0, angular_rate=0.05, tones_hz=(87.0, 131.0, 174.0), band_hz=(60.0, 140.0)
    ),
    "vehicle": Vibration(specific_force=0.4, angular_rate=0.005, tones_hz=(27.0, 54.0), band_hz=(10.0, 40.0)),
}
"""Usual vibration of each motion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightUnit:
    """One unit on board."""

    grade: str | Grade = "consumer"
    lever_arm_m: Triple = (0.0, 0.0, 0.0)
    """Its place from the primary, in the primary's case frame."""
    mounting_deg: Triple = (0.0, 0.0, 0.0)
    """Nominal mounting: rotation vector from the primary's case to its own; (180, 0, 0) is the board's other
    side. The error is drawn from the grade."""
    perfect: bool = False
    """Indicates whether it has bias and noise only: scale, non-orthogonality and alignment are exact."""
    ageing: float = 1.0
    """Change of biases since the factory: 1 sigma of each axis over the grade's turn-on bias."""
    accelerometer_ageing: Triple | None = None
    """m/s^2, by which the bias moved, in place of what is drawn."""
    gyroscope_ageing: Triple | None = None
    """rad/s."""
    rate_hz: float = 200.0
    """Samples a second."""
    filtered: bool = True
    """Indicates whether vibration comes as its mean over a sample period; otherwise its instantaneous value
    aliases."""
    phase: float | None = None
    """First sample, in sample periods after the start; drawn if not given, 0 for the primary."""
    clock_offset_seconds: float = 0.0
    """Its clock shows this much more than the flight's."""
    clock_skew_ppm: float = 0.0
    latency_seconds: float = 0.0
    """Delay after which a sample is available."""
    faults: Sequence[Fault] = ()
    """Faults of the unit; times in s after the start."""

    @property
    def averaging_seconds(self) -> float:
        """Returns the time over which vibration comes as its mean."""
        return 1.0 / self.rate_hz if self.filtered else 0.0

    @property
    def grade_figures(self) -> Grade:
        """Returns the grade by its figures."""
        return Grade.named(self.grade) if isinstance(self.grade, str) else self.grade


USUAL_UNITS = (
    FlightUnit(grade="industrial", ageing=0.0),
    FlightUnit(lever_arm_m=(0.03, 0.0, 0.0)),
    FlightUnit(lever_arm_m=(0.0, -0.02, 0.01), mounting_deg=(180.0, 0.0, 0.0)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightScenario:
    """A quadrotor that is flown, or a vehicle that is driven, with several units on board."""

    seed: int = 1
    """All that is random follows from it, on every machine alike."""

    motion: FlightMotion = "quadrotor"
    units: Sequence[FlightUnit] = USUAL_UNITS
    """The primary first."""

    flights: int = 1
    """Flights or drives, with a rest before each and after the last."""
    rest_seconds: float = 10.0
    """Each of these rests, motors off."""
    motion_seconds: float = 60.0
    """Manoeuvres of each flight, beside take-off, hovering and landing; or each drive."""
    stops: int = 1
    """Stops of a vehicle on each drive."""
    stop_seconds: float = 5.0
    intensity: float = 0.6
    """0 for just so much that it gets going, to 1."""
    sway: Triple = (1.0, 1.0, 1.0)
    """Share, 0 to 1, of the usual motion forward, left and up.

    For a vehicle: changes of speed and slopes; banks and rolling over bumps; heaving over bumps.
    """
    turning: float = 1.0
    """Share, 0 to 1, of the usual motion about the vertical: yawing, or curves."""
    ground_tilt_deg: float = 1.0
    uphill_deg: float = 40.0
    """Counter-clockwise from forward, at the start."""
    vibration: Vibration | None = None
    """Vibration; the usual one of the motion if not given."""

    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    """Mounting of the primary in the body: body_from_case = R_z(yaw) R_y(pitch) R_x(roll)."""

    bias_instability: bool = True
    quantisation: bool = True
    g_sensitivity: bool = True
    """Indicates whether gyroscopes respond to specific force."""
    gravity: float = STANDARD_GRAVITY
    """m/s^2."""
    latitude_deg: float | None = None
    """Sets the Earth's rate, for a body that faces east at first; `None` for none."""
    temperature_celsius: float = 25.0
    """Temperature at the start. Biases hold at 25 degC."""
    warm_up_kelvin: float = 10.0
    """Rise of the temperature in the long run."""
    warm_up_seconds: float = 120.0
    """Time constant of that rise."""

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        parts: list[FlightUnit | Vibration] = [*self.units]
        if self.vibration is not None:
            parts.append(self.vibration)
        for part in parts:
            refuse_no_numbers(**stated_by(part))
        for objection in self._objections():
            raise ScenarioError(objection)
        refuse_beyond_bounds(**stated_by(self))
        for part in parts:
            refuse_beyond_bounds(**stated_by(part))

    @property
    def names(self) -> tuple[str, ...]:
        """`primary`, `secondary_1`, `secondary_2` ..."""
        return unit_names(len(self.units))

    @property
    def shaking(self) -> Vibration:
        """Returns the vibration, the usual one where none was given."""
        return VIBRATIONS[self.motion] if self.vibration is None else self.vibration

    def _objections(self) -> Iterator[str]:
        if self.motion not in get_args(FlightMotion):
            yield f"unknown motion {self.motion!r}; known are {', '.join(get_args(FlightMotion))}"
        if not self.units:
            yield "there is no unit; give a primary at least"
        for each in fields(self):
            if not is_finite(getattr(self, each.name)):
                yield f"{each.name} is {getattr(self, each.name)}; give finite numbers"
        yield from self._motion_objections()
        yield from _vibration_objections(self.shaking)
        for name, unit in zip(self.names, self.units, strict=True):
            yield from (f"{name}: {objection}" for objection in _unit_objections(unit))

    def _motion_objections(self) -> Iterator[str]:
        if not 1 <= self.flights <= MOST_FLIGHTS:
            yield f"flights is {self.flights}; give 1 to {MOST_FLIGHTS}"
        if self.stops < 0:
            yield f"stops is {self.stops}; make it zero or more"
        elif not self.motion_seconds / (self.stops + 1) >= SHORTEST_SECONDS:
            yield (
                f"motion_seconds is {self.motion_seconds:g} with {self.stops} stops; "
                f"make each part {SHORTEST_SECONDS:g} s or longer"
            )
        for name in ("rest_seconds", "stop_seconds", "gravity", "warm_up_seconds"):
            if not getattr(self, name) > 0.0:
                yield f"{name} is {getattr(self, name):g}; make it positive"
        for name in ("intensity", "turning"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                yield f"{name} is {getattr(self, name):g}; give a share from 0 to 1"
        if len(self.sway) != len(("forward", "left", "up")) or not all(0.0 <= s <= 1.0 for s in self.sway):
            yield f"sway is {self.sway}; give shares from 0 to 1 for forward, left and up"
        if not 0.0 <= self.ground_tilt_deg < STEEPEST_DEG:
            yield f"ground_tilt_deg is {self.ground_tilt_deg:g}; give 0 to {STEEPEST_DEG:g} deg"
        if self.latitude_deg is not None and not -90.0 <= self.latitude_deg <= 90.0:
            yield f"latitude_deg is {self.latitude_deg:g}; give -90 to 90 deg"


def unit_names(count: int) -> tuple[str, ...]:
    """Name that many units: `primary`, `secondary_1`, `secondary_2` ..."""
    return (PRIMARY, *(f"secondary_{number}" for number in range(1, count)))


def _vibration_objections(vibration: Vibration) -> Iterator[str]:
    for each in fields(vibration):
        if not is_finite(getattr(vibration, each.name)):
            yield f"vibration: {each.name} is {getattr(vibration, each.name)}; give finite numbers"
    for name in ("specific_force", "angular_rate", "at_rest", "flexing"):
        if not getattr(vibration, name) >= 0.0:
            yield f"vibration: {name} is {getattr(vibration, name):g}; make it zero or more"
    if vibration.at_rest > 1.0:
        yield f"vibration: at_rest is {vibration.at_rest:g}; give a share from 0 to 1"
    low, high = vibration.band_hz
    if not 0.0 < low < high <= HIGHEST_HZ:
        yield f"vibration: band_hz is {low:g} to {high:g}; give 0 to {HIGHEST_HZ:g} Hz, the lower first"
    for tone in vibration.tones_hz:
        if not 0.0 < tone <= HIGHEST_HZ:
            yield f"vibration: a tone at {tone:g} Hz; give above 0 to {HIGHEST_HZ:g} Hz"


def _unit_objections(unit: FlightUnit) -> Iterator[str]:
    if isinstance(unit.grade, str) and unit.grade not in grade_names():
        yield f"unknown grade {unit.grade!r}; known are {', '.join(grade_names())}"
    for each in fields(unit):
        if not is_finite(getattr(unit, each.name)):
            yield f"{each.name} is {getattr(unit, each.name)}; give finite numbers"
    for name in ("lever_arm_m", "mounting_deg", "accelerometer_ageing", "gyroscope_ageing"):
        if (vector := getattr(unit, name)) is not None and len(vector) != len("xyz"):
            yield f"{name} has {len(vector)} numbers; give one for each of x, y and z"
    for name in ("ageing", "latency_seconds", "phase"):
        if (value := getattr(unit, name)) is not None and not value >= 0.0:
            yield f"{name} is {value:g}; make it zero or more"
    if not SLOWEST_RATE_HZ <= unit.rate_hz <= FASTEST_RATE_HZ:
        yield f"rate_hz is {unit.rate_hz:g}; give {SLOWEST_RATE_HZ:g} to {FASTEST_RATE_HZ:g} samples a second"
    if not abs(unit.clock_skew_ppm) < MOST_PPM:
        yield f"clock_skew_ppm is {unit.clock_skew_ppm:g}; give less than {MOST_PPM:g} either way"
