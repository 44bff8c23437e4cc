"""Readings of a magnetometer beside a recording."""

import numpy as np
import pytest

from tumble.foundation.errors import ArrayError, LogError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Recording


def track(count: int = 4) -> MagneticTrack:
    return MagneticTrack(np.arange(count) / 10, np.tile([20.0, 0.0, 40.0], (count, 1)))


def test_magnetometer_keeps_a_rate_of_its_own() -> None:
    imu = np.zeros((30, 3))
    recording = Recording.from_arrays("unit", np.arange(30) / 100, imu, imu, magnetic=track())
    assert recording.has_magnetometer
    assert recording.magnetic is not None
    assert recording.magnetic.rate == pytest.approx(10.0)
    assert recording.magnetic.strength == pytest.approx(np.hypot(20.0, 40.0))


def test_magnetometer_alone_has_no_triad_and_no_chunk() -> None:
    recording = Recording.from_magnetic("unit", track())
    assert (recording.metadata.triads, list(recording.chunks())) == ((), [])
    with pytest.raises(LogError, match="holds magnetometer readings only"):
        recording.need_both_triads("a turntable")


def test_uneven_arrays_of_a_magnetometer_are_refused() -> None:
    with pytest.raises(ArrayError, match="magnetometer: holds 3 samples, time 4"):
        MagneticTrack(np.arange(4), np.ones((3, 3)))


def test_joined_pieces_are_the_track_they_came_from() -> None:
    whole = track()
    joined = MagneticTrack.joined([whole.chosen(slice(2)), None, whole.chosen(slice(2, None))])
    assert joined is not None
    np.testing.assert_array_equal(joined.time, whole.time)
    np.testing.assert_array_equal(joined.field, whole.field)
