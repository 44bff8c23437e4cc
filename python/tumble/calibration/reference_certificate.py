"""The certificate of a reference: its error model as a laboratory measured it, with U, dates and identity.

Parameters and their covariance become the calibration that is applied to the reference; drift since the date
of the certificate and temperature are kept apart. Method: docs/theory/uncertainty.md, section 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from tumble import _core
from tumble.calibration.budget import Distribution
from tumble.calibration.document import Calibration
from tumble.foundation.days import day_of
from tumble.foundation.documents import ArrayField, Document, Name, Vector, read_document
from tumble.foundation.error_decomposition import (
    PAIRS,
    factor_jacobian,
    factor_sigma,
    factors,
    mounting_angles,
    non_orthogonality,
)
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.file_status import is_file
from tumble.foundation.files import note_input
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.foundation.results import GROUPS, TriadName
from tumble.foundation.schemas import REFERENCE_CERTIFICATE
from tumble.foundation.serials import are_of_two
from tumble.foundation.units import UNITS
from tumble.foundation.words import quoted, short

SCHEMA: Literal["tumble-reference-certificate/1"] = "tumble-reference-certificate/1"
DAYS_A_YEAR: Final = 365.25
LARGEST_ANGLE: Final = 45.0
"""deg: non-orthogonality beyond which three axes are no triad."""
LARGEST_SCALE: Final = 100.0
"""Largest scale, and one over the smallest."""
LARGEST_BIAS: Final = 1e6
"""m/s^2 or rad/s; the largest of every uncertainty and change, too."""
_LARGEST_TURN: Final = 360.0
"""deg."""
_FLAT: Final = 0.1
"""Volume that three unit axes span, 1 where they are at right angles, below which they are no triad."""
_ROUNDING: Final = 1e-3
"""Largest rounding of correlations in a covariance that is typed with four digits."""
_HALF_WIDTH: Final = math.sqrt(3.0)
"""Half width of a rectangle over its standard deviation."""


class _SpreadField(ArrayField):
    """Three numbers, or one that stands for all."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {
            "anyOf": [{"type": "number", "minimum": 0}, super().__get_pydantic_json_schema__(schema, handler)]
        }

    def _read(self, value: object) -> FloatArray:
        one = isinstance(value, int | float) and not isinstance(value, bool)
        return super()._read([value] * 3 if one else value)


Spread: TypeAlias = Annotated[FloatArray, _SpreadField((3,))]
"""Three numbers of at least 0, or one for all."""


class _Spreads(Document):
    """Groups of spreads, none of them negative or beyond what sensors can have."""

    @model_validator(mode="after")
    def _is_not_negative(self) -> _Spreads:
        for name in type(self).model_fields:
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and (value < 0.0).any():
                raise ValueError(f"{name} is {value.min():g}; give a number of at least 0")
            if isinstance(value, np.ndarray) and (value > LARGEST_BIAS).any():
                raise ValueError(f"{name} is {value.max():g}; give a number of at most {LARGEST_BIAS:g}")
        return self


class CertifiedUnit(Document):
    """The reference that was calibrated."""

    manufacturer: Name = ""
    model: Name = ""
    serial: Name = ""


class CertifiedValue(Document):
    """Three values of one kind, with their expanded uncertainty."""

    value: Vector
    U: Spread
    """Expanded uncertainty, one for all or one for each."""

    @field_validator("U")
    @classmethod
    def _is_positive(cls, value: FloatArray) -> FloatArray:
        if (value <= 0.0).any():
            raise ValueError("no value is exact; give U above 0")
        if (value > LARGEST_BIAS).any():
            raise ValueError(f"is {value.max():g}; give U of at most {LARGEST_BIAS:g}")
        return value


class CertifiedDrift(_Spreads):
    """Largest change of the reference in a year, either way; a group left out does not change."""

    bias: Spread | None = None
    """Unit of the triad a year."""
    scale: Spread | None = None
    """1 a year."""
    non_orthogonality: Spread | None = Field(default=None, alias="non-orthogonality")
    """deg a year."""
    mounting: Spread | None = None
    """deg a year."""


class CertifiedCoefficients(_Spreads):
    """Largest change of the reference by a kelvin, either way; a group left out does not change."""

    bias: Spread | None = None
    """Unit of the triad by K."""
    scale: Spread | None = None
    """1 by K."""


class CertifiedTriad(Document):
    """One triad of the reference: y = M u + b, M = K L Q."""

    bias: CertifiedValue
    """Unit of the triad: m/s^2 or rad/s."""
    scale: CertifiedValue
    """1."""
    non_orthogonality: CertifiedValue = Field(alias="non-orthogonality")
    """deg, of xy, yz and zx."""
    mounting: CertifiedValue
    """deg, rotation vector of Q (sensor_from_case)."""
    degrees_of_freedom: float | None = Field(default=None, gt=0.0)
    """Degrees of freedom of the uncertainties; infinite if not given."""
    covariance: Annotated[FloatArray, ArrayField((12, 12))] | None = None
    """Covariance of [M row by row, b], in place of the U of independent values, where it is known."""
    drift: CertifiedDrift | None = None
    temperature: CertifiedCoefficients | None = None

    @model_validator(mode="after")
    def _is_a_triad(self) -> CertifiedTriad:
        scale = self.scale.value
        strange = scale[(scale < 1.0 / LARGEST_SCALE) | (scale > LARGEST_SCALE)]
        if strange.size:
            raise ValueError(f"scale is {strange[0]:g}; give the ratio of reading to truth, about 1")
        if np.abs(self.bias.value).max() > LARGEST_BIAS:
            raise ValueError(f"bias is beyond {LARGEST_BIAS:g}; give it in m/s^2 or rad/s")
        if np.abs(self.mounting.value).max() > _LARGEST_TURN:
            raise ValueError(f"mounting is beyond {_LARGEST_TURN:g} deg; give a rotation vector in deg")
        if np.abs(self.non_orthogonality.value).max() > LARGEST_ANGLE:
            raise ValueError(f"non-orthogonality is beyond {LARGEST_ANGLE:g} deg; give it in deg")
        if _volume(self.non_orthogonality.value) < _FLAT**2:
            raise ValueError("non-orthogonality is that of three axes almost in a plane; give it in deg")
        if self.covariance is not None:
            _refuse_no_covariance(self.covariance)
        return self

    @classmethod
    def of_model(
        cls, matrix: FloatArray, bias: FloatArray, covariance: FloatArray, k: float = 2.0
    ) -> CertifiedTriad:
        """Returns a triad from M (3, 3), b (3,) and the covariance (12, 12) of [M row by row, b].

        Raises `ValueError` where they are none.
        """
        _refuse_no_matrix(matrix)
        _refuse_no_covariance(covariance)
        turn = mounting_angles(factors(matrix)[2])
        sigma = factor_sigma(matrix, covariance[:9, :9])
        stated = {
            "bias": (bias, np.sqrt(np.diag(covariance)[9:])),
            "scale": (np.linalg.norm(matrix, axis=1), sigma[:3]),
            "non-orthogonality": (np.degrees(non_orthogonality(matrix)), np.degrees(sigma[3:6])),
            "mounting": (turn, np.degrees(sigma[6:])),
        }
        values = {group: {"value": value, "U": k * u} for group, (value, u) in stated.items()}
        return cls.model_validate({**values, "covariance": covariance})

    @property
    def parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """K, L and Q."""
        xy, yz, zx = np.sin(np.radians(self.non_orthogonality.value))
        along_y = math.sqrt(1.0 - xy * xy)
        of_z = (yz - xy * zx) / along_y
        L = np.array(
            [[1.0, 0.0, 0.0], [xy, along_y, 0.0], [zx, of_z, math.sqrt(1.0 - zx * zx - of_z * of_z)]]
        )
        return np.diag(self.scale.value), L, _core.rotation_matrix(np.radians(self.mounting.value))

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) M."""
        K, L, Q = self.parts
        found: FloatArray = K @ L @ Q
        return found

    def independent(self, sigmas: Mapping[str, FloatArray]) -> FloatArray:
        """(12, 12) of [M row by row, b] from independent 1-sigmas (3,) by group, in printed units."""
        none = np.zeros(3)
        bias, scale, angle, turn = (sigmas.get(group, none) for group in GROUPS)
        of_factors = np.concatenate([scale, np.radians(angle), np.radians(turn)])
        by_factors = np.linalg.inv(factor_jacobian(self.matrix))
        found = np.zeros((12, 12))
        found[:9, :9] = (by_factors * of_factors**2) @ by_factors.T  # eq. 11
        found[9:, 9:] = np.diag(bias**2)
        return found


class CertifiedTemperature(Document):
    """Temperature of the reference during its calibration, degC."""

    low: float = Field(ge=-273.15, le=1000.0)
    high: float = Field(ge=-273.15, le=1000.0)

    @model_validator(mode="after")
    def _is_a_range(self) -> CertifiedTemperature:
        if self.low > self.high:
            raise ValueError(f"low is {self.low:g}, above high of {self.high:g}; correct one of them")
        return self

    @property
    def middle(self) -> float:
        """Temperature at which its values hold, degC."""
        return 0.5 * (self.low + self.high)


class Influence(Document):
    """An uncertainty of the reference, of one source."""

    source: str
    distribution: Distribution
    covariance: Annotated[FloatArray, ArrayField((12, 12))]
    """Covariance of [M row by row, b]."""
    degrees_of_freedom: float | None = None


class ReferenceCertificate(Document):
    """Certificate of a reference, as a file states it."""

    schema_: Literal["tumble-reference-certificate/1"] = Field(default=SCHEMA, alias="schema")
    reference: CertifiedUnit
    laboratory: Name = Field(min_length=1)
    number: str = Field(min_length=1)
    """Number of the certificate."""
    date: str
    """Date of the calibration, such as 2026-03-31."""
    due: str = ""
    """Last day on which it holds; without one it does not end."""
    k: float = Field(default=2.0, ge=0.1, le=1000.0)
    """Coverage factor of all U."""
    temperature: CertifiedTemperature | None = None
    accelerometer: CertifiedTriad | None = None
    gyroscope: CertifiedTriad | None = None

    @field_validator("date", "due")
    @classmethod
    def _is_a_date(cls, value: str) -> str:
        if value and day_of(value) is None:
            raise ValueError(f"{short(value)} is no date; give one such as 2026-03-31")
        return value

    @model_validator(mode="after")
    def _is_whole(self) -> ReferenceCertificate:
        if self.accelerometer is None and self.gyroscope is None:
            raise ValueError("has neither an accelerometer nor a gyroscope section; give at least one")
        if not self.date:
            raise ValueError("has no date; give that of the calibration")
        if self.due and self.due < self.date:
            raise ValueError(f"is due on {self.due}, before its date {self.date}; correct one of them")
        return self

    @classmethod
    def load(cls, path: Path | str) -> ReferenceCertificate:
        """Reads one in YAML; raises `CalibrationFileError` in one line: file, line, key and remedy."""
        return read_document(path, cls, REFERENCE_CERTIFICATE)

    def triads(self) -> Mapping[TriadName, CertifiedTriad]:
        """Triads that it states."""
        stated: dict[TriadName, CertifiedTriad | None] = {
            "accelerometer": self.accelerometer,
            "gyroscope": self.gyroscope,
        }
        return {name: triad for name, triad in stated.items() if triad is not None}

    def calibration(self) -> Calibration:
        """Returns the calibration of the reference: its values, and the covariance by U over k."""
        content: dict[str, object] = {
            "name": self.reference.model or "reference",
            "serial": self.reference.serial,
            "date": f"{self.date}T00:00:00Z",
        }
        for name, triad in self.triads().items():
            K, L, Q = triad.parts
            angles = [float(angle) for angle in triad.non_orthogonality.value]
            content[name] = {
                "unit": UNITS[name],
                "M": K @ L @ Q,
                "b": triad.bias.value,
                "K": K,
                "L": L,
                "Q": Q,
                "angles": {
                    "non-orthogonality": dict(zip(PAIRS, angles, strict=True)),
                    "mounting": triad.mounting.value,
                },
                "estimated": ("bias", "matrix"),
                "covariance": self._of_calibration(triad).covariance,
            }
        return Calibration.model_validate(content)

    @property
    def leaves_drift_open(self) -> bool:
        """Returns whether the drift of a triad is not stated."""
        return any(triad.drift is None for triad in self.triads().values())

    def influences(
        self,
        name: TriadName,
        day: str,
        temperature: tuple[float, float, float] | None,
        walks: Mapping[str, float] | None = None,
    ) -> tuple[Influence, ...]:
        """Returns the uncertainties of a triad in a session: by its calibration, drift and temperature.

        `day` is that of the session, `temperature` the lowest, mean and highest of the reference in it, degC.
        `walks` are variances a year by parameter, such as `accelerometer bias x`, for a drift that is not
        stated.
        """
        triad = self.triads()[name]
        found = [self._of_calibration(triad)]
        if triad.drift is not None:
            years = years_between(self.date, day)
            found.append(_rectangular(triad, f"reference: drift in {years:.2g} years", triad.drift, years))
        elif walks:
            found.append(_walked(triad, name, walks, years_between(self.date, day)))
        if triad.temperature is not None and (kelvin := self.distance(temperature)) > 0.0:
            source = f"reference: temperature within {kelvin:.2g} K"
            found.append(_rectangular(triad, source, triad.temperature, kelvin))
        return tuple(found)

    def _of_calibration(self, triad: CertifiedTriad) -> Influence:
        covariance = triad.covariance
        if covariance is None:
            covariance = triad.independent({group: _group(triad, group).U / self.k for group in GROUPS})
        return Influence(
            source="reference: calibration",
            distribution="normal",
            covariance=covariance,
            degrees_of_freedom=triad.degrees_of_freedom,
        )

    def distance(self, temperature: tuple[float, float, float] | None) -> float:
        """Largest distance, K, of the reference in a session from where its values hold."""
        if temperature is None:
            # In a session without a thermometer the range of the certificate is all that is known.
            return 0.5 * (self.temperature.high - self.temperature.low) if self.temperature else 0.0
        low, mean, high = temperature
        middle = self.temperature.middle if self.temperature is not None else mean
        return max(abs(low - middle), abs(high - middle))


@dataclass(frozen=True, slots=True)
class SignedReference:
    """Certificate of a reference as it was read, and the state of its signature."""

    certificate: ReferenceCertificate
    signature: str = "is not signed"
    """Outcome of the verification: `is not signed`, or since when it is unchanged."""


def read_reference_certificate(path: Path | str, signer: Path | None = None) -> SignedReference:
    """Reads the certificate of a reference, of whatever kind its file is.

    With `signer`, the public file (PEM) of a laboratory, that must have signed it. Raises
    `CalibrationFileError`, in one line, where the file is none of a known kind, does not hold one, or was
    changed since it was signed.
    """
    return READERS[_kind_of(Path(path))](path, signer)


def _of_user(path: Path | str, signer: Path | None) -> SignedReference:
    """Reads a certificate in YAML, which nobody can sign."""
    if signer is not None:
        raise CalibrationFileError(
            f"{path}: is YAML, which bears no signature; give the XML or PDF, or leave out --reference-signer"
        )
    return SignedReference(ReferenceCertificate.load(path))


def _of_laboratory(path: Path | str, signer: Path | None) -> SignedReference:
    """Reads a certificate as `tumble certificate` issues them, by a room above this one."""
    try:
        reader = import_module("tumble.laboratory.certificate.reference")
    except ModuleNotFoundError as error:
        raise CalibrationFileError(
            f"{path}: needs the Python package {error.name} to be read; type: python -m pip install "
            "'tumble-imu[laboratory]'"
        ) from error
    found: SignedReference = reader.read_certificate_of_reference(path, signer)
    return found


READERS: Mapping[str, Callable[[Path | str, Path | None], SignedReference]] = {
    "yaml": _of_user,
    "xml": _of_laboratory,
    "pdf": _of_laboratory,
}
"""Readers of certificates, by the kind of their file."""


def _kind_of(path: Path) -> str:
    """Returns the kind of a file by its first bytes: yaml where they are of no other kind."""
    if not is_file(path):
        return "yaml"
    note_input(path)
    with open_regular(path) as file:
        head = file.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    return "xml" if head.startswith(b"<") else "pdf" if head.startswith(b"%PDF") else "yaml"


def refuse_unfit_certificate(certificate: ReferenceCertificate, about: str, day: str, serial: str) -> None:
    """Raises `CalibrationFileError` where a certificate does not hold on a day, or for another serial.

    `serial` is that of the reference; empty where neither its log nor an option states one.
    """
    if day < certificate.date:
        raise CalibrationFileError(
            f"{about}: is of {certificate.date}, and the session of {day}, before it; give the certificate "
            "that held then"
        )
    if certificate.due and day > certificate.due:
        raise CalibrationFileError(
            f"{about}: is out of date since {certificate.due}, and the session is of {day}; have the "
            "reference calibrated, or give its newest certificate"
        )
    stated = certificate.reference.serial
    if are_of_two(serial, stated):
        raise CalibrationFileError(
            f"{about}: is of serial {quoted(stated)}, and the reference is {quoted(serial)}; give its own "
            "certificate"
        )


def refuse_other_model(certificate: ReferenceCertificate, about: str, model: str) -> None:
    """Raises `CalibrationFileError` where a certificate is of another model than the reference."""
    stated = certificate.reference.model
    if model and stated and model.casefold() != stated.casefold():
        raise CalibrationFileError(
            f"{about}: is of model {quoted(stated)}, and the reference is a {quoted(model)}; give its own "
            "certificate"
        )


def years_between(first: str, second: str) -> float:
    """Returns the time between two days, years; 0 where the second is no later."""
    start, end = day_of(first), day_of(second)
    if start is None or end is None:
        return 0.0
    return max(0.0, (end - start).days / DAYS_A_YEAR)


def _rectangular(
    triad: CertifiedTriad, source: str, largest: CertifiedDrift | CertifiedCoefficients, factor: float
) -> Influence:
    """Returns the influence of a change of at most `largest` times a factor, equation (13)."""
    stated = {
        field.alias or name: getattr(largest, name) for name, field in type(largest).model_fields.items()
    }
    sigmas = {
        group: factor * value / _HALF_WIDTH  # eq. 12
        for group, value in stated.items()
        if value is not None
    }
    return Influence(source=source, distribution="rectangular", covariance=triad.independent(sigmas))


def _walked(triad: CertifiedTriad, name: TriadName, walks: Mapping[str, float], years: float) -> Influence:
    """Returns the influence of random walks, of which the registry knows the variance a year."""
    sigmas = {
        group: np.sqrt([years * walks.get(f"{name} {group} {axis}", 0.0) for axis in _axes(group)])
        for group in GROUPS
    }
    source = f"reference: drift in {years:.2g} years, by the registry"
    return Influence(source=source, distribution="normal", covariance=triad.independent(sigmas))


def _axes(group: str) -> tuple[str, ...]:
    return PAIRS if group == "non-orthogonality" else ("x", "y", "z")


def _refuse_no_matrix(matrix: FloatArray) -> None:
    """Raises `ValueError` where the rows of M (3, 3) are no three axes."""
    scale = np.linalg.norm(matrix, axis=1)
    if scale.min() < 1.0 / LARGEST_SCALE or scale.max() > LARGEST_SCALE:
        raise ValueError(f"M has rows of {scale.min():g} to {scale.max():g}, which no sensor has; check it")
    if abs(np.linalg.det(matrix / scale[:, None])) < _FLAT:
        raise ValueError("the rows of M are almost in a plane, which those of no triad are; check it")


def _refuse_no_covariance(covariance: FloatArray) -> None:
    """Raises `ValueError` where a matrix (12, 12) is not the covariance of numbers none of which is exact."""
    variance = np.diag(covariance)
    if variance.min() <= 0.0:
        raise ValueError("covariance states that a value is exact, or less; give variances above 0")
    if variance.max() > LARGEST_BIAS**2:
        raise ValueError(f"covariance is up to {variance.max():g}; give at most {LARGEST_BIAS**2:g}")
    sigma = np.sqrt(variance)
    correlation = covariance / sigma / sigma[:, None]
    if np.abs(correlation - correlation.T).max() > _ROUNDING:
        raise ValueError("covariance is not symmetric; check its rows")
    if np.linalg.eigvalsh(correlation)[0] < -_ROUNDING:
        raise ValueError("covariance has a negative eigenvalue, as that of no quantities; check its rows")


def _volume(angles: FloatArray) -> float:
    """Returns the square of the volume that three unit axes span, from their non-orthogonality, deg."""
    xy, yz, zx = np.sin(np.radians(angles))
    return float(np.linalg.det([[1.0, xy, zx], [xy, 1.0, yz], [zx, yz, 1.0]]))


def _group(triad: CertifiedTriad, group: str) -> CertifiedValue:
    found: CertifiedValue = getattr(triad, group.replace("-", "_"))
    return found
