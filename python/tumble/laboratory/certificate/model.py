"""The certificate of one unit, which both renderings, PDF and XML, are made of.

Contents: ISO/IEC 17025:2017, 7.8. Text from outside is kept on one line, without control characters.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from tumble.calibration.decision import Conformity
from tumble.calibration.document import Covariance
from tumble.foundation.days import day_of
from tumble.foundation.documents import Document, Matrix, Vector
from tumble.foundation.units import Triad

SCHEMA: Literal["tumble-certificate/1"] = "tumble-certificate/1"
PARAMETERS = (
    *(f"M_{row}{column}" for row in "xyz" for column in "xyz"),
    *(f"b_{axis}" for axis in "xyz"),
)
"""Names of the twelve numbers of a triad's model, in the order of its covariance."""

Condition: TypeAlias = Literal["", "as found", "as left"]
Language: TypeAlias = Literal["en", "zh"]

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not allow, https://www.w3.org/TR/xml/#charsets."""
_UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff]")
_DECIMAL = r"-?[0-9]+(\.[0-9]+)?"


def line_of(text: str) -> str:
    """Return text from outside as one line that XML can hold; characters that cannot be seen are escaped."""
    line = " ".join(text.split())
    for pattern in (_UNSEEN, _NO_XML):
        line = pattern.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), line)
    return line


CertificateLine: TypeAlias = Annotated[str, AfterValidator(line_of)]
Needed: TypeAlias = Annotated[str, AfterValidator(line_of), Field(min_length=1)]
Decimal: TypeAlias = Annotated[str, Field(pattern=f"^{_DECIMAL}$")]


def _day(text: str) -> str:
    if day_of(text) is None:
        raise ValueError("is no day of a calendar; give one such as 2026-11-22")
    return text


Day: TypeAlias = Annotated[str, Field(pattern="^[0-9]{4}-[0-9]{2}-[0-9]{2}$"), AfterValidator(_day)]


class Party(Document):
    """A laboratory or a customer."""

    name: Needed
    address: Needed
    country: Annotated[str, Field(pattern="^([A-Z]{2})?$")] = ""
    """Code by ISO 3166-1, such as DE."""


class Laboratory(Party):
    """The laboratory that calibrated."""

    accreditation: CertificateLine = ""
    """Number or text of its accreditation."""


class Item(Document):
    """The unit that was calibrated."""

    name: Needed
    serial: Needed
    manufacturer: CertificateLine = ""
    model: CertificateLine = ""


class CertifiedQuantity(Document):
    """A number of a result, rounded as both renderings show it."""

    parameter: str
    """`accelerometer bias x`."""
    unit: str
    value: Decimal | None
    """In `unit`; None where the data did not show it."""
    uncertainty: Decimal | None
    """Expanded uncertainty U, in `unit`; None where the result states none."""
    coverage_factor: Decimal | None
    """k; None as U."""


class SensorModel(Document):
    """M and b of a triad in full, for computing: y = M u + b."""

    triad: Triad
    M: Matrix
    b: Vector
    """Unit of the triad."""
    covariance: Covariance | None
    """Covariance of [M row by row, b], reference and gravity included; NaN where the data did not show it."""

    @property
    def shown(self) -> tuple[int, ...]:
        """Places of the parameters whose covariance is known."""
        if self.covariance is None:
            return ()
        return tuple(int(place) for place in np.flatnonzero(np.isfinite(np.diag(self.covariance))))


class Environment(Document):
    """Conditions under which a unit was calibrated, as far as the result holds them."""

    temperature: tuple[float, float, float] | None = Field(default=None, strict=False)
    """Lowest, mean and highest sensor temperature, degC."""
    gravity: float | None = None
    """m/s^2."""
    gravity_source: CertificateLine = ""


class Equipment(Document):
    """The reference that a unit was calibrated against."""

    name: Needed
    serial: CertificateLine = ""
    accelerometer: CertificateLine = ""
    """Source of its uncertainty: `calibration`, `grade tactical`, `not stated`; empty where not used."""
    gyroscope: CertificateLine = ""
    certificate: CertificateLine = ""
    """Number of its certificate."""
    laboratory: CertificateLine = ""
    """Laboratory that issued it."""
    certified: CertificateLine = ""
    """Date of its calibration."""
    due: CertificateLine = ""
    sha256: CertificateLine = ""
    """SHA-256 of the file of its certificate."""


class CertifiedDecision(Document):
    """Conformity with limits."""

    rule: Literal["simple", "guarded"]
    guard: float
    verdict: Conformity


class CalibratedItem(Document):
    """One calibration of the unit: as found, as left, or of no stated condition."""

    condition: Condition
    result: str
    """Identity of the result, a SHA-256."""
    begun: Day
    """Day of the first run that gave a part of it."""
    day: Day
    """Day of the last one."""
    operator: Needed
    station: CertificateLine
    procedures: tuple[str, ...] = Field(strict=False, min_length=1)
    """Procedures that gave a part of it, such as turntable and noise."""
    software: Needed
    environment: Environment
    reference: Equipment | None
    quantities: tuple[CertifiedQuantity, ...] = Field(strict=False)
    models: tuple[SensorModel, ...] = Field(strict=False)
    decision: CertifiedDecision | None


class Certificate(Document):
    """A calibration certificate."""

    schema_: Literal["tumble-certificate/1"] = Field(default=SCHEMA, alias="schema")
    number: Needed
    issued: Day
    languages: tuple[Language, ...] = Field(strict=False, min_length=1)
    laboratory: Laboratory
    customer: Party
    item: Item
    authorised_by: Needed
    remarks: tuple[Needed, ...] = Field(default=(), strict=False)
    """Deviations from the method, and whatever else the laboratory states."""
    supersedes: CertificateLine = ""
    """Number of the certificate that this one takes the place of."""
    calibrated: tuple[CalibratedItem, ...] = Field(strict=False, min_length=1)
    """Calibrations, that as found before that as left."""

    @model_validator(mode="after")
    def _states_its_country(self) -> Certificate:
        if not self.laboratory.country:
            raise ValueError("the country of the laboratory is missing")
        return self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Certificate) and self.content() == other.content()

    def __hash__(self) -> int:
        return hash(self.number)
