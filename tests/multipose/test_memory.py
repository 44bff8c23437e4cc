"""A log takes the memory of its samples once, however long it is."""

import tracemalloc

import numpy as np

from tumble.foundation.recording import Chunk, Metadata, Recording, ResolvedUnit
from tumble.procedures.multipose.procedure import multipose

SAMPLE = 8 * 8
"""Bytes: time, both triads and temperature."""
PIECE = 1 << 14
DIRECTIONS = 20


def held(samples):
    """Pieces of a unit that is held in one direction after the other, and turned within a second."""
    seed = 5
    draws = np.random.default_rng(seed)
    directions = draws.normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    noise = draws.normal(size=(PIECE, 6)) * np.repeat([0.01, 1e-4], 3)
    for first in range(0, samples, PIECE):
        place = np.arange(first, first + PIECE)
        direction, turned = np.divmod(place * DIRECTIONS / samples, 1.0)
        weight = np.clip(turned * samples / DIRECTIONS / 1000.0, 0.0, 1.0)[:, None]
        number = direction.astype(int)
        force = weight * directions[number] + (1.0 - weight) * directions[number - 1]
        force *= 9.80665 / np.linalg.norm(force, axis=1)[:, None]
        turns = np.where(weight < 1.0, 1.0, 0.0)
        yield Chunk(place / 1000.0, force + noise[:, :3], turns + noise[:, 3:])


def peak_of(samples):
    unit = ResolvedUnit("SI", 1.0, "made up")
    metadata = Metadata(
        name="long",
        source="long",
        format="arrays",
        accelerometer_unit=unit,
        gyroscope_unit=unit,
        time_unit=unit,
    )
    tracemalloc.start()
    try:
        result = multipose(Recording(metadata, lambda: held(samples)))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(result.poses) == DIRECTIONS
    return peak


def test_samples_are_held_once():
    short, long = 8 * PIECE, 32 * PIECE
    assert peak_of(long) - peak_of(short) < 1.5 * SAMPLE * (long - short)
