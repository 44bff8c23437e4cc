"""The calibration file of one IMU: what the procedures find, applied to later measurements.

Forward model, for each triad: `y = M u + b`, `y` the reading, `u` the truth in the case frame of the
IMU. Correction: `u = M^-1 (y - b)`. `M = K L Q`: scale, non-orthogonality, mounting (sensor_from_case). The
effect of temperature is in `temperature_drift.py`. A magnetometer has a further term, `c I`, in proportion to
a measured current `I`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, JsonValue, model_validator

from tumble.calibration.budget import Budget
from tumble.calibration.decision import Decision
from tumble.calibration.limits import Limits
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation import arrays
from tumble.foundation.body_axes import FLU, FRD, are_axes
from tumble.foundation.documents import (
    ArrayField,
    Document,
    Matrix,
    Name,
    Vector,
    VectorWithGaps,
    document_kind,
    document_text,
    read_document,
    write_document,
)
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import note_document
from tumble.foundation.log_reading import AS_LOGGED, LogReading
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.plain import finite_or_none
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.schemas import CALIBRATION
from tumble.foundation.units import CALIBRATED_TRIADS, TRIADS, CalibratedTriad
from tumble.foundation.words import join, printable, short

SCHEMA: Literal["tumble-calibration/3"] = "tumble-calibration/3"
_WITHOUT_MAGNETOMETER = "tumble-calibration/2"
"""Version whose files differ from those of the current one in that they hold no magnetometer."""
KIND = document_kind(SCHEMA)

_HEADER = f"""\
Calibration of one IMU by Tumble. y = M u + b, M = K L Q; to correct a measurement: u = M^-1 (y - b).
SI units, magnetic field in uT, angles in degrees, case frame of the IMU; null: the data did not show it.
Schema: tumble schema {CALIBRATION.name}"""

Covariance: TypeAlias = Annotated[FloatArray, ArrayField((12, 12), gaps=True)]
Group: TypeAlias = Literal["bias", "matrix", "g-sensitivity"]

_MATRIX_TOLERANCE = 1e-9
"""Largest difference between M and K L Q: that of floats typed with ten digits."""
_LARGEST_BIAS = 1e6
"""m/s^2, rad/s or uT."""
_LARGEST_SCALE = 1e6
_SINGULAR = 1e-6
"""Smallest singular value of M over its largest for which a correction still means something."""


class NonOrthogonality(Document):
    """Deviation of the angle between two sensing axes from 90 deg, `asin(s_i . s_j)`, in degrees."""

    xy: float | None
    yz: float | None
    zx: float | None


class Angles(Document):
    """Angles of the axes in M, in degrees."""

    non_orthogonality: NonOrthogonality = Field(alias="non-orthogonality")
    mounting: VectorWithGaps
    """Rotation vector of Q (sensor_from_case), deg."""


class Sigma(Document):
    """1-sigma of what people read off a calibration; null where the data did not show it."""

    bias: VectorWithGaps
    """Bias in the unit of the triad."""
    scale: VectorWithGaps
    """Sigma of the diagonal of K, 1."""
    non_orthogonality: NonOrthogonality = Field(alias="non-orthogonality")
    """deg."""
    mounting: VectorWithGaps
    """deg."""


class Inherited(Document):
    """Uncertainty that the reference leaves on all its targets, and gravity on all that it was used for.

    Differences of units calibrated with one reference, at one place, are free of it.
    """

    source: str
    """Source of the uncertainty: the calibration of the reference, a grade, the rate table, or gravity."""
    sigma: Sigma
    """1-sigma, contained in the `sigma` of the triad."""
    covariance: Covariance
    """Covariance of [M row by row, b], to be added to the `covariance` of the triad."""


class Residual(Document):
    """Measured minus modelled at one rest or over one turn, in the unit of the triad."""

    label: str
    value: Vector
    sigma: VectorWithGaps
    """1-sigma of the measured mean."""


class TriadCalibration(Document):
    """Three sensing axes. `M` and `b` suffice to correct; the rest are their uncertainty and origin."""

    unit: Literal["m/s^2", "rad/s", "uT"]
    """Unit of the readings."""
    M: Matrix
    """sensor from case: y = M u + b."""
    b: Vector
    """Bias in the unit of the triad."""
    K: Matrix | None = None
    """Diagonal: scale of each axis."""
    L: Matrix | None = None
    """Lower triangular with unit rows: non-orthogonality."""
    Q: Matrix | None = None
    """Rotation sensor_from_case: mounting."""
    angles: Angles | None = None
    sigma: Sigma | None = None
    estimated: tuple[Group, ...] = Field(default=(), strict=False)
    """Groups of parameters that the data showed; the others stand at their ideal values."""
    unobservable: tuple[str, ...] = Field(default=(), strict=False)
    """Parameters that the data did not show, in words."""
    rank: int | None = None
    """Number of directions of [M, b] that the data showed, at most 12."""
    chi_square: float | None = None
    degrees_of_freedom: int | None = None
    widening: float | None = None
    """Factor by which all sigmas were widened because the residuals exceed the noise; beyond 10 the model is
    not met."""
    noise_density: VectorWithGaps | None = None
    """White noise, unit / sqrt(Hz)."""
    bias_instability: VectorWithGaps | None = None
    """Flicker noise, in the unit of the triad."""
    random_walk: VectorWithGaps | None = None
    """Rate or acceleration random walk, unit / s / sqrt(Hz)."""
    noise_density_for_filters: VectorWithGaps | None = None
    """White noise as a filter needs it: that above, or, where the log does not show it, the measured
    Allan deviation at 1 s."""
    random_walk_for_filters: VectorWithGaps | None = None
    """Random walk as a filter needs it: that above, or, where the log does not show it, its upper bound."""
    temperature_drift: TemperatureDrift | None = None
    """Effect of temperature on bias and scale; M and b are then those at its reference temperature."""
    residuals: tuple[Residual, ...] = Field(default=(), strict=False)
    covariance: Covariance | None = None
    """Covariance of [M row by row, b], without the inherited part."""
    inherited: Inherited | None = None
    """Contribution of the uncertainty of reference and gravity; absent where neither is stated."""
    budget: tuple[Budget, ...] | None = Field(default=None, strict=False)
    """Uncertainty of each parameter that the data showed, source by source; absent where no source but the
    session is stated."""

    @property
    def total_covariance(self) -> FloatArray | None:
        """(12, 12) of [M row by row, b], with what is inherited; None where the file states no covariance."""
        if self.covariance is None or self.inherited is None:
            return self.covariance
        return self.covariance + self.inherited.covariance

    @model_validator(mode="after")
    def _matrices_agree(self) -> TriadCalibration:
        if np.abs(self.b).max() > _LARGEST_BIAS or np.abs(self.M).max() > _LARGEST_SCALE:
            raise ValueError(
                f"no sensor is that far off: b is up to {np.abs(self.b).max():.3g} {self.unit}, M up to "
                f"{np.abs(self.M).max():.3g}; give readings in {self.unit}"
            )
        drift = self.temperature_drift.largest_bias if self.temperature_drift is not None else 0.0
        if drift > _LARGEST_BIAS:
            raise ValueError(
                f"no sensor drifts that far: temperature_drift.bias adds up to {drift:.3g} {self.unit}; "
                f"give it in {self.unit}"
            )
        singular_values = np.linalg.svd(self.M, compute_uv=False)
        if singular_values[-1] <= _SINGULAR * singular_values[0]:
            raise ValueError("M cannot be inverted, so nothing can be corrected with it; check its rows")
        parts = (self.K, self.L, self.Q)
        if any(part is not None for part in parts):
            if self.K is None or self.L is None or self.Q is None:
                raise ValueError("K, L and Q belong together: give all three or only M")
            error = float(np.abs(self.K @ self.L @ self.Q - self.M).max())
            if error > _MATRIX_TOLERANCE * singular_values[0]:
                raise ValueError(
                    f"M differs from K L Q by {error:.2g}; edit M alone and leave K, L, Q and angles out"
                )
        if self.angles is not None or self.covariance is not None or self.inherited is not None:
            from tumble.calibration.agreement import refuse_disagreement  # needs the native module

            refuse_disagreement(self)
        return self

    def at_reference(self, readings: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Returns what readings (n, 3), at (n,) degC, would be at the temperature at which M and b hold.

        Without a temperature, or where its effect is not known, they stay as they are.
        """
        if self.temperature_drift is None or temperature is None:
            return readings
        arrays.refuse_other_lengths([("temperature", temperature), ("readings", readings)])
        return self.temperature_drift.at_reference(readings, self.b, temperature)

    @property
    def residual(self) -> float:
        """Root mean square of a channel over all residuals, unit of the triad; 0 if there are none."""
        values = np.array([each.value for each in self.residuals])
        return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


class AccelerometerCalibration(TriadCalibration):
    """Three accelerometers, m/s^2."""

    unit: Literal["m/s^2"] = "m/s^2"


class RateLevel(Document):
    """A sensing axis at one constant rate."""

    rate: float
    """deg/s, true, along the sensing axis."""
    turns: int
    scale: float
    """Reading less bias over true rate."""
    scale_sigma: float
    deviation: float
    """ppm of full scale, from the straight line through all rates."""
    deviation_sigma: float


class AxisResponse(Document):
    """A sensing axis at constant rates; its figures are those of IEEE Std 952 and 1431."""

    axis: Literal["x", "y", "z"]
    full_scale: float
    """deg/s."""
    scale: float
    scale_sigma: float
    linearity: float
    """ppm of full scale: largest deviation from the straight line by least squares, without sign."""
    linearity_sigma: float
    asymmetry: float | None = None
    """ppm: slope at positive less slope at negative rates over the slope."""
    asymmetry_sigma: float | None = None
    levels: tuple[RateLevel, ...] = Field(strict=False)


class GyroscopeCalibration(TriadCalibration):
    """Three gyroscopes, rad/s. With g-sensitivity: y = M w + b + G f, `f` the true specific force."""

    unit: Literal["rad/s"] = "rad/s"
    g_sensitivity: Matrix | None = None
    """G, rad/s per m/s^2."""
    g_sensitivity_sigma: Annotated[FloatArray, ArrayField((3, 3), gaps=True)] | None = None
    constant_rates: tuple[AxisResponse, ...] | None = Field(default=None, strict=False)
    """Each axis that turned at constant rates."""


class FieldQuantity(Document):
    """A quantity of the Earth's magnetic field at the place of the calibration."""

    value: float
    sigma: float | None = Field(default=None, ge=0.0)
    """1-sigma; null where nobody states it."""
    source: str
    """`found` where the calibration estimated it, otherwise where its value was taken from."""


class MagnetometerCalibration(TriadCalibration):
    """Three magnetometers, uT: y = M u + b + c I, `u` the field of the Earth in the case frame.

    `b` is hard iron. `M` holds scale, non-orthogonality, mounting and soft iron, which no magnetometer
    separates. `I` is the current through the conductors nearby, or the throttle that it follows.
    """

    unit: Literal["uT"] = "uT"
    field: FieldQuantity | None = None
    """Strength of the field, uT; absent where scale is relative to an arbitrary one."""
    dip: FieldQuantity | None = None
    """Inclination of the field, deg: positive where it points below the horizon."""
    current: Vector | None = None
    """c, uT per `current_unit` of what the log states of the motors; absent where none was calibrated."""
    current_sigma: VectorWithGaps | None = None
    """1-sigma of c."""
    current_unit: LoadUnit = "A"
    """Unit of the current: ampere, or 1, the share 0 to 1 of a throttle."""

    @model_validator(mode="after")
    def _current_is_known(self) -> MagnetometerCalibration:
        if self.current is None and self.current_sigma is not None:
            raise ValueError("current_sigma is the uncertainty of current, which is missing; give both")
        return self

    @property
    def unit_of_current(self) -> str:
        """Unit of c."""
        return f"{self.unit} per A" if self.current_unit == "A" else self.unit

    def freed_of_current(self, readings: FloatArray, current: FloatArray | None) -> FloatArray:
        """Returns readings (n, 3), uT, without the field of the current (n,).

        Without a current, where it is NaN, or where its effect is not known, they stay as they are.
        """
        if self.current is None or current is None:
            return readings
        arrays.refuse_other_lengths([("current", current), ("readings", readings)])
        return readings - np.nan_to_num(current)[:, np.newaxis] * self.current


class Gravity(Document):
    """Local gravity used, m/s^2, and where it was taken from."""

    value: float = Field(gt=0.0)
    source: str
    sigma: float | None = Field(default=None, ge=0.0)
    """1-sigma, within the sigmas of the accelerometer; null where nobody states it, and scale is relative to
    this gravity."""


class Temperature(Document):
    """Sensor temperature at rest during the calibration, degC."""

    low: float
    mean: float
    high: float


class Log(Document):
    """The recording that a calibration was found from."""

    file: str
    """Its name, without folders."""
    sha256: str = ""
    """SHA-256 of its bytes, in hexadecimal; of a folder, that of the names and digests of its files."""
    duration: float | None = None
    """s."""


class Reading(Document):
    """Options by which the logs were read that a calibration was found from, and what had corrected them.

    Units, scales and zeros are those of the log.
    """

    axes: str = AS_LOGGED
    """Case axes in terms of the log's, such as `y,-x,z`."""
    accelerometer_sign: int | None = None
    """-1 where the signs of the accelerometer were changed."""
    accelerometer_zero: Vector | None = None
    gyroscope_zero: Vector | None = None
    accelerometer_scale: Vector | None = None
    """Counts per unit."""
    gyroscope_scale: Vector | None = None
    magnetometer_scale: Vector | None = None
    accelerometer_unit: str | None = None
    """Unit that the user stated."""
    gyroscope_unit: str | None = None
    magnetometer_unit: str | None = None
    raw: bool | None = None
    """True where nobody stated the scales: they are nominal ones, for which alone the calibration holds."""
    correction: str | None = None
    """Correction of the samples before they were logged or converted, on top of which the calibration holds:
    `sha256:...` of the calibration that made it, or its source in words."""


class ReferenceUncertainty(Document):
    """Source of the uncertainty of the reference: `calibration`, `grade tactical`, or `not stated`.

    Where it is not stated, scale and non-orthogonality are relative to the reference.
    """

    accelerometer: str
    gyroscope: str


class CertificateOfReference(Document):
    """Certificate of the reference, to which the calibration is traceable."""

    laboratory: Name
    number: str
    date: str
    """Date of the calibration of the reference, such as `2026-03-31`."""
    due: str = ""
    """Last day on which it holds; empty where the certificate does not state it."""
    manufacturer: Name = ""
    model: Name = ""
    serial: Name = ""
    file: str
    """Name of the file, without folders."""
    sha256: str
    """SHA-256 of the bytes of that file."""
    signature: str = ""
    """Outcome of the verification of its signature; empty where none was tried."""


class Reference(Document):
    """The IMU that supplied the truth."""

    name: Name
    serial: Name = ""
    calibration_hash: str = ""
    """sha256 of the calibration the reference itself carried; empty if it carried none."""
    log: Log | None = None
    uncertainty: ReferenceUncertainty | None = None
    certificate: CertificateOfReference | None = None


class Method(Document):
    """Method by which the calibration was found."""

    procedure: str
    truth: str = ""
    options: dict[str, JsonValue] = Field(default_factory=dict)


class Contribution(Document):
    """A run of a procedure that gave parts of a calibration which its `method` did not."""

    gave: tuple[str, ...] = Field(strict=False)
    """Parts, by triad: `accelerometer noise`, `gyroscope matrix`, `gyroscope temperature drift`."""
    method: Method
    software: str = ""
    date: str = ""
    """UTC, ISO 8601."""
    operator: Name = ""
    station: Name = ""
    logs: tuple[Log, ...] = Field(default=(), strict=False)
    verdict: str = ""
    """Verdict as of a calibration; `measured` for noise and temperature."""


class Calibration(Document):
    """One IMU's calibration, as it stands in the file.

    `accelerometer`, `gyroscope` or `magnetometer` is None where that triad was not calibrated; it is then
    left as measured.
    """

    schema_: Literal["tumble-calibration/1", "tumble-calibration/2", "tumble-calibration/3"] = Field(
        default=SCHEMA, alias="schema"
    )
    """Files of version 1 are read, and saved, as they are; those of version 2 are read, and saved as 3."""
    name: Name
    serial: Name = ""
    software: str = ""
    date: str = ""
    """Date of the calibration: UTC, ISO 8601, such as `2026-11-22T06:20:00Z`."""
    operator: Name = ""
    station: Name = ""
    axes: str | None = None
    """Directions of the case axes x, y and z in a vehicle (F or B, L or R, U or D), such as FRD, where the
    log defines them."""
    reading: Reading | None = None
    """Options by which the logs were read; absent in files that do not state it."""
    log: Log | None = None
    verdict: str = ""
    """`pass` or `fail` by the limits below, `calibrated` where there were none, or `model not met`."""
    limits: Limits | None = None
    """Limits against which it was checked."""
    decision: Decision | None = None
    """Verdicts by the decision rule of the limits; absent where they state none."""
    method: Method | None = None
    """Method of all parts that no contribution gave; absent where there is no such part."""
    contributions: tuple[Contribution, ...] | None = Field(default=None, strict=False)
    """Contributions to a calibration that was built up in steps, the earliest first."""
    reference: Reference | None = None
    gravity: Gravity | None = None
    temperature: Temperature | None = None
    accelerometer: AccelerometerCalibration | None = None
    gyroscope: GyroscopeCalibration | None = None
    magnetometer: MagnetometerCalibration | None = None

    @model_validator(mode="before")
    @classmethod
    def _renew_version(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        key = "schema" if "schema" in data else "schema_"
        if data.get(key) != _WITHOUT_MAGNETOMETER:
            return data
        if data.get("magnetometer") is not None:
            raise ValueError(_no_key_of("magnetometer", _WITHOUT_MAGNETOMETER))
        return {**data, key: SCHEMA}

    @model_validator(mode="after")
    def _has_a_triad(self) -> Calibration:
        if not self.triads():
            raise ValueError(
                "has no accelerometer, gyroscope or magnetometer section; give at least one of them"
            )
        return self

    @model_validator(mode="after")
    def _has_right_handed_axes(self) -> Calibration:
        if self.axes is not None and not are_axes(self.axes):
            raise ValueError(
                f"axes {short(self.axes)} are none of a vehicle; give directions of x, y and z such as {FRD} "
                f"or {FLU}"
            )
        return self

    @model_validator(mode="after")
    def _is_of_its_version(self) -> Calibration:
        newer = {
            "temperature_drift": self.temperature_drifts(CALIBRATED_TRIADS),
            "contributions": self.contributions,
            "reading": self.reading,
            "magnetometer": self.magnetometer,
        }
        for key, value in newer.items():
            if value and self.schema_ != SCHEMA:
                raise ValueError(_no_key_of(key, self.schema_))
        return self

    @classmethod
    def load(cls, path: Path | str) -> Calibration:
        """Reads a calibration file.

        Raises `CalibrationFileError` in one line: file, line, key, what is wrong and what to do.
        """
        return read_document(path, cls, CALIBRATION)

    def save(self, path: Path | str) -> None:
        """Writes the file in full or not at all; raises `OutputError` where it cannot be written."""
        write_document(path, _HEADER, self.content())
        note_document(path, self)

    def text(self) -> str:
        """Returns the file as text."""
        return document_text(_HEADER, self.content())

    @overload
    def correct(
        self, accelerometer: ArrayLike, gyroscope: ArrayLike, temperature: ArrayLike | None = None
    ) -> tuple[FloatArray, FloatArray]: ...
    @overload
    def correct(
        self, accelerometer: ArrayLike, gyroscope: None = None, temperature: ArrayLike | None = None
    ) -> tuple[FloatArray, None]: ...
    @overload
    def correct(
        self, accelerometer: None, gyroscope: ArrayLike, temperature: ArrayLike | None = None
    ) -> tuple[None, FloatArray]: ...
    def correct(
        self,
        accelerometer: ArrayLike | None,
        gyroscope: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> tuple[FloatArray | None, FloatArray | None]:
        """Specific force (n, 3), m/s^2, and angular rate (n, 3), rad/s, freed of the calibrated errors.

        A single sample, (3,), comes back as one; lists and columns of tables will do. Both are in the case
        frame of the IMU. A triad without a calibration comes back as it was given; one that was not
        measured is None.

        `temperature`, degC, is one for all or (n,), one for each. A triad whose drift with it is known is
        taken to be at the reference of that drift where it is NaN or not given, and at the edge of the range
        where it is beyond; `TemperatureCounts` counts those.

        Raises `ArrayError` for other shapes, `ProcedureError` where the gyroscope's response to specific
        force was calibrated and that is not given sample for sample.
        """
        from tumble import _core  # reading and writing files works without the native module

        force = None if accelerometer is None else arrays.triad(accelerometer, "accelerometer")
        rate = None if gyroscope is None else arrays.triad(gyroscope, "gyroscope")
        true_force = force
        if force is not None and self.accelerometer is not None:
            at_reference = self.accelerometer.at_reference(force, _for_each(force, temperature))
            true_force = _core.correct(at_reference, self.accelerometer.M, self.accelerometer.b)
        if rate is not None and self.gyroscope is not None:
            if self.gyroscope.g_sensitivity is not None:
                rate = rate - self._force_for_each(rate, true_force) @ self.gyroscope.g_sensitivity.T
            at_reference = self.gyroscope.at_reference(rate, _for_each(rate, temperature))
            rate = _core.correct(at_reference, self.gyroscope.M, self.gyroscope.b)
        return _like(accelerometer, true_force), _like(gyroscope, rate)

    def correct_magnetic(
        self, field: ArrayLike, current: ArrayLike | None = None, temperature: ArrayLike | None = None
    ) -> FloatArray:
        """Magnetic field (n, 3), uT, in the case frame of the IMU, freed of the calibrated errors.

        A single sample, (3,), comes back as one. `current`, in the unit of the calibration, and
        `temperature`, degC, are one for all or (n,), one for each. Where one is NaN or not given, its effect
        is not corrected. Without a calibrated magnetometer the field comes back as it was given.

        Raises `ArrayError` for other shapes.
        """
        from tumble import _core  # reading and writing files works without the native module

        readings = arrays.triad(field, "field")
        if self.magnetometer is not None:
            freed = self.magnetometer.freed_of_current(readings, _for_each(readings, current, "current"))
            at_reference = self.magnetometer.at_reference(freed, _for_each(freed, temperature))
            readings = _core.correct(at_reference, self.magnetometer.M, self.magnetometer.b)
        single: FloatArray = readings[0] if len(readings) == 1 and np.ndim(field) == 1 else readings
        return single

    def at_reference(self, chunk: Chunk) -> Chunk:
        """Returns samples as they would have been measured at the temperature at which M and b hold."""
        accelerometer, gyroscope = chunk.accelerometer, chunk.gyroscope
        if self.accelerometer is not None:
            accelerometer = self.accelerometer.at_reference(accelerometer, chunk.temperature)
        if self.gyroscope is not None:
            gyroscope = self.gyroscope.at_reference(gyroscope, chunk.temperature)
        return replace(chunk, accelerometer=accelerometer, gyroscope=gyroscope)

    def _force_for_each(self, rate: FloatArray, force: FloatArray | None) -> FloatArray:
        if force is None or len(force) != len(rate):
            raise ProcedureError(
                f"{self.name}: the gyroscope responds to specific force, which its calibration corrects; "
                "give a reading of the accelerometer for each of the gyroscope"
            )
        return force

    def temperature_drifts(
        self, triads: Sequence[CalibratedTriad] = TRIADS
    ) -> dict[CalibratedTriad, TemperatureDrift]:
        """Returns what is known of the drift of these triads with temperature."""
        return {
            name: triad.temperature_drift
            for name, triad in self.triads()
            if name in triads and triad.temperature_drift is not None
        }

    def triads(self) -> list[tuple[CalibratedTriad, TriadCalibration]]:
        """Returns the triads that were calibrated, by name."""
        pairs: tuple[tuple[CalibratedTriad, TriadCalibration | None], ...] = (
            ("accelerometer", self.accelerometer),
            ("gyroscope", self.gyroscope),
            ("magnetometer", self.magnetometer),
        )
        return [(kind, triad) for kind, triad in pairs if triad is not None]

    @property
    def log_reading(self) -> LogReading:
        """Options by which its logs were read; empty where the file does not state it."""
        return {} if self.reading is None else self.reading.content()

    @property
    def bias_instability(self) -> tuple[float, float] | None:
        """B of accelerometer, m/s^2, and gyroscope, rad/s, root mean square over the axes.

        None unless the file states both.
        """
        inertial = (self.accelerometer, self.gyroscope)
        stated = [triad.bias_instability for triad in inertial if triad is not None]
        known = [float(np.sqrt(np.mean(values**2))) for values in stated if values is not None]
        return (known[0], known[1]) if len(known) == 2 and np.isfinite(known).all() else None

    def hash(self) -> str:
        """sha256, in hexadecimal, of the content: the same however the file is laid out.

        Files of versions 2 and 3 with the same content have the same one, so that results and registries
        made with version 2 still find their calibrations.
        """
        content = self.content()
        if self.magnetometer is None and self.schema_ == SCHEMA:
            content["schema"] = _WITHOUT_MAGNETOMETER
        canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(canonical.encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Calibration) and self.content() == other.content()

    def __hash__(self) -> int:
        return int(self.hash()[:15], 16)

    def __repr__(self) -> str:
        serial = f", serial {self.serial!r}" if self.serial else ""
        lines = [f"  {kind}: {_summary(triad)}" for kind, triad in self.triads()]
        lines += [f"  {join(each.gave)} by {each.method.procedure}" for each in self.contributions or ()]
        return "\n".join([f"Calibration({self.name!r}{serial})", *lines])

    __str__ = __repr__

    def _repr_html_(self) -> str:
        from html import escape

        title = escape(self.name + (f" ({self.serial})" if self.serial else ""))
        rows = "".join(_html_row(kind, triad) for kind, triad in self.triads())
        head = "".join(f"<th>{cell}</th>" for cell in ("", "M", "b", "angles"))
        return printable(f"<table><caption>{title}</caption><tr>{head}</tr>{rows}</table>")


def _no_key_of(key: str, version: str) -> str:
    return f"{key} is none of the keys of {version}; say schema: {SCHEMA}"


def _for_each(readings: FloatArray, values: ArrayLike | None, name: str = "temperature") -> FloatArray | None:
    """Returns temperature, degC, or current of each reading, where it is one for all or one for each."""
    if values is None or np.ndim(values):
        return None if values is None else arrays.column(values, name)
    return np.repeat(arrays.column(values, name), len(readings))


def _like(given: ArrayLike | None, corrected: FloatArray | None) -> FloatArray | None:
    """Returns a single sample the shape it came in."""
    if given is None or corrected is None:
        return None
    single: FloatArray = corrected[0] if len(corrected) == 1 and np.ndim(given) == 1 else corrected
    return single


def _summary(triad: TriadCalibration) -> str:
    bias = ", ".join(f"{value:.6g}" for value in triad.b)
    text = f"b = [{bias}] {triad.unit}"
    if triad.temperature_drift is not None:
        low, high = triad.temperature_drift.range
        text += f" at {triad.temperature_drift.reference:g} degC, drift known from {low:g} to {high:g} degC"
    if triad.estimated == ("bias",):
        return f"{text}, bias only"
    scale = ", ".join(f"{value:.6g}" for value in np.linalg.norm(triad.M, axis=1))
    return f"{text}, scale = [{scale}]" + "".join(f", {line}" for line in _angle_lines(triad)[:1])


def _angle_lines(triad: TriadCalibration) -> list[str]:
    """Non-orthogonality and mounting in words, empty where the file does not state them."""
    if triad.angles is None:
        return []
    skew = triad.angles.non_orthogonality
    pairs = {"xy": skew.xy, "yz": skew.yz, "zx": skew.zx}
    mounting = dict(zip("xyz", map(finite_or_none, triad.angles.mounting), strict=True))
    return [_named("non-orthogonality", pairs), _named("mounting", mounting)]


def _named(title: str, angles: dict[str, float | None]) -> str:
    figures = [
        f"{axis} {'not shown' if angle is None else f'{angle:.4g} deg'}" for axis, angle in angles.items()
    ]
    return f"{title} " + ", ".join(figures)


def _html_row(kind: str, triad: TriadCalibration) -> str:
    matrix = "<br>".join(" ".join(f"{value:.6f}" for value in row) for row in triad.M)
    bias = "<br>".join(f"{value:.6g} {triad.unit}" for value in triad.b)
    cells = "".join(f"<td>{cell}</td>" for cell in (kind, matrix, bias, "<br>".join(_angle_lines(triad))))
    return f"<tr>{cells}</tr>"
