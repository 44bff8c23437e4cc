"""Digest of a log, by which a calibration says what it was found from."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from tumble.logs import parse_spec
from tumble.provenance import sha256_of


def log_digest(source: str | Path) -> str:
    """SHA-256 of a log, in hexadecimal; of several IMUs in one file it is computed once."""
    path = parse_spec(source).path.resolve()
    status = path.stat()
    return _digest(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=16)
def _digest(path: Path, _size: int, _changed: int) -> str:
    return sha256_of(path)
