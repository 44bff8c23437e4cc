"""Libraries that only live sources need, and that may not be there."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from tumble.live.address import Address
from tumble.logs.optional import not_installed


def optional(module: str, address: Address) -> Any:  # noqa: ANN401 - a module has no type of its own
    """Import a library; raises `LogError` that says how to get it where it is not installed."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise not_installed(address.text, error.name, "live") from error
