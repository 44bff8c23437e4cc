"""Certificate and key of the server."""

from __future__ import annotations

import ssl
from pathlib import Path

from tumble.foundation.errors import CommandError
from tumble.foundation.file_reading import read_whole

LARGEST = 1 << 20
"""Bytes of a file."""
REMEDY = "give a certificate and its key as PEM, the key without a password"


def server_context(certificate: Path | None, key: Path | None) -> ssl.SSLContext | None:
    """Returns how lines are secured by two PEM files; None without a certificate.

    Raises `CommandError` where they cannot be read, hold no certificate or no key, do not belong together,
    or where the key is encrypted.
    """
    if certificate is None:
        return None
    for path in (certificate, key):
        # A password is never asked for, as nobody may be there to type it, nor derived: that may take hours.
        if path is not None and b"ENCRYPTED" in read_whole(path, LARGEST, "PEM file", error=CommandError):
            raise CommandError(f"{path}: is encrypted; {REMEDY}")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key, password=lambda: "")
    except ssl.SSLError as error:
        reason = (error.reason or "no PEM").replace("_", " ").lower()
        raise CommandError(f"{certificate}, {key}: cannot be used ({reason}); {REMEDY}") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CommandError(f"{certificate}, {key}: cannot be read ({reason}); {REMEDY}") from error
    return context
