"""Addresses under which a bench is reached."""

from __future__ import annotations

import socket

from tumble.bench.access import Access
from tumble.bench.settings import BenchSettings

EVERYWHERE = ("0.0.0.0", "::")
"""Addresses that stand for all of this computer."""


def entrances(settings: BenchSettings, access: Access, port: int) -> dict[str, str]:
    """Returns the address for operators and that for viewers, each with its token where one is needed."""
    host = _own_name() if settings.host in EVERYWHERE else settings.host
    place = f"[{host}]" if ":" in host else host
    page = f"{settings.scheme}://{place}:{port}/"
    if not access.token:
        return {"operator": page, "viewer": page}
    return {"operator": f"{page}?token={access.token}", "viewer": f"{page}?token={access.viewer_token}"}


def _own_name() -> str:
    """Returns the address at which others reach this computer, or its name."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent: the system only chooses a way
        except OSError:
            return socket.gethostname()
        address: str = probe.getsockname()[0]
        return address
