"""Logs of robots that turn, stop and drive by chance: every turn on the spot is found, and the biases."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from spin_sessions import drive, record, still, turn

SIGMAS = 5.0


def moves_by_chance(generator):
    """Rests, turns with and without stops between, and bends too wide to be a turn on the spot."""
    moves = [still(generator.uniform(3.0, 8.0))]
    for _ in range(generator.integers(1, 4)):
        for _ in range(generator.integers(1, 4)):
            way = generator.choice([-1, 1])
            unevenness = generator.choice([0.0, 0.3])
            moves.append(turn(way * generator.uniform(0.3, 3.0), generator.uniform(0.4, 2.0), unevenness))
            if generator.random() < 0.6:
                moves.append(still(generator.uniform(2.0, 5.0)))
        moves.append(still(generator.uniform(2.5, 5.0)))
        if generator.random() < 0.6:
            seconds, speed = generator.uniform(5.0, 20.0), generator.uniform(0.5, 1.5)
            bend = generator.uniform(-1.0, 1.0) * seconds * speed / (2.0 * np.pi * 1.5)
            vibration = generator.choice([0.05, 0.3])
            moves += [drive(seconds, speed, bend, vibration), still(generator.uniform(3.0, 6.0))]
    return moves


def unit_by_chance(generator):
    return {
        "floor_tilt": generator.choice([0.0, 0.3, 1.0, 3.0]),
        "roll": generator.uniform(-180.0, 180.0),
        "pitch": generator.uniform(-60.0, 60.0),
        "rate_hz": generator.choice([50.0, 100.0, 200.0]),
        "accelerometer_noise": generator.choice([0.005, 0.02, 0.05]),
        "gyroscope_noise": generator.choice([0.0005, 0.002]),
        "gyroscope_scale": generator.choice([1.0, 1.005]),
        "gyroscope_bias": tuple(generator.normal(0.0, 0.05, 3)),
        "lever_arm": tuple(generator.normal(0.0, 0.15, 3)),
    }


@pytest.mark.parametrize("seed", range(201, 221))
def test_all_turns_on_the_spot_are_found_with_right_biases(seed):
    generator = np.random.default_rng(seed)
    moves = moves_by_chance(generator)
    session = record(moves, seed, **unit_by_chance(generator))
    result = tumble.spin(
        tumble.Recording.from_arrays("robot", session.time, session.accelerometer, session.gyroscope)
    )
    for move, (start, end) in zip(moves, session.spans, strict=True):
        inside = any(spin.start - 0.5 <= start and end <= spin.end + 0.5 for spin in result.spins)
        if move.speed:
            assert not inside, f"the drive from {start:.1f} s was taken for a spin"
        elif move.turns:
            assert inside, f"the turn from {start:.1f} s was missed: {result.refused}"
    for bias, truth in (
        (result.accelerometer_bias, session.robot.accelerometer_bias),
        (result.gyroscope_bias, session.robot.gyroscope_bias),
    ):
        assert np.all(np.abs(bias.value - truth) < SIGMAS * bias.sigma)
