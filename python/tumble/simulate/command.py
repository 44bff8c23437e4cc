"""All of `tumble simulate`: each of these modules adds its command."""

from __future__ import annotations

from tumble.simulate import command_flight, command_spin
from tumble.simulate.command_turntable import simulate_app

__all__ = ["command_flight", "command_spin", "simulate_app"]
