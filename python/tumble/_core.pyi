"""The numeric core. Arrays are C-contiguous float64; units are SI; frames as in docs/conventions.md."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict

from typing_extensions import NotRequired

from tumble.foundation.recording import FloatArray

__version__: str
STANDARD_GRAVITY: float
"""m/s^2."""

GAP_INTERVALS: int
"""Sample intervals beyond which a pause in the samples is a gap; shorter ones are bridged."""

VOCABULARY: dict[str, tuple[str, ...]]
"""The words of core and lab by kind: events, reasons, choices and errors, each enumeration in its order."""

FEWEST_DIRECTIONS: int
"""Orientations from which on multi-pose says anything."""

LEAST_TEMPERATURE_RANGE: float
"""K, that a drift is to be seen in."""

FULL_TURN_SIGMA: float
"""rad, by which a full turn by hand is taken to miss one."""

CRYSTAL: float
"""1 sigma of the pace of a crystal, relative."""

RESPONSE_FALSE_ALARM: float
MOST_LEFT_OUT: float
"""Chance of fitting a gyroscope's response to specific force where it has none."""

class CoreError(Exception):
    """What the core objects to; `args` is (kind, figures)."""

def encode_record(record: Mapping[str, Any], temperature: float | None = None) -> bytes:
    """Encode `identity`, `sensor`, and either the numbers of an error or a `temperature_drift`."""

def decode_record(record: bytes) -> dict[str, Any]: ...
def record_length(begins: bytes) -> int | None: ...

class RecordRow(TypedDict):
    """Numbers of a record that belong together, as the core's table has them."""

    name: str
    meaning: str
    unit: str
    count: int
    may_be_infinite: bool
    version: int
    """First version of the bytes that has them."""

def record_table() -> list[RecordRow]:
    """Give the numbers of a record, in the order of its bytes."""

def gather(target: FloatArray, first: int, x: FloatArray, y: FloatArray, z: FloatArray) -> None:
    """Puts columns (m,), with any stride, into the rows of `target` (n, 3) from the one of that number on."""

def largest(values: FloatArray) -> float:
    """Largest absolute value of numbers, 0 where there are none; NaN where one is not finite."""

def steps(time: FloatArray) -> tuple[int, int]:
    """Counts the (n,) times that do not rise, or are NaN, after the one before, and those that equal it."""

def failed_reads(readings: FloatArray) -> list[int]:
    """Rows of (n, 3) readings of a triad, SI, whose read failed: zero amid readings that are far from it."""

FROZEN: float
"""s for which readings may stand still, as long as samples may be missing."""

def standstills(
    time: FloatArray, accelerometer: FloatArray | None, gyroscope: FloatArray | None
) -> tuple[list[tuple[int, int]], list[tuple[str, float, float, float]]]:
    """Stretches in which all channels that were recorded repeat their readings, and channels that do alone.

    A stretch is given by its first and last place, a channel by its name, value, SI, and first and last s.
    """

class AlternationWatch:
    """Compares the medians of every second, third and fourth sample, less the motion, block by block."""

    def __init__(self) -> None: ...
    def push(self, accelerometer: FloatArray | None, gyroscope: FloatArray | None) -> None:
        """Takes in successive (n, 3) readings, SI; None of a triad that was not recorded."""
    @property
    def units(self) -> int:
        """Number of units that take turns; 1 where nothing shows that it is more than one."""

def scatter_of_steps(stamps: FloatArray) -> float:
    """Scatter, s, of the steps between (n,) stamps, s, that no times fit."""

def stamps_are_late(stamps: FloatArray) -> bool:
    """Whether (n,) stamps, s, scatter so much that even times differ from them."""

class SampleTimes:
    """Even times fitted to late stamps, and evidence of when samples were taken."""

    @staticmethod
    def fit(stamps: FloatArray) -> SampleTimes | None: ...
    def push(self, stamps: FloatArray, accelerometer: FloatArray, gyroscope: FloatArray) -> None: ...
    def times(self, first_row: int, count: int) -> FloatArray: ...
    def kept_sigma(self, stamps: FloatArray) -> float | None: ...
    @property
    def sampling(self) -> Literal["even", "stamped", "between", "unshown"]: ...
    @property
    def share(self) -> tuple[float, float] | None: ...
    @property
    def interval(self) -> float: ...
    @property
    def latest(self) -> float: ...
    @property
    def scatter(self) -> float: ...
    @property
    def burst(self) -> float: ...
    @property
    def lost(self) -> int: ...
    @property
    def sigma(self) -> float: ...
    @property
    def rate_sigma(self) -> float: ...

class Segmenter:
    """Takes in one recording chunk by chunk; keeps sums over rests and turns only."""

    def __init__(
        self,
        shortest_rest: float = 1.0,
        by_hand: bool = False,
        rates: Literal["reference", "target"] | None = None,
        pace_sigma: float = 0.0,
        stamp_sigma: float = 0.0,
    ) -> None: ...
    def push(
        self,
        time: FloatArray,
        accelerometer: FloatArray,
        gyroscope: FloatArray,
        temperature: FloatArray | None = None,
    ) -> None: ...
    def begin_part(self, name: str) -> None: ...
    def finish(self) -> Acquired: ...

class Acquired:
    """What one unit showed: k rests, and turns between them."""

    @property
    def constant_rates(self) -> list[tuple[float, float, str, list[float], list[float]]]: ...
    @property
    def samples(self) -> int: ...
    @property
    def not_finite(self) -> int: ...
    @property
    def missing(self) -> int: ...
    @property
    def first_backwards(self) -> float | None: ...
    @property
    def temperature(self) -> tuple[float, float, float] | None: ...
    @property
    def rest_times(self) -> FloatArray: ...
    @property
    def rest_parts(self) -> list[int]: ...
    @property
    def rest_samples(self) -> list[int]: ...
    @property
    def rest_specific_force(self) -> FloatArray: ...
    @property
    def rest_angular_rate(self) -> FloatArray: ...
    @property
    def rest_specific_force_sigma(self) -> FloatArray: ...
    @property
    def rest_angular_rate_sigma(self) -> FloatArray: ...
    @property
    def turn_angles(self) -> FloatArray: ...
    @property
    def turn_complete(self) -> list[bool]: ...
    @property
    def rejected_rests(self) -> list[tuple[float, float, str]]: ...
    @property
    def noise_density(self) -> FloatArray: ...
    @property
    def bias_instability(self) -> FloatArray: ...
    @property
    def coarse_channels(self) -> list[tuple[str, float, float, float, float]]:
        """Name, step, half the dead band, share of zeros at rest, 1-sigma of a mean at rest; SI."""
    @property
    def faults(self) -> list[tuple[str, str, float, float, float, int, list[tuple[float, float]]]]: ...
    def trace(self) -> tuple[FloatArray, FloatArray, FloatArray]: ...

class TurntableSettings:
    """How to calibrate; latitude in rad; g-sensitivity None: where the residuals ask for it.

    `gravity_sigma` in m/s^2 is 0 where scale is relative to gravity.
    """

    def __init__(
        self,
        gravity: float,
        truth: str = "reference",
        clocks: str = "auto",
        latitude: float | None = None,
        g_sensitivity: bool | None = None,
        commanded: tuple[list[float], float] | None = None,
        gravity_sigma: float = 0.0,
    ) -> None: ...

BiasDrift: TypeAlias = tuple[FloatArray, FloatArray, float]

class ReferenceFigures(TypedDict, total=False):
    """What the reference showed; the keys from `R_e` on only where poses are known."""

    bias: FloatArray
    bias_sigma: FloatArray
    norm_residual: float
    drift: BiasDrift
    excess: float
    gyroscope_bias: FloatArray
    gyroscope_bias_sigma: FloatArray
    earth_rate: FloatArray
    earth_rate_sigma: FloatArray
    commanded: list[float]
    R_e: FloatArray
    rotation_vector: FloatArray
    rotation_sigma: FloatArray
    table_errors: FloatArray
    table_error_angles: list[float]
    table_error_sigmas: list[float]

class Reference:
    """What was fitted to the reference."""

    @property
    def figures(self) -> ReferenceFigures: ...

class ClockFigures(TypedDict):
    """Target clock against reference clock; offset in s, skew without unit."""

    shared: bool
    offset: float
    offset_sigma: float
    skew: float
    skew_sigma: float
    turns: int
    contradiction: tuple[float, float] | None

class TriadFigures(TypedDict, total=False):
    """One triad; `values` and `sigmas` are bias, scale, non-orthogonality, mounting, in SI units and rad.

    `by_reference` (12, 12) is the derivative of [M row by row, b] by the [E row by row, e] of the reference,
    `by_gravity` and `by_table` (12,) its change by 1 sigma of these, `parts_jacobian` (12, 12) the derivative
    of `values` by [M row by row, b]; all are there where `inherited` is.
    """

    M: FloatArray
    b: FloatArray
    covariance: FloatArray
    inherited: FloatArray
    observed: list[bool]
    scale: FloatArray
    L: FloatArray
    Q: FloatArray
    values: list[float]
    sigmas: list[float]
    inherited_sigmas: list[float]
    by_reference: FloatArray
    by_gravity: list[float]
    by_table: list[float]
    parts_jacobian: FloatArray
    drift: BiasDrift
    """Change over the session, its 1-sigma, and its time constant, s: infinite for a straight line."""
    slip: tuple[int, int, float, float, bool]
    """Rests of the reference before and behind, angle and its 1-sigma, rad."""
    asymmetry: tuple[list[float], list[float]]
    """Relative difference of the scales by direction, and 1-sigma; missing where residuals show none."""
    rank: int
    widened: float
    by_direction: float
    variance_freedom: float
    chi_square: float
    degrees_of_freedom: int
    residuals: FloatArray
    residual_sigmas: FloatArray
    labels: list[tuple[str, int, int]]
    g_sensitivity: FloatArray
    g_sensitivity_sigma: FloatArray

class ResponseFigures(TypedDict):
    """A sensing axis at constant rates, rad/s; pairs are values with their sigmas.

    `levels` are (rate, turns, scale, sigma, deviation from the straight line over full scale, sigma).
    """

    axis: int
    full_scale: float
    scale: tuple[float, float]
    linearity: tuple[float, float]
    asymmetry: tuple[float, float] | None
    levels: list[tuple[float, int, float, float, float, float]]

class TargetFigures(TypedDict):
    """A calibrated target.

    `pairs` are (reference rest, first and last target rest), `continued` the rests of the reference that only
    go on with the one before.
    """

    clock: ClockFigures
    pairs: list[tuple[int, int, int]]
    continued: list[int]
    accelerometer: TriadFigures | None
    gyroscope: TriadFigures | None
    responses: list[ResponseFigures]

def uncertainty_of_calibration(matrix: FloatArray, stated: FloatArray) -> FloatArray: ...
def uncertainty_of_grade(name: str) -> list[FloatArray]: ...
def fit_reference(
    unit: Acquired,
    ups: FloatArray,
    settings: TurntableSettings,
    gyroscope: bool = True,
    accelerometer_uncertainty: FloatArray | None = None,
    gyroscope_uncertainty: FloatArray | None = None,
) -> Reference: ...
def as_reference(reference_unit: Acquired, unit: Acquired, settings: TurntableSettings) -> Acquired: ...
def calibrate_target(
    reference_unit: Acquired,
    reference: Reference,
    unit: Acquired,
    ups: FloatArray,
    settings: TurntableSettings,
    triads: tuple[bool, bool] = (True, True),
) -> TargetFigures: ...

class FieldPointFigures(TypedDict):
    """One entry a rest or stretch; see `tumble.procedures.magnetometer.result.FieldPoint`. Dip in rad."""

    span: list[tuple[float, float]]
    field: FloatArray
    before: list[float]
    after: list[float]
    sigma: list[float]
    dip: list[tuple[float, float]]
    weight: list[float]
    chance: list[float]
    disturbed: list[bool]
    direction: list[int]
    leverage: list[float]
    influence: list[float]
    held_out: list[float]

class NextFieldFigures(TypedDict):
    """Field and up in the case frame; the largest sigma before and after; the place of that unknown."""

    field: FloatArray
    up: FloatArray | None
    before: float
    after: float
    unknown: int

class MagnetometerFigures(TypedDict):
    """A calibrated magnetometer, uT; pairs are values with their sigmas, `dip` in rad.

    `scatter` is that of a sample and the samples that are worth one, where the unit was turned.
    """

    calibration: TriadFigures
    current: FloatArray | None
    current_sigma: FloatArray | None
    strength: tuple[float, float]
    dip: tuple[float, float] | None
    coverage: float
    scatter: tuple[float, float] | None
    points: FieldPointFigures
    next: NextFieldFigures | None

def magnetometer_at_rests(
    time: FloatArray,
    field: FloatArray,
    spans: list[tuple[float, float]],
    force: FloatArray,
    force_variance: FloatArray,
    accelerometer: FloatArray,
    covariance: FloatArray,
    *,
    current: FloatArray | None = None,
    strength: float | None = None,
    strength_sigma: float = 0.0,
) -> MagnetometerFigures: ...
def magnetometer_turned(
    time: FloatArray,
    field: FloatArray,
    *,
    current: FloatArray | None = None,
    strength: float | None = None,
    strength_sigma: float = 0.0,
) -> MagnetometerFigures: ...
def magnetometer_range_ends(field: FloatArray) -> FloatArray: ...

class TargetMagnetometerFigures(TypedDict):
    """A magnetometer of a target of a turntable, uT; `strength` is a value with its sigma.

    `difference` is the field at the target less that at the reference, upwards, to magnetic north and west,
    where residuals show it. `rests` are (rest of the reference, strength there less that of all, sigma, why
    it is not used), with the `field` (k, 3) at the reference.
    """

    calibration: TriadFigures
    strength: tuple[float, float]
    reference_bias: FloatArray
    reference_bias_sigma: FloatArray
    difference: FloatArray | None
    rests: list[tuple[int, float, float, str]]
    field: FloatArray

def magnetometer_of_target(
    reference_time: FloatArray,
    reference_field: FloatArray,
    time: FloatArray,
    field: FloatArray,
    rests: list[tuple[int, tuple[float, float], tuple[float, float]]],
    force: FloatArray,
    uncertainty: FloatArray | None = None,
) -> TargetMagnetometerFigures: ...

class MultiposePoses(TypedDict):
    """One entry a rest; see `tumble.procedures.multipose.result.PoseFit`. `force` (k, 3) m/s^2, corrected."""

    force: FloatArray
    before: list[float]
    after: list[float]
    sigma: list[float]
    weight: list[float]
    leverage: list[float]
    influence: list[float]
    held_out: list[float]
    direction: list[int]

class NextOrientationFigures(TypedDict):
    """Up in the case frame; the largest sigma before and after; the place of that unknown in [M, b]."""

    up: FloatArray
    before: float
    after: float
    unknown: int

class NextTurnFigures(TypedDict):
    """The turn that is worth most; `unknown` is its place in [M row by row, b], then G row by row."""

    axis: FloatArray
    up: FloatArray
    before: float
    after: float
    unknown: int

Tremor: TypeAlias = tuple[float, float]
"""Amplitude of the angular rate, rad/s, and frequency, Hz."""

class TurnBiasFigures(TypedDict):
    """See `tumble.procedures.multipose.turn_bias.TurnBias`."""

    difference: FloatArray
    sigma: FloatArray
    chance: float
    contradicts: bool

class MultiposeGyroscope(TypedDict):
    """Angles in rad; `turns` are rests before and after; excess is what noise leaves, rad and rad/s."""

    calibration: TriadFigures
    turns: list[tuple[int, int]]
    angles_before: list[float]
    angles_after: list[float]
    with_g_sensitivity: float | None
    next: NextTurnFigures | None
    turn_excess: float
    bias_excess: float
    implausible_scale: float | None
    turn_bias: TurnBiasFigures | None
    turn_loss: tuple[float, float] | None
    """Angle that every turn loses, and its 1-sigma, rad; None where turns lose none."""
    dead_band: tuple[int, float] | None
    """Place of the axis, and half the width, rad/s."""
    turn_widening: float
    """Factor by which turns are off beyond noise and a bias that varies."""

class FerrarisFigures(TypedDict):
    """A triad by the formulas of Ferraris; `parameters` are values and differences in sigmas."""

    scale: FloatArray
    rotation: FloatArray
    bias: FloatArray
    parameters: list[tuple[float, float]] | None

class FaceFigures(TypedDict):
    """What six faces show besides."""

    tilt: float
    sections: list[tuple[str, int, int]]
    accelerometer: FerrarisFigures
    gyroscope: FerrarisFigures | None
    g_sensitivity: FloatArray

class MultiposeFigures(TypedDict):
    """A unit calibrated without equipment; `nominal_scale` is SI per count."""

    tolerance: float
    nominal_scale: tuple[float, float] | None
    accelerometer: TriadFigures
    non_linearity: tuple[list[list[float]], list[list[float]]] | None
    """Second order of each axis and its 1-sigma, 1 / (m/s^2), where residuals show it."""
    poses: MultiposePoses
    next: NextOrientationFigures | None
    faces: FaceFigures | None
    gyroscope: MultiposeGyroscope | None
    left_out: list[tuple[float, float, Tremor | None]]
    """First and last s of stretches in which the unit was held and which are among no rest."""
    tremors: list[Tremor | None]
    """Of each rest."""
    gyroscope_refusal: tuple[str, dict[str, Any]] | None
    acquired: Acquired

def multipose_of(
    time: FloatArray,
    force: FloatArray,
    rate: FloatArray,
    gravity: float,
    *,
    gyroscope: bool = True,
    g_sensitivity: bool = False,
    latitude: float | None = None,
    raw: bool = False,
    shortest_rest: float = 1.0,
    noise_density: FloatArray | None = None,
    bias_instability: FloatArray | None = None,
    faces: bool = False,
    sections: list[tuple[str, int, int]] = ...,
    pace_sigma: float = 0.0,
    stamp_sigma: float = 0.0,
    gravity_sigma: float = 0.0,
) -> MultiposeFigures: ...
def held_rests(
    time: FloatArray, force: FloatArray, rate: FloatArray, shortest: float
) -> list[tuple[int, int]]: ...
def stamped_rate(stamps: FloatArray, stated: float) -> tuple[float, int, bool] | None:
    """Rate, Hz, that (n,) stamps, s, show beside one that was stated, Hz; None where they show none.

    With it the number of missing samples, and whether clocks explain the difference.
    """

def multipose_directions(force: FloatArray) -> list[int]: ...
def sphere_residual(unit: Acquired, gravity: float) -> float | None: ...
def gyroscope_consistency(unit: Acquired) -> tuple[str, float, list[tuple[int, float]]]: ...
def rotation_vector(rotation: FloatArray) -> FloatArray: ...
def rotation_matrix(vector: FloatArray) -> FloatArray: ...
def inverse_left_jacobian(vector: FloatArray) -> FloatArray: ...
def chi_square_tail(x: float, freedom: float) -> float: ...
def chi_square_quantile(tail: float, freedom: float) -> float: ...
def student_quantile(p: float, freedom: float) -> float: ...
def f_tail(x: float, first: float, second: float) -> float: ...
def normal_gravity(latitude: float, height: float) -> float: ...

class TemperatureDriftFigures(TypedDict):
    """See `tumble.calibration.temperature_drift.TemperatureDrift`."""

    reference: float
    range: list[float]
    bias: list[list[float]]
    scale: list[list[float]]

def at_reference(
    y: FloatArray, bias: FloatArray, temperature: FloatArray, drift: TemperatureDriftFigures
) -> FloatArray: ...
def correct(
    y: FloatArray, matrix_m: FloatArray, bias: FloatArray, out: FloatArray | None = None
) -> FloatArray: ...

class TriadTruthFigures(TypedDict):
    """True errors of a triad; see `tumble.tools.simulate.TriadTruth`."""

    M: FloatArray
    b: FloatArray
    scale: FloatArray
    L: FloatArray
    Q: FloatArray
    mounting: FloatArray
    non_orthogonality: FloatArray
    g_sensitivity: FloatArray
    drift: FloatArray
    temperature_coefficient: FloatArray
    noise_density: float
    bias_instability: float
    quantisation: float

class SimulatedUnitFigures(TypedDict):
    """What a unit recorded, and its truth; `clock` is offset in s, skew without unit, phase in samples.

    `arrival` is s of the session's clock; `ageing` m/s^2 and rad/s; `package_from_case` (3, 3).
    """

    time: FloatArray
    arrival: FloatArray
    accelerometer: FloatArray
    gyroscope: FloatArray
    temperature: FloatArray
    accelerometer_truth: TriadTruthFigures
    gyroscope_truth: TriadTruthFigures
    ageing: tuple[FloatArray, FloatArray]
    package_from_case: FloatArray
    clock: tuple[float, float, float]

class TrueRestFigures(TypedDict):
    """The rests of the table, k of them; `pose` counts the poses as they are visited."""

    pose: list[int]
    start: FloatArray
    end: FloatArray
    table_error: FloatArray
    specific_force: FloatArray
    angular_rate: FloatArray

class SimulatedSession(TypedDict):
    """A turntable session with its truth."""

    case_from_table: FloatArray
    mounting: FloatArray
    earth_rate: FloatArray
    duration: float
    rests: TrueRestFigures
    fields: list[FloatArray]
    """(n, 3) uT of each unit in its case at its samples; only where fields were given."""
    reference: SimulatedUnitFigures
    targets: list[SimulatedUnitFigures]

def sensor_grades() -> list[str]: ...
def sensor_grade(name: str) -> str: ...

class SimulatedSpinFigures(TypedDict):
    """A robot that turned on the spot; see `tumble.tools.simulate.SimulatedSpin`."""

    unit: SimulatedUnitFigures
    duration: float
    up: FloatArray
    roll: float
    pitch: float
    uphill_bearing: float
    lever_arm: FloatArray
    heading: FloatArray
    moving: FloatArray
    rests: FloatArray
    turns: FloatArray
    turned: FloatArray

class TrueMotionFigures(TypedDict):
    """True motion of the primary's place; see `tumble.tools.simulate.FlightTruth`."""

    specific_force: FloatArray
    angular_rate: FloatArray
    angular_acceleration: FloatArray

class TruePathFigures(TypedDict):
    """See `tumble.tools.simulate.FlightPath`."""

    level_from_case: FloatArray
    velocity: FloatArray

class FlightMotion:
    """The true motion of the primary's place at times (n,) s, vibration as its mean over `averaging` s."""

    def truth(self, time: FloatArray, averaging: float) -> TrueMotionFigures: ...
    def path(self, time: FloatArray) -> TruePathFigures: ...

class SimulatedFlightFigures(TypedDict):
    """A flight with its truth; see `tumble.tools.simulate.SimulatedFlight`."""

    duration: float
    rests: FloatArray
    manoeuvres: FloatArray
    units: list[SimulatedUnitFigures]
    motion: FlightMotion

def simulate_flight(text: str) -> SimulatedFlightFigures: ...
def simulate_spin(text: str) -> SimulatedSpinFigures: ...
def simulate_turntable(text: str, fields: list[FloatArray] | None = None) -> SimulatedSession: ...

class NoiseTermFigures(TypedDict):
    """One term of noise; units of the field at one unit of the channel."""

    term: str
    value: float
    low: float
    high: float
    identifiable: bool
    needed: float | None
    """Length, s, of a record that would show half of `high`; None where it is identifiable, or none would."""

class NoiseFitFigures(TypedDict):
    """Terms of one channel."""

    terms: list[NoiseTermFigures]
    chi_square: float
    degrees_of_freedom: int
    misfit: float
    """Scatter of the deviations about the sum of the terms beyond chance, as a share of them."""
    filter: float
    """Time constant, s, of the filter that white noise passed; 0 for none."""
    coefficients: FloatArray
    """(5,) that fit best."""

class NoiseFigures(TypedDict):
    """One channel; deviations are (n, 5): averaging time s, deviation, low, high, degrees of freedom."""

    allan: FloatArray
    modified: FloatArray
    hadamard: FloatArray
    fit: NoiseFitFigures | None

class DisturbanceFigures(TypedDict):
    """A step, ramp or knock of one channel, in its unit; times in s."""

    kind: str
    log: int
    time: tuple[float, float]
    size: float
    sigma: float

class NoiseWatch:
    """Looks for steps, ramps and knocks in channels that are sampled together, in constant memory."""

    def __init__(self, channels: int) -> None: ...
    def push(self, time: FloatArray, samples: FloatArray, at_rest: bool) -> None:
        """Take in successive samples, time (n,), s, and (n, channels)."""

    def end_log(self) -> None:
        """Begin another log: levels are not compared across."""

    def conclude(self) -> list[tuple[list[DisturbanceFigures], bool]]:
        """Give what disturbs each channel, the clearest first, and whether there is more than is listed."""

class NoiseRecord:
    """Allan deviations of channels that are sampled together, in constant memory."""

    def __init__(self, channels: int, allan_only: bool = False) -> None: ...
    def push(self, samples: FloatArray) -> None:
        """Take in successive samples, (n, channels)."""

    def end_stretch(self) -> None:
        """End a stretch without gaps: no difference spans what follows."""

    def copy(self) -> NoiseRecord:
        """Give a record of the same samples, to conclude from while this one goes on."""

    def conclude(self, interval: float) -> list[NoiseFigures]:
        """Give what all ended stretches show, of samples that many s apart."""

class StillNoise:
    """Channels that stand still, with noise of known terms."""

    def __init__(self, seed: int, coefficients: FloatArray, rate: float, samples: int) -> None:
        """`coefficients` (channels, 5) are Q, N, B, K and R; `rate` in Hz; `samples` drawn in all."""

    def draw(self, samples: int) -> FloatArray:
        """Give the next samples, (n, channels)."""

class HysteresisFigures(TypedDict):
    """Bias while warming less bias while cooling, unit of the axis; value and 1-sigma."""

    largest: tuple[float, float]
    mean: tuple[float, float]
    knots: FloatArray
    """(k, 3) temperature less the reference, K, difference, and its 1-sigma."""
    is_clear: bool

class AxisDriftFigures(TypedDict):
    """What temperature does to one axis, unit of the axis and K."""

    channel: int
    bias: FloatArray
    """(p,) coefficients of t, t^2 ..."""
    scale: FloatArray
    """(q,) the same, 1/K^k."""
    covariance: FloatArray
    """Of [bias, scale, hysteresis], the last a constant or one at each knot."""
    hysteresis: HysteresisFigures | None
    """Bias while warming less that while cooling, and its 1-sigma."""
    slope: tuple[float, float]
    """First power of the bias and its 1-sigma, chosen or not."""
    scale_change: tuple[float, float] | None
    """1/K, and its 1-sigma."""
    constants: FloatArray
    """(poses,) what is read at the reference in each."""
    noise_density: float
    bias_instability: float
    random_walk: float
    scores: list[tuple[int, int, float]]
    """Powers in bias and scale of each candidate, and what it did not foretell."""
    chosen: int
    """Which of them."""
    change: FloatArray
    """(blocks,) what each reads other than at the reference, less what scale does."""

class ThermalFigures(TypedDict):
    """What temperature does to a unit: degC, s."""

    reference: float
    range: tuple[float, float]
    step: float
    lag: tuple[float, float] | None
    lag_or_hysteresis: tuple[float, float] | None
    """A lag that explains the difference of both legs as well as hysteresis does."""
    still: float
    moved: float
    time: FloatArray
    session: FloatArray
    pose: FloatArray
    temperature: FloatArray
    leg: FloatArray
    axes: list[AxisDriftFigures]

class ThermalRecorder:
    """Takes in logs of a unit whose temperature changes, in memory that does not grow."""

    def __init__(self) -> None: ...
    def begin_session(self) -> None:
        """Begin another log."""

    def push(
        self, time: FloatArray, accelerometer: FloatArray, gyroscope: FloatArray, temperature: FloatArray
    ) -> None:
        """Take in samples (n,), (n, 3), (n, 3), (n,); those that are not finite are left out."""

    def conclude(
        self, channels: list[int], *, fixture: bool = False, reference: float | None = None
    ) -> ThermalFigures:
        """Give what all logs show of those channels; raises `CoreError`: word and figures."""

SettingTable: TypeAlias = Literal["redundancy", "spin"]

class SettingRow(TypedDict):
    """A setting as the table has it."""

    name: str
    path: str
    """Where it stands in the core's struct."""
    group: str
    kind: Literal["number", "time", "count", "flag", "choice", "threshold"]
    type: str
    """Name of the enumeration of a choice."""
    choices: tuple[str, ...]
    unit: str
    meaning: str
    none: str
    """What it means that there is none; empty where there always is a value."""
    above: float | None
    least: float | None
    below: float | None
    more_than: str | None
    """Name of the setting than which it has to be more."""
    default: object
    """As the core has it."""

def setting_table(of: SettingTable) -> list[SettingRow]:
    """Give all settings of a procedure, in the order they are explained."""

class SpinSettings:
    """Course of a spin, and limits of the result: `stated` by the names of `setting_table`, else defaults.

    `latitude`, rad, gives the upward part of the Earth's rotation. `bias_instability` is that of
    accelerometer, m/s^2, and gyroscope, rad/s; read off the residuals where not given.
    """

    def __init__(
        self,
        stated: Mapping[str, object] | None = None,
        *,
        latitude: float | None = None,
        bias_instability: tuple[float, float] | None = None,
    ) -> None: ...

class BiasFigures(TypedDict):
    """A bias, (3,) each; `observed` says whether the data show it."""

    value: FloatArray
    sigma: FloatArray
    observed: bool

class SpinBlockFigures(TypedDict):
    """See `tumble.procedures.spin.result.SpinBlocks`."""

    time: FloatArray
    resting: FloatArray
    heading: FloatArray
    rate: FloatArray
    across: FloatArray
    force: FloatArray
    fit: FloatArray

class SpinFigures(TypedDict):
    """What one spin showed; pairs are (value, sigma), sigma infinite where not observed."""

    row_factor: NotRequired[float]
    turned_clockwise: float
    turned_counter_clockwise: float
    heading_span: float
    rate: float
    resting_time: float
    turning_time: float
    samples: int
    gyroscope_bias: BiasFigures
    level_free: BiasFigures
    published: BiasFigures
    level_free_is_default: bool
    up: FloatArray
    roll: tuple[float, float]
    pitch: tuple[float, float]
    floor_tilt: tuple[float, float]
    uphill_bearing: tuple[float, float]
    lever_arm: FloatArray
    lever_arm_sigma: FloatArray
    heading_scale: tuple[float, float]
    scale_clockwise: tuple[float, float]
    scale_counter_clockwise: tuple[float, float]
    slow_turn: tuple[float, float]
    turned_while_still: bool
    covariance: FloatArray
    by_earth: FloatArray
    chi_square: float
    degrees_of_freedom: int
    widening: float
    noise: FloatArray

class SpinProgress(TypedDict):
    """How far the procedure is: s at rest, rad turned (both directions), rad/s now."""

    still: float
    still_wanted: float
    turned: float
    turned_wanted: float
    rate: float
    at_rest: bool

class SpinMachine:
    """The device's state machine; `precision` is `f32` as on a device, or `f64`."""

    def __init__(self, settings: SpinSettings, precision: str = "f64") -> None: ...
    def start(self) -> None:
        """Idle -> still: gather from the next sample on."""
    def push(
        self,
        time: FloatArray,
        accelerometer: FloatArray,
        gyroscope: FloatArray,
        moving: FloatArray | None = None,
    ) -> list[tuple[float, str]]:
        """Take in successive samples, and say what happened, with its time.

        `moving` (n,) is 1 where the wheels turn, 0 where not, NaN where unknown. What can happen: `still
        began`, `still broken`, `still done`, `spin began`, `done`, `failed`.
        """
    def tick(self, time: float) -> str | None:
        """Say that time has passed, s of the samples' clock: a stream that stops fails the procedure."""
    def read_bias_instability(
        self, time: FloatArray, accelerometer: FloatArray, gyroscope: FloatArray
    ) -> None:
        """Read bias instability off the samples of the spin that was made; `figures` then counts it.

        As on a device the machine itself keeps sums only, which do not show it.
        """
    @property
    def state(self) -> str:
        """`idle`, `still`, `spin`, `done` or `failed`."""
    @property
    def failure(self) -> tuple[str, dict[str, float]] | None:
        """Kind and figures; `tumble.procedures.spin.messages` puts them in words."""
    @property
    def progress(self) -> SpinProgress: ...
    def figures(self, true_angle: tuple[float, float, float] | None = None) -> SpinFigures:
        """Give what was found so far; `CoreError` where nothing can be."""
    @staticmethod
    def state_bytes(precision: str = "f32") -> int: ...

def fit_spin(
    time: FloatArray,
    accelerometer: FloatArray,
    gyroscope: FloatArray,
    rests: FloatArray,
    settings: SpinSettings,
    precision: str = "f64",
    true_angle: tuple[float, float, float] | None = None,
) -> tuple[SpinFigures, SpinBlockFigures]:
    """Estimate from the samples of one spin; `rests` (k, 2) are the times, s, between which the robot stood.

    `true_angle` is the angle truly turned clockwise and counter-clockwise, rad, both positive, NaN where
    unknown, and its 1-sigma.

    Raises `CoreError` with the same kinds as `SpinMachine.failure`.
    """

class RedundancyUnit:
    """One unit of a redundant set as the monitor is told of it; unit 0 is the primary."""

    def __init__(
        self,
        identity: int,
        *,
        sensor_from_primary: FloatArray | None = None,
        lever_arm: FloatArray | None = None,
        time_offset: float = 0.0,
        axes: tuple[bool, bool, bool, bool, bool, bool] = (True, True, True, True, True, True),
        specific_force_range: float | None = None,
        angular_rate_range: float | None = None,
        accelerometer_threshold: str | None = None,
        gyroscope_threshold: str | None = None,
        calibration: Mapping[str, tuple[FloatArray, FloatArray, float]] | None = None,
    ) -> None:
        """Describe a unit.

        `sensor_from_primary` (3, 3) is the nominal rotation; `lever_arm` (3,) m from the primary, in its case
        frame, where known; `time_offset` s is added to the unit's time; thresholds are its own in
        place of those of the settings; `calibration` is the primary's own, for each of `accelerometer` and
        `gyroscope` the M (3, 3) and b (3,) of `y = M u + b` and the residual that was left of a channel.
        """

class RedundancyMonitor:
    """A primary and one to seven secondaries; `precision` is `f64`, or `f32` as on a device."""

    def __init__(
        self,
        units: Sequence[RedundancyUnit],
        settings: Mapping[str, object],
        precision: str = "f64",
    ) -> None:
        """`CoreError` with args (`contradictory settings`, {...}) where settings contradict each other."""
    def replay(
        self,
        times: Sequence[FloatArray],
        specific_forces: Sequence[FloatArray],
        angular_rates: Sequence[FloatArray],
        commands: Sequence[tuple[float, str]] = (),
        measurements: Sequence[tuple[float, str, int, FloatArray, FloatArray, float]] = (),
        keep_output: bool = False,
        progress: Callable[[float], None] | None = None,
        arrivals: Sequence[FloatArray] | None = None,
        temperatures: Sequence[FloatArray | None] | None = None,
    ) -> RedundancyReplay:
        """Push what all units said, in order of time, up to the end; may be called again with what follows.

        Where `arrivals` are given, (n,) s of each unit, never decreasing, their order is that of samples.

        Times (n,) s, specific forces (n, 3) m/s^2 and angular rates (n, 3) rad/s of each unit, primary first.
        Commands are `evaluate` and `return to primary`. Aiding measurements, in order of time, are time s,
        kind, unit, value (3,), sigma (3,); kinds are `velocity` and `body velocity`, m/s, `heading`, rad, and
        `score`, first of value. Temperatures (n,) degC, NaN of a sample, None without a thermometer.
        `progress` is told the share done, 0 to 1.
        """
    def push(
        self,
        unit: int,
        time: FloatArray,
        specific_force: FloatArray,
        angular_rate: FloatArray,
        commands: Sequence[tuple[float, str]] = (),
        measurements: Sequence[tuple[float, str, int, FloatArray, FloatArray, float]] = (),
        temperature: FloatArray | None = None,
    ) -> RedundancySaid:
        """Push samples of one unit as they come; arguments are those of `replay`."""
    def restore(self, record: Mapping[str, object]) -> str | None:
        """Take a stored error of a secondary; says why it was rejected, or `None`."""
    def restore_factory(self, record: Mapping[str, object]) -> None:
        """Take the error that a secondary had from the factory, from which thresholds may be counted."""
    def records(self) -> list[dict[str, object]]:
        """Everything stored: identity, sensor, and the fields of `SecondaryError` from matrix to followed."""
    @staticmethod
    def state_bytes(secondaries: int, precision: str = "f32") -> int: ...

class SetMonitor:
    """A redundant set by one model: units of a number, primary first; the next monitor, for benchmarks.

    Where units have clocks of their own, `finds_delays`; `precision` is `f64`, or `f32` as on a device.
    """

    def __init__(self, units: int, finds_delays: bool = True, precision: str = "f64") -> None: ...
    def replay(
        self,
        times: Sequence[FloatArray],
        specific_forces: Sequence[FloatArray],
        angular_rates: Sequence[FloatArray],
        arrivals: Sequence[FloatArray] | None = None,
    ) -> list[tuple[float, int, str, dict[str, float | int | str | bool | list[int]]]]:
        """Push all samples in order of arrival (n,) s, or of their stamps: events.

        Each has time s, unit or -1, name, figures. Times (n,) s, specific forces (n, 3) m/s^2 and angular
        rates (n, 3) rad/s of each unit, in the axes of the primary.
        """
    def set_errors(self, unit: int, rate: Sequence[float], force: Sequence[float]) -> None:
        """State what is known of a secondary: rows of both triangles with right sides, 22 and 135 numbers."""
    def errors(self, unit: int) -> tuple[list[float], list[float]] | None:
        """Known errors of a secondary, as `set_errors` takes them; `None` where the primary is wrong."""
    def state_bytes(self) -> int: ...

class RedundancySaid(TypedDict):
    """What samples led to, besides what the monitor now holds."""

    events: list[tuple[float, int, str, dict[str, float | int | str | bool | list[int]]]]
    """Time s, unit, event, figures; units by their numbers."""
    said: int
    """Samples of the output, asked for or not."""
    degraded: int
    """Those of a source that is known to be wrong, or contradicted."""
    output_time: FloatArray
    """(n,) s; empty unless asked for, like the other outputs."""
    output_unit: FloatArray
    """(n,) index of the source."""
    output_flags: FloatArray
    """(n,) 1 where the source is known to be wrong, else 0."""
    output_specific_force: FloatArray
    output_angular_rate: FloatArray

class RedundancyReplay(RedundancySaid):
    """What a replay gave."""

    window_time: FloatArray
    specific_force: list[FloatArray]
    angular_rate: list[FloatArray]
    specific_force_compensated: list[FloatArray]
    angular_rate_compensated: list[FloatArray]
    seconds: float
    """Time the replay took."""

class AlignForceFigures(TypedDict):
    """What specific forces show, once the rotation is known."""

    lever_arm: FloatArray
    lever_arm_covariance: FloatArray
    lever_arm_unseen: FloatArray
    accelerometer_bias: FloatArray
    accelerometer_bias_sigma: FloatArray
    accelerometer_angle: FloatArray
    accelerometer_angle_sigma: FloatArray
    accelerometer_delay: float
    accelerometer_delay_sigma: float
    accelerometer_stretch: FloatArray
    accelerometer_residual: float
    changed: AlignStep | None

class AlignStep(TypedDict):
    """Unknowns that have other values from a time on, s: later values less those before."""

    time: float
    size: list[float]

class AlignFigures(TypedDict):
    """How a secondary sits beside a primary; see `tumble.procedures.align.result.UnitAlignment`."""

    correlation: float
    motion: float
    window: float
    pairs: int
    one_clock: bool
    rotation_vector: FloatArray
    rotation_vector_covariance: FloatArray
    completed: bool
    widened: float
    sensor_from_primary: FloatArray
    rotation_covariance: FloatArray
    rotation_unseen: FloatArray
    gyroscope_bias: FloatArray
    gyroscope_bias_sigma: FloatArray
    gyroscope_stretch: FloatArray
    time_offset: float
    time_offset_sigma: float
    skew: float
    skew_sigma: float
    reference_time: float
    gyroscope_residual: float
    changed: AlignStep | None
    jumped: float | None
    forces: AlignForceFigures | None
    primary_saturated: int
    primary_not_finite: int
    secondary_saturated: int
    secondary_not_finite: int

def align_units(
    primary: tuple[FloatArray, FloatArray, FloatArray],
    secondary: tuple[FloatArray, FloatArray, FloatArray],
    *,
    search: float = 5.0,
    around: float = 0.0,
    one_clock: bool = False,
    rate_bias: tuple[float, float, float] | None = None,
    rate_bias_sigma: float = 0.1,
) -> AlignFigures:
    """Align a secondary with a primary; each is time (n,) s, ascending, specific force and rate (n, 3).

    The secondary's offset, s, is searched for within `search` of `around`; with `one_clock` there is no skew.
    `rate_bias`, rad/s, is the primary's own.

    Raises `CoreError` with the kinds that `tumble.procedures.align.messages` puts in words.
    """
