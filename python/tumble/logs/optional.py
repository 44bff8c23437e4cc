"""Libraries that only some logs and sources need, and that may not be there."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from tumble.foundation.errors import LogError

EXTRAS: Mapping[str, str] = {
    "live": "sensors and rate tables over serial lines and MAVLink",
    "ros2": "topics of ROS 2, without ROS",
    "zenoh": "topics of ROS 2 over Zenoh, without ROS",
    "foxglove": "topics that a server of Foxglove's protocol sends",
    "rerun": "recordings and results for the viewer Rerun",
    "formats": "flight logs, MATLAB and HDF5 files, MCAP with protobuf",
    "laboratory": "registry of calibrations, in a file or on a server, and certificates",
    "plot": "figures of results in Python",
    "bench": "pages in the browser: charts of recordings, and the bench",
    "fleet": "clusters of Ray, and recordings and results on S3",
}
"""Libraries that `tumble-imu[EXTRA]` installs, and their purpose."""


def install_command(extra: str) -> str:
    """Returns what a user types to have the libraries of an extra."""
    return f"python -m pip install 'tumble-imu[{extra}]'"


def imported(module: str, about: object, extra: str) -> Any:  # noqa: ANN401 - a module has no type of its own
    """Imports a library, or a module of ours that needs one; `about` is what is to be read with it.

    Raises `LogError`, with how to get it, where it is not installed. Without an `extra` it is no matter of
    choice, and `ModuleNotFoundError` is raised.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if not extra:
            raise
        raise not_installed(about, error.name, extra) from error


def not_installed(about: object, package: str | None, extra: str) -> LogError:
    """Describes how to get a library that is not installed; `about` is what is to be read with it."""
    return LogError(
        f"{about}: reading it needs the Python package {package}, which is not installed; "
        f"type: {install_command(extra)}"
    )
