"""A simulated unit: what it recorded, and what is true of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble import _core
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.grade import Grade

PPM = 1e-6


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
class MagnetometerTruth:
    """True errors of three magnetometers: `y = M u + b`, `u` the field in the case of the reference, uT."""

    M: FloatArray
    """(3, 3) sensor from case: soft iron, scale, non-orthogonality and mounting."""
    b: FloatArray
    """(3,) uT: hard iron."""


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
    magnetometer: MagnetometerTruth | None = None
    """None where it has none."""


def simulated_unit(
    figures: _core.SimulatedUnitFigures,
    *,
    name: str,
    grade: Grade,
    serial: str,
    clock: str,
    faults: Sequence[Fault],
    magnetic: tuple[MagneticTrack, MagnetometerTruth] | None = None,
) -> SimulatedUnit:
    """Puts a unit together from what the native simulator gives; `clock` names the time base it shares."""
    samples = Chunk(figures["time"], figures["accelerometer"], figures["gyroscope"], figures["temperature"])
    offset, skew, phase = figures["clock"]
    return SimulatedUnit(
        name=name,
        grade=grade,
        samples=samples,
        recording=Recording.from_arrays(
            name,
            samples.time,
            samples.accelerometer,
            samples.gyroscope,
            samples.temperature,
            serial=serial,
            clock=clock,
            magnetic=magnetic[0] if magnetic else None,
        ),
        accelerometer=triad_truth(figures["accelerometer_truth"]),
        gyroscope=triad_truth(figures["gyroscope_truth"]),
        clock=ClockTruth(offset, skew / PPM, phase),
        faults=tuple(faults),
        magnetometer=magnetic[1] if magnetic else None,
    )


def triad_truth(figures: _core.TriadTruthFigures) -> TriadTruth:
    """Puts the truth of a triad together from what the native simulator gives."""
    return TriadTruth(
        M=figures["M"],
        b=figures["b"],
        K=np.diag(figures["scale"]),
        L=figures["L"],
        Q=figures["Q"],
        mounting=figures["mounting"],
        non_orthogonality=figures["non_orthogonality"],
        g_sensitivity=figures["g_sensitivity"],
        drift=figures["drift"],
        temperature_coefficient=figures["temperature_coefficient"],
        noise_density=figures["noise_density"],
        bias_instability=figures["bias_instability"],
        quantisation=figures["quantisation"],
    )
