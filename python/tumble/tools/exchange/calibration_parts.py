"""Parts of a calibration, and the error that remains without each.

`y = (1 + s(t)) K L Q u + b + d(t) + G f` (docs/theory/model.md): bias b, scale K, non-orthogonality L,
mounting Q, g-sensitivity G, and temperature, d and s. Other programs hold some of these.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from tumble.calibration.document import Calibration, GyroscopeCalibration, TriadCalibration
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.error_decomposition import factors
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_UNITS, TRIADS, CalibratedTriad

Part: TypeAlias = Literal[
    "bias", "scale", "non-orthogonality", "mounting", "g-sensitivity", "bias over temperature",
    "scale over temperature",
]  # fmt: skip
PARTS: Final[tuple[Part, ...]] = get_args(Part)
BIAS: Final[tuple[Part, ...]] = ("bias",)
MATRIX: Final[tuple[Part, ...]] = ("scale", "non-orthogonality", "mounting")
"""Parts that M consists of."""

TYPICAL: Final = {"accelerometer": STANDARD_GRAVITY, "gyroscope": 1.0, "magnetometer": 50.0}
"""m/s^2, rad/s and uT at which a loss is stated."""
_TYPICAL_WORDS = {"accelerometer": "at 1 g", "gyroscope": "at 1 rad/s", "magnetometer": "in 50 uT"}
NOTHING = 1e-12
"""m/s^2, rad/s or uT below which nothing is lost but the last digits of a float."""


@dataclass(frozen=True, slots=True)
class Loss:
    """An error that stays in corrected measurements, as the target cannot hold what would remove it."""

    unit: str
    """Name of the IMU."""
    triad: CalibratedTriad
    part: str
    """Part that is lost."""
    size: float
    """Largest error of a measurement, m/s^2, rad/s or uT."""
    condition: str = ""
    """Condition of the measurement."""

    def __str__(self) -> str:
        size = f"{self.size:.3g} {CALIBRATED_UNITS[self.triad]} {self.condition}".rstrip()
        return f"{self.unit}: {self.triad}: {self.part} is lost: {size}"


@dataclass(frozen=True, slots=True)
class SensingAxes:
    """M taken apart: `M = diag(scale) L Q`."""

    scale: FloatArray
    """(3,) lengths of the rows of M."""
    non_orthogonality: FloatArray
    """(3, 3) L, lower triangular with rows of unit length."""
    mounting: FloatArray
    """(3, 3) Q; a reflection where the axes are left-handed."""


def sensing_axes(matrix: FloatArray) -> SensingAxes:
    """Splits (3, 3) M into scale, non-orthogonality and mounting."""
    scale, lower, rotation = factors(matrix)
    return SensingAxes(np.diag(scale), lower, rotation)


def lower_and_rotation(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns lower triangular A with a positive diagonal and orthogonal R with `A R` the (3, 3) matrix."""
    scale, lower, rotation = factors(matrix)
    return scale @ lower, rotation


def section_of(triad: CalibratedTriad, correction: FloatArray, bias: FloatArray) -> dict[str, object]:
    """Creates the section of a triad of `u = C (y - b)`.

    `correction` is (3, 3) C, `bias` (3,) in the unit of the triad. Raises `CalibrationFileError` where C has
    no inverse.
    """
    try:
        return {
            "unit": CALIBRATED_UNITS[triad],
            "M": np.linalg.inv(correction),
            "b": np.asarray(bias, np.float64),
        }
    except np.linalg.LinAlgError:
        raise CalibrationFileError(f"the matrix of the {triad} has no inverse; check its numbers") from None


def losses(calibration: Calibration, held: Mapping[CalibratedTriad, Collection[Part]]) -> list[Loss]:
    """Returns the losses of a calibration where only these parts of each triad are held."""
    return [
        loss
        for triad in held
        if (section := getattr(calibration, triad)) is not None
        for part, size, condition in _costs(triad, section)
        if part not in held[triad] and size > NOTHING
        for loss in [Loss(calibration.name, triad, part, size, condition)]
    ]


def frame_losses(calibration: Calibration, frame_from_case: FloatArray) -> tuple[Loss, ...]:
    """Returns the loss by results in a frame of the sensor's, (3, 3) from the case."""
    return tuple(
        Loss(calibration.name, triad, "mounting in the case", size, _TYPICAL_WORDS[triad])
        for triad in TRIADS
        if getattr(calibration, triad) is not None
        if (size := _beside_identity(triad, frame_from_case)) > NOTHING
    )


def _beside_identity(triad: CalibratedTriad, matrix: FloatArray) -> float:
    return TYPICAL[triad] * float(np.linalg.norm(matrix - np.eye(3), 2))


def _costs(triad: CalibratedTriad, section: TriadCalibration) -> list[tuple[Part, float, str]]:
    """Returns the largest error that leaving each part out would make."""
    axes, words = sensing_axes(section.M), _TYPICAL_WORDS[triad]
    costs: list[tuple[Part, float, str]] = [
        ("bias", float(np.abs(section.b).max()), ""),
        ("scale", _beside_identity(triad, np.diag(axes.scale)), words),
        ("non-orthogonality", _beside_identity(triad, axes.non_orthogonality), words),
        ("mounting", _beside_identity(triad, axes.mounting), words),
    ]
    if isinstance(section, GyroscopeCalibration) and section.g_sensitivity is not None:
        size = STANDARD_GRAVITY * float(np.linalg.norm(section.g_sensitivity, 2))
        costs.append(("g-sensitivity", size, _TYPICAL_WORDS["accelerometer"]))
    if (drift := section.temperature_drift) is not None:
        low, high = drift.range
        within = f"within {low:.0f} to {high:.0f} degC"
        costs.append(("bias over temperature", drift.largest_bias, within))
        costs.append(("scale over temperature", TYPICAL[triad] * drift.largest_scale, f"{words}, {within}"))
    return costs
