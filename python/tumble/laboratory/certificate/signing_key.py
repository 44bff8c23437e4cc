"""The laboratory's own key: a PEM file with a private key and its X.509 certificate."""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InternalError, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from tumble.foundation.days import moment_of
from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import exists
from tumble.foundation.files import make_new_file, remove_made
from tumble.foundation.provenance import date_now
from tumble.foundation.words import plain
from tumble.laboratory.certificate.key_encryption import LARGEST_WORK, is_affordable

PASSWORD = "TUMBLE_SIGNING_PASSWORD"
"""Variable of the environment with the password of an encrypted key."""
LARGEST = 1 << 18
"""Bytes."""
_YEARS = 10
_UNREADABLE = (ValueError, TypeError, UnsupportedAlgorithm, InternalError, x509.InvalidVersion)
"""Errors of `cryptography` where a key or a certificate is damaged, or of a kind that it does not know."""
_LONGEST_NAME = 64
"""Letters of a name in X.509 (RFC 5280, ub-common-name)."""


@dataclass(frozen=True, slots=True)
class SigningKey:
    """A key with which certificates are signed."""

    private: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate


def make_key(path: Path, laboratory: str) -> Path:
    """Make a key, readable by its owner only, and beside it `.crt`, the part that customers need to verify.

    Raises `OutputError` where one of the files is there already, or cannot be written.
    """
    public = path.with_suffix(".crt")
    if exists(public):
        raise OutputError(f"{public}: is there already, and is kept; give another name")
    key = ec.generate_private_key(ec.SECP256R1())
    own = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, laboratory[:_LONGEST_NAME])])
    now = moment_of(date_now())
    assert now is not None, "it is a moment"
    usage = x509.KeyUsage(
        digital_signature=True, content_commitment=True, key_encipherment=False, data_encipherment=False,
        key_agreement=False, key_cert_sign=False, crl_sign=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip
    certificate = (
        x509.CertificateBuilder()
        .subject_name(own)
        .issuer_name(own)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=366 * _YEARS))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    shown = certificate.public_bytes(serialization.Encoding.PEM)
    make_new_file(path, private + shown, is_secret=True)
    try:
        make_new_file(public, shown)
    except BaseException:
        remove_made(path)
        raise
    return public


def load_key(path: Path) -> SigningKey:
    """Read a key on the curve P-256 with its certificate; raises `TumbleError` in one line."""
    content = read_whole(path, LARGEST, "key", remedy="give one in PEM")
    password = os.environ.get(PASSWORD)
    try:
        if not is_affordable(content):
            raise TumbleError(
                f"{path}: states more work for each password than {LARGEST_WORK}; encrypt it anew"
            )
        private = serialization.load_pem_private_key(content, password.encode() if password else None)
    except _UNREADABLE:
        raise TumbleError(
            f"{path}: holds no private key, or one whose password is not that of {PASSWORD}; make one with "
            f"tumble certificate key"
        ) from None
    certificate = load_signer(path)
    if not isinstance(private, ec.EllipticCurvePrivateKey) or private.curve.name != "secp256r1":
        raise TumbleError(f"{path}: is no key on the curve P-256; make one with tumble certificate key")
    if private.public_key() != certificate.public_key():
        raise TumbleError(f"{path}: key and certificate do not belong together; give a file with both")
    return SigningKey(private, certificate)


def load_signer(path: Path) -> x509.Certificate:
    """Read the X.509 certificate of a signer from a PEM file; raises `TumbleError` in one line."""
    content = read_whole(path, LARGEST, "key", remedy="give one in PEM")
    try:
        found = x509.load_pem_x509_certificate(content)
        # Its parts are read when they are asked for, and each may be damaged by itself.
        found.public_key()
        name_of(found)
    except _UNREADABLE:
        raise TumbleError(
            f"{path}: holds no X.509 certificate; give the .crt file of the laboratory's key"
        ) from None
    return found


def name_of(certificate: x509.Certificate) -> str:
    """Return the name of a signer."""
    found = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return plain(str(found[0].value) if found else certificate.subject.rfc4514_string())
