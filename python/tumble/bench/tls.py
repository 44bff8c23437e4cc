"""Certificate and key of the server."""

from __future__ import annotations

import ssl
from pathlib import Path

from tumble.foundation.errors import CommandError

REMEDY = "give a certificate and its key as PEM, the key without a password"


def server_context(certificate: Path | None, key: Path | None) -> ssl.SSLContext | None:
    """Returns how lines are secured by two PEM files; None without a certificate.

    Raises `CommandError` where they cannot be read, hold no certificate or no key, or do not belong together.
    """
    if certificate is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        # A password is never asked for: nobody may be there to type it.
        context.load_cert_chain(certificate, key, password=lambda: "")
    except ssl.SSLError as error:
        reason = (error.reason or "no PEM").replace("_", " ").lower()
        raise CommandError(f"{certificate}, {key}: cannot be used ({reason}); {REMEDY}") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CommandError(f"{certificate}, {key}: cannot be read ({reason}); {REMEDY}") from error
    return context
