"""Reads the certificate of a reference, as XML or as PDF with that inside, for `--reference-certificate`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import ValidationError

from tumble.calibration.reference_certificate import CertifiedTriad, ReferenceCertificate, SignedReference
from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import CalibrationFileError, TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.laboratory.certificate.dcc_reader import LARGEST, read_dcc
from tumble.laboratory.certificate.model import CalibratedItem, Certificate
from tumble.laboratory.certificate.signature import NOT_SIGNED, attached_xml, verify
from tumble.laboratory.certificate.signing_key import load_signer

_BY_ITS_OWN_WORD = "no --reference-signer FILE was given, which proves who that is"


def read_certificate_of_reference(path: Path | str, signer: Path | None = None) -> SignedReference:
    """Read M, b and their covariance, with identity and dates; raises `CalibrationFileError` in one line.

    Where a certificate holds the unit as found and as left, that as left counts. A signature is verified, and
    what it covers is read; with `signer`, the public file of a laboratory, it must have signed.
    """
    content = read_whole(path, LARGEST, "certificate", error=CalibrationFileError)
    known = None if signer is None else [load_signer(signer)]
    signed = verify(content, known)
    if signed.fault == NOT_SIGNED and not known:
        return SignedReference(reference_of(read_dcc(_xml(content, path), str(path)), str(path)), NOT_SIGNED)
    if signed.fault:
        _xml(content, path)  # what is no certificate at all is named first
        raise CalibrationFileError(
            f"{signed.fault}; give the file as the laboratory handed it out", about=str(path)
        )
    stated = reference_of(read_dcc(signed.xml, str(path)), str(path))
    return SignedReference(stated, signed.sentence if known else f"{signed.sentence}; {_BY_ITS_OWN_WORD}")


def reference_of(certificate: Certificate, about: str) -> ReferenceCertificate:
    """Return the values that a certificate states of a reference; raises `CalibrationFileError`."""
    calibrated = certificate.calibrated[-1]
    triads = _triads(calibrated, about)
    if not triads:
        raise CalibrationFileError(
            f"{about}: certificate {certificate.number} holds no M and b with their whole covariance; a "
            "reference needs them"
        )
    temperature = calibrated.environment.temperature
    stated = {
        "reference": {
            "manufacturer": certificate.item.manufacturer,
            "model": certificate.item.model,
            "serial": certificate.item.serial,
        },
        "laboratory": certificate.laboratory.name,
        "number": certificate.number,
        "date": calibrated.day,
        "temperature": None if temperature is None else {"low": temperature[0], "high": temperature[2]},
        **triads,
    }
    try:
        return ReferenceCertificate.model_validate(stated)
    except ValidationError as error:
        raise CalibrationFileError(
            f"{about}: {mistake_in(error, ReferenceCertificate)}; give the certificate of an IMU"
        ) from error


def _triads(calibrated: CalibratedItem, about: str) -> dict[str, CertifiedTriad]:
    found: dict[str, CertifiedTriad] = {}
    for model in calibrated.models:
        if model.covariance is None or not np.isfinite(model.covariance).all():
            continue
        try:
            found[model.triad] = CertifiedTriad.of_model(model.M, model.b, model.covariance)
        except ValidationError as error:
            raise _no_triad(about, model.triad, mistake_in(error, CertifiedTriad)) from error
        except ValueError as error:
            raise _no_triad(about, model.triad, str(error)) from error
    return found


def _no_triad(about: str, triad: str, why: str) -> CalibrationFileError:
    return CalibrationFileError(f"{about}: {triad}: {why}; give the certificate of an IMU")


def _xml(content: bytes, path: Path | str) -> bytes:
    """Return the XML in a file, which may be a PDF; raises `CalibrationFileError`."""
    if not content.startswith(b"%PDF"):
        return content
    try:
        return attached_xml(content)
    except TumbleError as error:
        raise CalibrationFileError(f"{error}; give a certificate of Tumble", about=str(path)) from error
