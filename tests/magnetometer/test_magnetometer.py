"""Laws of the magnetometer procedure, on simulated sessions whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

import tumble
from tumble.foundation.magnetic import MagneticTrack
from tumble.procedures.magnetometer.earth_field import earth_field
from tumble.tools.simulate import simulate_magnetometer


@pytest.fixture(scope="module")
def session():
    return simulate_magnetometer(seed=7, current=True)


@pytest.fixture(scope="module")
def found(session):
    return tumble.magnetometer(session.recording, field=48.0, current=True)


def within(errors, sigmas, limit=4.5):
    """Tests errors against the size that their sigmas state."""
    return np.all(np.abs(errors) < limit * np.asarray(sigmas))


def test_iron_mounting_current_and_dip_are_found_within_sigma(session, found):
    M, b = session.model
    sigma = np.sqrt(np.diag(found.magnetometer.covariance))
    assert within((found.magnetometer.M - M).ravel(), sigma[:9])
    assert within(found.magnetometer.b - b, sigma[9:])
    current = [(each.value, each.sigma) for each in found.current]
    assert within(np.array(current)[:, 0] - session.response, np.array(current)[:, 1])
    assert within(found.dip.value - 65.0, found.dip.sigma)
    assert found.verdict == "calibrated"
    assert not found.disturbed
    assert sigma.max() < 0.2


def test_its_file_corrects_readings_to_the_field(session, found, tmp_path):
    found.save(tmp_path)
    loaded = tumble.Calibration.load(tmp_path / "magnetometer.yaml")
    track = session.track
    corrected = loaded.correct_magnetic(track.field, current=track.current)
    assert np.linalg.norm(corrected, axis=1) == pytest.approx(48.0, abs=1.6)
    assert loaded.magnetometer.field.value == 48.0
    assert loaded.magnetometer.dip.value == found.dip.value


def test_multipose_calibrates_all_three_triads_at_the_same_rests(session, found):
    result = tumble.multipose(session.recording, magnetometer=earth_field(48.0), current=True)
    assert result.verdict == "calibrated"
    assert pytest.approx(found.magnetometer.M, abs=1e-4) == result.magnetometer.magnetometer.M
    assert {name for name, _ in result.calibration.triads()} == {
        "accelerometer",
        "gyroscope",
        "magnetometer",
    }


def test_a_magnet_near_a_rest_is_named_and_left_out():
    session = simulate_magnetometer(seed=11, disturbed=5)
    found = tumble.magnetometer(session.recording, field=48.0)
    assert [point.disturbed for point in found.points] == [k == 4 for k in range(18)]
    assert any(line.startswith("rest 5, 22.") and "left out" in line for line in found.warnings)
    sigma = np.sqrt(np.diag(found.magnetometer.covariance))
    assert within(found.magnetometer.b - session.model[1], sigma[9:])


def test_without_a_rest_all_samples_show_all_but_the_mounting():
    session = simulate_magnetometer(seed=5, orientations=40, still=0.0, rate=50.0)
    found = tumble.magnetometer(session.recording, field=48.0)
    M, b = session.model
    assert found.verdict == "partly calibrated"
    assert not found.at_rest
    assert [each.observable for each in found.magnetometer.parameters[9:]] == [False] * 3
    # M M^T does not depend on the frame.
    own = found.magnetometer.M
    assert own @ own.T == pytest.approx(M @ M.T, abs=0.01)
    assert within(found.magnetometer.b - b, np.sqrt(np.diag(found.magnetometer.covariance)[9:]))
    assert any("no rests" in line or "rests show" in line for line in found.warnings)


def test_scale_is_relative_where_nobody_states_the_field(session):
    found = tumble.magnetometer(session.recording, current=True)
    assert np.linalg.det(found.magnetometer.M) == pytest.approx(1.0)
    factor = np.cbrt(np.linalg.det(session.model[0]))
    assert found.strength.value == pytest.approx(48.0 * factor, abs=5.0 * found.strength.sigma)
    assert found.calibration.magnetometer.field is None


def test_the_field_follows_from_place_and_day():
    north = earth_field(latitude=48.14, longitude=11.58, height=520.0, day=date(2026, 1, 1))
    south = earth_field(latitude=-33.9, longitude=151.2, day=date(2026, 1, 1))
    assert north.strength == pytest.approx(49.0, abs=0.5)
    assert north.dip == pytest.approx(64.5, abs=0.5)
    assert south.dip < -60.0
    assert 0.05 < north.sigma < 0.3
    with pytest.raises(tumble.TumbleError, match="2025 to 2029"):
        earth_field(latitude=48.0, longitude=11.0, day=date(2035, 1, 1))


def turned_level(session):
    """The same samples, as if the unit had only been turned about the vertical."""
    angle = np.linspace(0.0, 12.0, 600)
    dip = np.radians(65.0)
    field = 48.0 * np.column_stack(
        [np.cos(dip) * np.cos(angle), np.cos(dip) * np.sin(angle), 0 * angle - 0.9]
    )
    noise = np.random.default_rng(3).normal(0.0, 0.05, field.shape)
    return tumble.Recording.from_magnetic("level", MagneticTrack(angle, field + noise))


def mirrored(session):
    track = session.track
    flipped = replace(track, field=track.field * [1.0, 1.0, -1.0])
    return replace(session.recording, read_magnetic=lambda: flipped)


@pytest.mark.parametrize(
    ("recording", "options", "reason"),
    [
        (turned_level, {}, "turned about one axis alone"),
        (mirrored, {"latitude": 48.0, "longitude": 11.0}, "left-handed"),
        (lambda session: session.recording, {"field": 480.0}, "found nowhere on Earth"),
        (lambda session: session.recording, {"longitude": 11.0}, "--longitude needs --latitude"),
        (
            lambda session: replace(session.recording, read_magnetic=None),
            {},
            "holds no readings of a magnetometer",
        ),
        (
            lambda session: replace(
                session.recording, read_magnetic=lambda: replace(session.track, current=None)
            ),
            {"current": True},
            "neither a current nor a throttle",
        ),
        (
            lambda session: replace(
                session.recording,
                read_magnetic=lambda: replace(session.track, current=np.full(len(session.track), 3.0)),
            ),
            {"current": True},
            "hardly changes",
        ),
    ],
)
def test_a_log_that_cannot_serve_is_refused_in_one_line(session, recording, options, reason):
    with pytest.raises(tumble.TumbleError, match=reason) as refusal:
        tumble.magnetometer(recording(session), **options)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("axes", [[[1, 0, 0], [0, 1, 0], [0, 0, -1]], [[0, 1, 0], [1, 0, 0], [0, 0, 1]]])
def test_axes_that_may_be_left_handed_are_reported_without_a_place(session, found, axes):
    track = session.track
    changed = replace(track, field=track.field @ np.array(axes, dtype=float))
    recording = replace(session.recording, read_magnetic=lambda: changed)
    other = tumble.magnetometer(recording, field=48.0, current=True)
    assert other.dip.value == pytest.approx(-found.dip.value, abs=0.1)
    assert any("or they are left-handed" in line for line in other.warnings)
    assert not any("left-handed" in line for line in found.warnings)
