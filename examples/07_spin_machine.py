"""A robot's own program drives the turn: the state machine commands when to stand and when to turn.

python examples/07_spin_machine.py
"""

from __future__ import annotations

import numpy as np

import tumble
from tumble import Chunk, SpinMachine

TOGETHER = 10
"""Samples that come together."""


def main() -> None:
    """Feed a simulated drive piece by piece, act on events, and compare the result with the truth."""
    drive = tumble.simulate_spin(seed=7)
    samples = drive.samples
    machine = SpinMachine()

    for first in range(0, len(samples), TOGETHER):
        part = slice(first, first + TOGETHER)
        piece = Chunk(samples.time[part], samples.accelerometer[part], samples.gyroscope[part])
        for event in machine.push(piece):
            # Here a robot would start and stop its wheels.
            print(f"{event.time:6.2f} s  {event.kind}")
        if machine.is_over:
            break

    spin = machine.result()
    error = spin.level_free.value - drive.accelerometer_bias
    print(f"turned {np.degrees(machine.progress['turned']):.0f} deg")
    print(f"error of the accelerometer bias: {1e3 * np.linalg.norm(error):.2f} mm/s^2")
    assert np.linalg.norm(error) < 5.0 * np.linalg.norm(spin.level_free.sigma)


if __name__ == "__main__":
    main()
