"""Libraries that only some logs and sources need, and that may not be there."""

from __future__ import annotations

from collections.abc import Mapping

from tumble.errors import LogError

EXTRAS: Mapping[str, str] = {
    "live": "sensors and rate tables over serial lines and MAVLink",
    "formats": "flight logs, MATLAB and HDF5 files, MCAP with protobuf",
}
"""What is installed with `tumble-imu[EXTRA]`, and what it is for."""


def install_command(extra: str) -> str:
    """Give what a user types to have the libraries of an extra."""
    return f"python -m pip install 'tumble-imu[{extra}]'"


def not_installed(about: object, package: str | None, extra: str) -> LogError:
    """Say how to get a library that is not installed; `about` is what is to be read with it."""
    return LogError(
        f"{about}: reading it needs the Python package {package}, which is not installed; "
        f"type: {install_command(extra)}"
    )
