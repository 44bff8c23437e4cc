"""Readings at the end of a magnetometer's range are left out and named: they do not follow the field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tumble
from tumble.acquisition.field_range import within_range
from tumble.tools.simulate import simulate_magnetometer


def session_read(seed, change):
    """A simulated session whose readings of the magnetometer are changed, and its truth."""
    session = simulate_magnetometer(seed=seed)
    track = replace(session.track, field=change(session.track.field))
    return replace(session.recording, read_magnetic=lambda: track), session.model


def clipped(share):
    """Clips all axes at a share of the largest reading."""

    def change(field):
        end = share * np.abs(field).max()
        return np.clip(field, -end, end)

    return change


def coarse(step):
    return lambda field: np.round(field / step) * step


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("seed", [2, 6, 7])
def test_a_clipped_magnetometer_is_calibrated_without_its_end(seed, turned):
    recording, (M, b) = session_read(seed, clipped(0.8))
    found = tumble.magnetometer(recording, field=48.0, turned=turned)
    sigma = np.sqrt(np.diag(found.magnetometer.covariance))
    assert (np.abs(found.magnetometer.b - b) < 5.0 * sigma[9:]).all()
    if not turned:
        assert (np.abs((found.magnetometer.M - M).ravel()) < 5.0 * sigma[:9]).all()
        assert abs(found.dip.value) < 90.0
        assert all(abs(point.dip) < 90.0 for point in found.points)
    assert any("of the magnetometer's range: left out" in warning for warning in found.warnings)


def test_a_magnetometer_that_is_mostly_clipped_is_refused():
    recording, _ = session_read(3, clipped(0.5))
    with pytest.raises(tumble.TumbleError, match=r"less than 60 % .* range: left out \d+ readings") as one:
        tumble.magnetometer(recording, field=48.0)
    assert "set a larger range, or move magnets and iron away" in str(one.value)


@pytest.mark.parametrize("step", [0.0, 0.15, 0.6, 1.5])
def test_sound_magnetometers_show_no_end_of_their_range(step):
    for seed in range(8):
        field = simulate_magnetometer(seed=seed).track.field
        track = replace(simulate_magnetometer(seed=seed).track, field=coarse(step)(field) if step else field)
        assert within_range(track, track) == (track, "")


def test_one_end_is_named_and_a_rest_at_it_is_left_out_whole():
    session = simulate_magnetometer(seed=4)
    end = 0.9 * session.track.field[:, 2].max()
    field = session.track.field.copy()
    field[:, 2] = np.minimum(field[:, 2], end)
    track = replace(session.track, field=field)
    at_end = np.flatnonzero(field[:, 2] == end)
    span = (float(track.time[at_end[0] - 5]), float(track.time[at_end[10]]))
    kept, remark = within_range(track, track, [span])
    assert f"z of {end:.4g} uT is the end of the magnetometer's range: left out" in remark
    assert " readings there in 1 rest, as the field was beyond it" in remark
    assert not ((kept.time >= span[0]) & (kept.time <= span[1])).any()
    assert (kept.field[:, 2] < end).all()
