"""Readings of a magnetometer on a way of their own come beside the samples of an IMU, each once."""

from __future__ import annotations

import numpy as np

from tumble.live.field_pairing import FieldPairing


def fields(first, count):
    return np.arange(first, first + count)[:, np.newaxis] * [1.0, 2.0, 3.0]


def beside(pairing, *pieces):
    return np.concatenate([pairing.beside(piece) for piece in pieces])[:, 0]


def test_a_reading_goes_to_the_first_free_sample_from_its_time_on():
    pairing, time = FieldPairing(), np.arange(20) / 100.0
    # The second two fall between the same samples; the last is after all that came.
    pairing.add(np.array([0.02, 0.051, 0.058, 0.195]), fields(1, 4))
    found = beside(pairing, time[:10], time[10:])
    assert {int(k): found[k] for k in np.flatnonzero(np.isfinite(found))} == {2: 1.0, 6: 2.0, 7: 3.0}
    assert pairing.beside(np.array([0.2]))[0, 0] == 4.0
    assert not pairing.clocks_differ


def test_a_late_reading_goes_to_the_next_sample_and_order_is_kept():
    pairing = FieldPairing()
    pairing.beside(np.array([0.0, 0.1]))
    pairing.add(np.array([0.05, 0.04]), fields(1, 2))
    assert beside(pairing, np.array([0.2, 0.3])).tolist() == [1.0, 2.0]


def test_readings_of_another_clock_come_with_the_next_samples():
    pairing = FieldPairing()
    for stamps in (np.array([900.0, 900.1]), np.array([0.0, 0.0])):
        pairing.add(stamps, fields(1, 2))
    assert beside(pairing, 50.0 + np.arange(4) / 10.0).tolist() == [1.0, 2.0, 1.0, 2.0]
    assert pairing.clocks_differ
