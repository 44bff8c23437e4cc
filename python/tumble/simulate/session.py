"""A simulated session: what was recorded, and what is true."""

from __future__ import annotations

from dataclasses import dataclass, field

from tumble.recording import Chunk, FloatArray, Recording
from tumble.simulate.fault import Fault
from tumble.simulate.grade import Grade
from tumble.simulate.scenario import TurntableScenario


@dataclass(frozen=True, slots=True)
class TriadTruth:
    """True errors of three accelerometers or three gyroscopes: `y = M u + b + G f`, `M = K L Q`.

    `u` is the truth in the case frame of the reference, `f` the true specific force; `unit` is m/s^2 or
    rad/s.
    """

    M: FloatArray
    """(3, 3) sensor from case."""
    b: FloatArray
    """(3,) unit, at 25 degC."""
    K: FloatArray
    """(3, 3) diagonal scale."""
    L: FloatArray
    """(3, 3) lower triangular with unit rows."""
    Q: FloatArray
    """(3, 3) rotation, sensor_from_case."""
    mounting: FloatArray
    """(3,) rotation vector of Q, rad."""
    non_orthogonality: FloatArray
    """(3,) deviation from 90 degrees of the axes xy, yz, zx, rad."""
    g_sensitivity: FloatArray
    """(3, 3) G, rad/s per m/s^2; zero for accelerometers."""
    drift: FloatArray
    """(3,) unit: mean over the recording of what bias instability and temperature added to b."""
    temperature_coefficient: FloatArray
    """(3,) unit / K."""
    noise_density: float
    """White noise N, unit / sqrt(Hz)."""
    bias_instability: float
    """B, unit; 0 where it was off."""
    quantisation: float
    """Step of the output, unit; 0 where it was off."""


@dataclass(frozen=True, slots=True)
class ClockTruth:
    """A unit's clock against that of the session: own = t + offset + skew t."""

    offset: float
    """s."""
    skew: float
    """Parts per million."""
    phase: float
    """First sample, in sample periods after the start of the session."""


@dataclass(frozen=True, slots=True)
class SimulatedUnit:
    """One unit: what it recorded and what is true of it."""

    name: str
    grade: Grade
    samples: Chunk = field(repr=False)
    """All of its recording, on its own clock."""
    recording: Recording
    accelerometer: TriadTruth
    gyroscope: TriadTruth
    clock: ClockTruth
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class TrueRest:
    """The table at rest."""

    pose: str
    start: float
    end: float
    """s of the session's clock."""
    table_error: FloatArray
    """(3,) rotation vector, rad, table frame, by which the table misses the pose."""
    specific_force: FloatArray
    """(3,) m/s^2, case frame."""
    angular_rate: FloatArray
    """(3,) rad/s, case frame: the Earth's."""


@dataclass(frozen=True, slots=True)
class SimulatedTurntable:
    """A session: reference and targets, with their truth."""

    scenario: TurntableScenario
    reference_unit: SimulatedUnit
    target_units: tuple[SimulatedUnit, ...]
    R_e: FloatArray
    """(3, 3) mounting of the shared structure, case_from_table."""
    mounting: FloatArray
    """(3,) rotation vector of R_e, rad."""
    earth_rate: FloatArray
    """(3,) rad/s, level frame: x east, y north, z up."""
    rests: tuple[TrueRest, ...]
    duration: float
    """s."""

    @property
    def reference(self) -> Recording:
        """Recording of the reference."""
        return self.reference_unit.recording

    @property
    def targets(self) -> tuple[Recording, ...]:
        """Recordings of the targets."""
        return tuple(unit.recording for unit in self.target_units)

    @property
    def units(self) -> tuple[SimulatedUnit, ...]:
        """The reference, then the targets."""
        return (self.reference_unit, *self.target_units)

    def __getitem__(self, name: str) -> SimulatedUnit:
        """Give the unit of that name; raises `KeyError`."""
        for unit in self.units:
            if unit.name == name:
                return unit
        raise KeyError(name)
