"""Settings with which a bench is started."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

LOOPBACK = ("127.0.0.1", "::1", "localhost")
PORT = 8321


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchSettings:
    """Place, guests and folder of a bench."""

    folder: Path
    """Folder of the runs, and of files that an operator may choose, such as limits."""
    host: str = LOOPBACK[0]
    port: int = PORT
    """0 for a free one."""
    certificate: Path | None = None
    """Certificate of the server (PEM); None serves without TLS."""
    key: Path | None = None
    """Private key of the certificate (PEM)."""
    registry: str = ""
    """File or URL of the registry; empty for none."""
    fleet: Path | None = None
    """Folder of the jobs of fleets; None for `folder`."""
    operator: str = ""
    station: str = ""
    pedal: str = "F9"
    """Name of the key that a pedal presses, as browsers name it."""

    @property
    def is_local(self) -> bool:
        """Returns whether only this computer reaches it."""
        return self.host in LOOPBACK

    @property
    def scheme(self) -> str:
        """`https` with a certificate, else `http`."""
        return "https" if self.certificate is not None else "http"
