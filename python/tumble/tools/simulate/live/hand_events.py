"""A simulated hand goes where a live session asks it to, by the events that the session prints."""

from __future__ import annotations

from typing import TextIO

import numpy as np

from tumble.foundation import clock
from tumble.foundation.bounded_json import parse_json
from tumble.tools.simulate.live.procedure import LiveSimulation

WANTED = "orientation wanted"
"""The event that asks for an orientation."""


def follow_events(simulation: LiveSimulation, events: TextIO) -> None:
    """Turns the hand of a bench by events, a line of JSON each; the bench ends where they end."""
    clock.thread(_obey, simulation, events, name="told").start()


def _obey(simulation: LiveSimulation, events: TextIO) -> None:
    for line in events:
        try:
            event = parse_json(line)
            up = np.array(event["up"], dtype=float) if event["event"] == WANTED else None
        except (ValueError, KeyError, TypeError):
            # Other lines are not meant for a hand.
            continue
        if up is not None and up.shape == (3,) and np.linalg.norm(up) > 0.0 and simulation.hand is not None:
            simulation.hand.go_to(up)
    simulation.stop()
