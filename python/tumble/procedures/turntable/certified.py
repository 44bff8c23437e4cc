"""A reference with a certificate: its calibration, its validity, and facts that results keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from tumble.acquisition.imu import Imu
from tumble.calibration.document import Calibration, CertificateOfReference
from tumble.calibration.reference_certificate import (
    ReferenceCertificate,
    read_reference_certificate,
    refuse_other_model,
    refuse_unfit_certificate,
)
from tumble.foundation.provenance import date_now, log_digest


@dataclass(frozen=True, slots=True)
class CertifiedReference:
    """A certificate, and the file it was read from."""

    certificate: ReferenceCertificate
    about: str
    """Its name in messages: its path, or its number."""
    file: str = ""
    """Name of the file, without folders; empty where it was read by others."""
    sha256: str = ""
    signature: str = ""
    """Outcome of the verification of its signature; empty where it was read by others."""
    standing: str = ""
    """Answer of the registry whether it was withdrawn; empty where none was asked."""
    walks: Mapping[str, float] = field(default_factory=dict)
    """Variance a year of parameters of the reference, for a drift that the certificate does not state."""

    @classmethod
    def of(cls, source: CertificateSource | None, signer: Path | None = None) -> CertifiedReference | None:
        """Reads a certificate, where there is one; raises `CalibrationFileError` in one line.

        With `signer`, the public file of a laboratory, it must have signed the certificate.
        """
        if source is None or isinstance(source, CertifiedReference):
            return source
        if isinstance(source, ReferenceCertificate):
            return cls(source, f"certificate {source.number}")
        path = Path(source)
        found = read_reference_certificate(path, signer)
        return cls(found.certificate, str(path), path.name, log_digest(path), found.signature)

    @property
    def calibration(self) -> Calibration:
        """Calibration that is applied to the reference."""
        return self.certificate.calibration()

    @property
    def facts(self) -> CertificateOfReference:
        """Facts that calibration files keep of it."""
        stated, unit = self.certificate, self.certificate.reference
        return CertificateOfReference(
            laboratory=stated.laboratory,
            number=stated.number,
            date=stated.date,
            due=stated.due,
            manufacturer=unit.manufacturer,
            model=unit.model,
            serial=unit.serial,
            file=self.file,
            sha256=self.sha256,
            signature=self.signature,
        )

    @property
    def remarks(self) -> list[str]:
        """Statements on its signature, and on whether it was withdrawn."""
        about = f"certificate {self.certificate.number} of the reference"
        return [f"{about}: {each}" for each in (self.signature, self.standing) if each]

    def refuse_other_model(self, model: str) -> None:
        """Raises `CalibrationFileError` where it is of another model; an empty one is not known."""
        refuse_other_model(self.certificate, self.about, model)

    def refuse_unless_it_holds_today(self) -> None:
        """Raises `CalibrationFileError` where it does not hold for what is recorded now."""
        refuse_unfit_certificate(self.certificate, self.about, date_now()[:10], "")

    def refuse_unfit(self, unit: Imu) -> None:
        """Raises `CalibrationFileError` where it does not hold for a recording of the reference."""
        refuse_unfit_certificate(self.certificate, self.about, day_of(unit), unit.recording.metadata.serial)


CertificateSource: TypeAlias = CertifiedReference | ReferenceCertificate | str | Path
"""A certificate, or the file that holds it."""


def day_of(unit: Imu) -> str:
    """Returns the day of a recording, today where its stamps are no dates."""
    return (unit.log.time.date or date_now())[:10]
