"""The rates that a table was commanded are the truth of gyroscopes, whatever scale the reference has."""

import json

import numpy as np
import pytest
from benchmarks.rate_tables import Session, Unit, usual
from tests.support.log_fixtures import real
from tests.support.repetitions import repetitions
from tests.support.turntable_sessions import calibrated, refusal, typed

import tumble
from tumble.foundation.errors import ProcedureError
from tumble.poses.pose_list import SIX_FACES, PoseList

WRONG_SCALE = 0.0017
RATES = (30, -30, 60, -60)


class BesideTheAxis(Session):
    """Units 0.1 m beside the axis of the table, which pulls them outwards."""

    def truth(self, time):
        force, rate = super().truth(time)
        arm = np.array([0.1, 0.02, -0.03])
        return force + np.cross(rate, np.cross(rate, arm)), rate


def recordings(seed, kind=Session, **session):
    """A session made by numpy whose reference is wrong in scale, and its target."""
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    made, unit = kind(**{"rates": RATES} | session), usual(random)
    best = Unit(
        M=np.eye(3) * (1.0 + WRONG_SCALE),
        b=random.normal(0.0, 1e-4, 3),
        force_b=random.normal(0.0, 0.01, 3),
    )
    return [made.recorded("reference", best, random), made.recorded("target", unit, random)], unit


def by_table(logs, **options):
    options = {"rates": [30, 60], "rate_accuracy": 1.0} | options
    return tumble.turntable(*logs, truth="table", **options)


def errors(gyroscope, unit):
    """(12,) errors of [M, b] over their sigmas, with what is inherited."""
    inherited = 0.0 if gyroscope.inherited is None else gyroscope.inherited
    sigma = np.sqrt(np.diag(gyroscope.covariance + inherited))
    return np.append((gyroscope.M - unit.M).ravel(), gyroscope.b - unit.b) / sigma


@pytest.mark.parametrize(
    ("kind", "session"),
    [
        (Session, {}),
        (Session, {"tilt": np.radians(0.5)}),
        (Session, {"rates": (30, None, -30, 60)}),
        (BesideTheAxis, {"rates": (60, -30, 30)}),
        (Session, {"rest": 0.0}),
    ],
)
def test_a_wrong_scale_of_the_reference_reaches_no_target(kind, session):
    found = []
    for seed in range(8100, 8100 + repetitions(6)):
        logs, unit = recordings(seed, kind, **session)
        result = by_table(logs)
        assert result.truth == "table"
        assert result.targets[0].verdict == "calibrated"
        found.append(errors(result.targets[0].gyroscope, unit))
    spread = np.sqrt(np.mean(np.square(found)))
    assert 0.8 < spread < 1.25, spread
    against_reference = errors(tumble.turntable(*logs).targets[0].gyroscope, unit)
    assert np.abs(against_reference).max() > 30.0


def test_a_rate_table_of_others_gives_the_same_by_its_rates():
    folder = real("cases/rate_table_stairs30")
    logs = (folder / "ref.parquet", folder / "dut.parquet")
    seen = tumble.turntable(*logs).targets[0].gyroscope
    result = tumble.turntable(*logs, truth="table", rates=[10, 20, 30], rate_accuracy=0.0)
    found = result.targets[0].gyroscope
    sigma = np.sqrt(np.diag(found.covariance) + np.diag(seen.covariance))[:9].reshape(3, 3)
    assert (np.abs(found.M - seen.M) < 4.0 * sigma).all()


def test_the_accuracy_of_the_table_is_within_the_sigma_of_scale():
    logs, _ = recordings(8201)
    sharp, vague = by_table(logs, rate_accuracy=0.0), by_table(logs, rate_accuracy=300.0)
    one, other = (result.targets[0].gyroscope for result in (sharp, vague))
    assert np.array_equal(one.M, other.M)
    for before, after in zip(one.parameters[3:6], other.parameters[3:6], strict=True):
        grown = np.sqrt(after.sigma**2 - before.sigma**2)
        assert grown == pytest.approx(300e-6 * after.value, rel=1e-3)
        assert after.inherited == pytest.approx(300e-6 * after.value, rel=1e-3)
    bias, bias_by_vague = one.parameters[0].sigma, other.parameters[0].sigma
    assert bias == pytest.approx(bias_by_vague)


def test_a_grade_of_the_reference_adds_its_axes_not_its_scale():
    logs, _ = recordings(8202)
    alone, graded = by_table(logs), by_table(logs, reference_grade="industrial")
    one, other = (np.diag(result.targets[0].gyroscope.inherited) for result in (alone, graded))
    assert other[0] < one[0] + (2e-4) ** 2
    assert other[1] > (5e-4) ** 2
    assert graded.inherited_from("gyroscope") == "grade industrial and table"


def test_an_accelerometer_is_calibrated_as_against_the_reference():
    logs, _ = recordings(8203)
    one, other = by_table(logs).targets[0], tumble.turntable(*logs).targets[0]
    assert np.array_equal(one.accelerometer.M, other.accelerometer.M)
    assert np.array_equal(one.accelerometer.covariance, other.accelerometer.covariance)


def test_rates_of_the_pose_list_are_the_commanded_ones():
    logs, _ = recordings(8204)
    listed = PoseList(SIX_FACES.poses, "list", rates=tuple(np.radians([30.0, 60.0])))
    result = by_table(logs, poses=listed, rates=None, rate_accuracy=None)
    assert result.commanded.rates == pytest.approx((30.0, 60.0))
    assert result.commanded.accuracy == 100.0
    assert result.commanded.assumed


def test_a_commanded_rate_that_was_never_turned_is_said():
    logs, _ = recordings(8205, rates=(30, -30))
    result = by_table(logs, rates=[30, 90])
    assert any("never turned at the commanded 90 deg/s" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"rates": None}, "give --rates 10,30,60"),
        ({"rates": [30]}, "turned at 60.11 deg/s from 16.1 s on, which is within 5 % of no commanded rate"),
        ({"rates": [-30, 60]}, "magnitudes above zero"),
        ({"rate_accuracy": -1.0}, "1-sigma in ppm"),
    ],
)
def test_rates_that_contradict_are_refused_in_a_line(options, said):
    logs, _ = recordings(8206, hold=5.0, rest=3.0)
    with pytest.raises(ProcedureError, match=said) as refused:
        by_table(logs, **options)
    assert "\n" not in str(refused.value)


def test_rates_without_the_truth_of_the_table_are_refused():
    with pytest.raises(ProcedureError, match="--rates and --rate-accuracy: used with --truth table only"):
        tumble.turntable("reference.csv", "target.csv", rates=[30], rate_accuracy=10.0)


def test_an_axis_off_the_vertical_is_refused():
    logs, _ = recordings(8207, tilt=np.radians(20.0), faces=((0, 0, 1), (1, 0, 0)), hold=30.0)
    with pytest.raises(ProcedureError, match="off the vertical"):
        by_table(logs)


def test_a_reference_without_gyroscope_or_turns_is_refused():
    logs, _ = recordings(8208, hold=5.0, rest=3.0)
    reference = logs[0]
    whole = next(iter(reference.chunks()))
    bare = tumble.Recording.from_arrays("bare", whole.time, whole.accelerometer, None)
    with pytest.raises(ProcedureError, match="needs a gyroscope in the reference"):
        by_table([bare, logs[1]])
    still, _ = recordings(8209, rates=())
    with pytest.raises(ProcedureError, match="it has none"):
        by_table(still)


def test_typed_table_truth_is_reported_and_kept(tmp_path):
    made = ("--grades", "tactical", "--rates", "10,40", "-o", tmp_path / "s")
    assert typed("simulate", "turntable", *made).code == 0
    logs = [tmp_path / "s" / "reference.csv", tmp_path / "s" / "target_1.csv"]
    asked = (*logs, "--truth", "table", "--rates", "10,40", "-o", tmp_path / "r")
    out = calibrated(*asked).text
    assert "the table at 10 and 40 deg/s, accurate to 100 ppm (assumed; see --rate-accuracy)" in out
    content = json.loads(calibrated(*asked, "--json").out)
    assert content["truth"] == "table"
    assert content["options"]["rate accuracy (ppm)"] == 100.0
    file = tumble.Calibration.load(tmp_path / "r" / "target_1.yaml")
    assert file.method.truth == "table"
    assert file.gyroscope.inherited.source == "table"
    assert file.gyroscope.inherited.sigma.scale[0] == pytest.approx(1e-4, rel=0.02)
    page = " ".join((tmp_path / "r" / "target_1.html").read_text("utf-8").split())
    assert "Non-orthogonality of the gyroscope" in page or "non-orthogonality of the gyroscope" in page
    assert "--rates ten" in refusal(*logs, "--truth", "table", "--rates", "ten", "-o", tmp_path / "r")
