"""Turns at a constant rate are turns, whatever gravity does, and calibrate a gyroscope."""

import json

import numpy as np
import pytest
import yaml
from benchmarks.rate_tables import Session, Unit, usual
from tests.support.log_fixtures import real
from tests.support.repetitions import repetitions
from tests.support.turntable_sessions import typed

import tumble
from tumble.foundation.recording import Recording
from tumble.logs import ReadOptions

ONE_FACE = ((0, 0, 1),)


def errors(found, M, b):
    """(12,) errors of [M, b] over their sigmas."""
    sigma = np.sqrt(np.diag(found.covariance))
    return np.concatenate([(found.M - M).ravel(), found.b - b]) / sigma


def run(seed, **session):
    """Result of a session made by numpy, its target's and its reference's errors."""
    random = np.random.default_rng(seed)
    made, unit = Session(**session), usual(random)
    best = Unit(b=random.normal(0.0, 1e-4, 3), force_b=random.normal(0.0, 0.01, 3))
    recordings = [made.recorded("reference", best, random), made.recorded("target", unit, random)]
    return tumble.turntable(*recordings), unit, best


@pytest.mark.parametrize(("case", "rests"), [("rate_table_const20", 18), ("rate_table_stairs30", 12)])
def test_a_session_of_a_rate_table_is_calibrated(case, rests):
    folder = real(f"cases/{case}")
    result = tumble.turntable(folder / "ref.parquet", folder / "dut.parquet")
    target = result.targets[0]
    truth = yaml.safe_load((folder / "truth.yaml").read_text())["dut"]
    assert target.verdict == "calibrated"
    assert (*result.warnings, *target.warnings) == ()
    assert len(result.reference.rests) == len(target.rests) == rests
    for triad in (target.accelerometer, target.gyroscope):
        known = truth[triad.triad]
        z = errors(triad, np.array(known["matrix"]), np.array(known["bias"]))
        assert np.abs(z).max() < 3.0, z
        assert np.sqrt(np.mean(z**2)) > 0.5, z
    scales = target.gyroscope.parameters[3:6]
    assert all(scale.sigma < 100e-6 for scale in scales)


@pytest.mark.parametrize(
    "session",
    [
        {"rates": (30, -30)},
        {"rates": (10, 60, -60, -10, 200, -200), "tilt": np.radians(0.5)},
        {"rates": (30, None, -30), "tilt": np.radians(0.1)},
        {"rates": (1, 5, -5, -1), "tilt": np.radians(0.3)},
        {"rates": (0.2, -0.2, 45), "rest": 5.0},
    ],
)
def test_errors_are_as_large_as_their_sigmas_at_constant_rates(session):
    found = []
    for seed in range(7100, 7100 + repetitions(16)):
        result, unit, _ = run(seed, **session)
        target = result.targets[0]
        assert target.verdict == "calibrated", seed
        found.append(errors(target.gyroscope, unit.M, unit.b))
        found.append(errors(target.accelerometer, unit.force_M, unit.force_b))
    spread = np.sqrt(np.mean(np.square(found)))
    assert 0.8 < spread < 1.25, spread


def test_without_any_rest_the_matrix_of_the_gyroscope_is_found():
    found = []
    for seed in range(7200, 7200 + repetitions(24)):
        result, unit, best = run(seed, rates=(10, 30, 60, -60, -30, -10), rest=0.0)
        target = result.targets[0]
        assert target.accelerometer is None
        assert result.reference.rests == ()
        assert any("no rest" in warning for warning in result.warnings)
        found.append(errors(target.gyroscope, unit.M, unit.b - unit.M @ best.b)[:9])
        bias = target.gyroscope.parameters[0]
        assert bias.sigma == pytest.approx(np.radians(0.1), rel=0.1)
        relative = target.gyroscope.b - (unit.b - unit.M @ best.b)
        # The Earth turns both; only what the reference's bias hides is left.
        assert np.abs(relative).max() < 1e-4
    assert 0.8 < np.sqrt(np.mean(np.square(found))) < 1.25


def test_one_face_shows_the_response_to_its_own_axis():
    result, unit, _ = run(7301, rates=(10, 30, -30, -10), faces=ONE_FACE)
    gyroscope = result.targets[0].gyroscope
    sigma = np.sqrt(np.diag(gyroscope.covariance)[8])
    assert abs(gyroscope.M[2, 2] - unit.M[2, 2]) < 4.0 * sigma < 4e-4
    assert any("case axis x" in reason for reason in gyroscope.unobservable)


def test_a_rate_not_fitted_is_predicted_as_by_least_squares():
    for seed in range(7400, 7400 + repetitions(4)):
        result, unit, _ = run(seed, rates=(30, -30))
        found = result.targets[0].gyroscope
        rate = np.radians(60.0) * np.eye(3)
        error = (rate @ unit.M.T + unit.b - found.b) @ np.linalg.inv(found.M).T - rate
        assert np.degrees(np.abs(error).max()) < 0.01, seed


def bent(unit, full_scale, linearity, asymmetry):
    """A unit whose axes bend: a cubic of that share of full scale, and a slope that differs by sign."""

    class Bent(Unit):
        def rate_reading(self, rate):
            cubic = linearity * full_scale * (rate / full_scale) ** 3
            return (rate + cubic + 0.5 * asymmetry * np.abs(rate)) @ self.M.T + self.b

    return Bent(unit.M, unit.b, unit.force_M, unit.force_b, unit.force_noise, unit.rate_noise, unit.delay)


def test_asymmetry_and_linearity_are_within_their_sigmas(tmp_path):
    errors_of = []
    for seed in range(7500, 7500 + repetitions(8)):
        random = np.random.default_rng(seed)
        session = Session(rates=(20, 50, 100, -100, -50, -20), hold=10.0, rest=5.0)
        unit = bent(usual(random), np.radians(100.0), 0.004, 0.002)
        result = tumble.turntable(
            session.recorded("reference", Unit(), random), session.recorded("target", unit, random)
        )
        target = result.targets[0]
        assert [each.axis for each in target.responses] == list("xyz")
        for response in target.responses:
            assert [round(level.rate, -1) for level in response.levels] == [-100, -50, -20, 20, 50, 100]
            assert response.full_scale == pytest.approx(100.0, rel=0.02)
            errors_of.append((response.asymmetry - 2000.0) / response.asymmetry_sigma)
            # A line through 4000 x^3 + 1000 |x| ppm, x the share of full scale, leaves 1200 at x = 1.
            assert abs(response.linearity - 1200.0) < 200.0
            assert response.linearity_sigma < 60.0
        paths = result.save(tmp_path / str(seed))
        page = next(tmp_path.glob(f"{seed}/**/target*.html")).read_text()
        assert "Gyroscope at constant rates" in page
        kept = tumble.Calibration.load(next(tmp_path.glob(f"{seed}/**/target*.yaml")))
        assert kept.gyroscope.constant_rates[0].asymmetry == pytest.approx(target.responses[0].asymmetry)
        assert "gyroscope asymmetry x (ppm)" in paths["summary"].read_text()
    assert np.sqrt(np.mean(np.square(errors_of))) < 3.0


def test_simulated_rates_are_found_and_reported(tmp_path):
    made = ("--grades", "tactical", "--rates", "10,40", "-o", tmp_path / "s")
    assert typed("simulate", "turntable", *made).code == 0
    logs = [tmp_path / "s" / "reference.csv", tmp_path / "s" / "target_1.csv"]
    done = typed("turntable", *logs, "-o", tmp_path / "r", "--json")
    assert done.code == 0, done.err
    gyroscope = json.loads(done.out)["targets"][0]["calibration"]["gyroscope"]
    for response in gyroscope["constant_rates"]:
        assert [round(level["rate"]) for level in response["levels"]] == [-40, -10, 10, 40]
        assert abs(response["asymmetry"]) < 4.0 * response["asymmetry_sigma"]
    assert "is not a rest" not in done.out + done.err


def test_clocks_that_are_apart_take_nothing_from_constant_rates():
    seed, offset, skew = 7300, 1234.5, 40e-6
    random = np.random.default_rng(seed)
    made, unit = Session(rates=(10, None, -10, None, 60, None, -60), tilt=np.radians(0.3)), usual(random)
    reference = made.recorded("reference", Unit(b=random.normal(0.0, 1e-4, 3)), random)
    (said,) = made.recorded("target", unit, random).chunks()
    target = Recording.from_arrays(
        "target", said.time * (1.0 + skew) + offset, said.accelerometer, said.gyroscope
    )
    found = tumble.turntable(reference, target, clock="apart").targets[0]
    assert found.verdict == "calibrated"
    assert found.clock.skew == pytest.approx(1e6 * skew, abs=4.0 * found.clock.skew_sigma)
    z = errors(found.gyroscope, unit.M, unit.b)
    assert np.abs(z).max() < 4.0, z


def test_constant_rates_in_files_of_their_own_are_reported_as_unused(tmp_path):
    random = np.random.default_rng(7301)
    made = Session(rates=(60, -60))
    for name, unit in (("reference", Unit()), ("target", usual(random))):
        (said,) = made.recorded(name, unit, random).chunks()
        (tmp_path / name).mkdir()
        for begun, _, _, knots in made.pieces():
            for k in np.flatnonzero((np.diff(knots[:, 1]) == 0.0) & (np.diff(knots[:, 0]) > 3.0)):
                start, end = begun + knots[k, 0] + 0.3, begun + knots[k + 1, 0] - 0.3
                rows = np.column_stack([said.time, said.accelerometer, said.gyroscope])
                rows = rows[(said.time >= start) & (said.time < end)]
                head = "time,ax,ay,az,gx,gy,gz"
                np.savetxt(
                    tmp_path / name / f"{start:07.2f}.csv", rows, delimiter=",", header=head, comments=""
                )
    result = tumble.turntable(
        tmp_path / "reference", tmp_path / "target", poses=None, read=ReadOptions(gyroscope_unit="rad/s")
    )
    assert np.isnan(np.diag(result.targets[0].gyroscope.covariance)[:9]).all()
    assert any("constant rates in files of their own, which gyroscopes" in each for each in result.warnings)
