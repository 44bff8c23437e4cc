"""Libraries that only live sources need, and that may not be there."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from tumble.errors import LogError
from tumble.live.address import Address

EXTRA = "tumble-imu[live]"


def optional(module: str, address: Address) -> Any:  # noqa: ANN401 - a module has no type of its own
    """Import a library; raises `LogError` that says how to get it where it is not installed."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise LogError(
            f"{address.text}: reading it needs the Python package {error.name}, which is not installed; "
            f"type: python -m pip install '{EXTRA}'"
        ) from error
