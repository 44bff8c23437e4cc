"""All of `tumble simulate`: each of these modules adds its command."""

from __future__ import annotations

from tumble.cli import simulate_flight, simulate_spin
from tumble.cli.simulate import simulate_app

__all__ = ["simulate_app", "simulate_flight", "simulate_spin"]
