"""Scale of an accelerometer rests on gravity: its uncertainty goes to every result, apart from the fit."""

import json
import math

import numpy as np
import pytest
from scipy.stats import chi2

import tumble
from spin_sessions import record, still, turn
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import ANOMALY, local_gravity
from tumble.foundation.recording import Recording
from tumble.tools.simulate import simulate_multipose
from turntable_sessions import calibrate, calibrated, one_line, rows, simulate, typed, write

G = tumble.foundation.constants.STANDARD_GRAVITY
VAGUE = 5e-3
"""m/s^2: larger than what noise leaves, so that the tests see gravity alone."""
LABORATORIES = 12
UNLIKELY = 1e-4


def laboratories(seed):
    """Gravity that laboratories take theirs to be, each wrong within its uncertainty."""
    return G + VAGUE * np.random.default_rng(seed).standard_normal(LABORATORIES)


def is_chi_square(z):
    low, high = chi2.ppf([UNLIKELY / 2, 1 - UNLIKELY / 2], len(z))
    return low < float(np.square(z).sum()) < high


def scale_z(triad, true):
    """Mean error of scale over its sigma: all axes err by the same share."""
    found = [p for p in triad.parameters if p.name.startswith("scale")]
    error = np.mean([p.value for p in found]) - np.mean(true)
    return error / np.mean([p.sigma for p in found])


def test_the_sigma_of_gravity_follows_from_its_source():
    assert local_gravity(None, None, None).sigma is None
    assert local_gravity(9.81, None, None).sigma == 0.0
    assert local_gravity(9.81, None, None, 1e-4).sigma == 1e-4
    assert local_gravity(None, 48.1, 520.0).sigma == ANOMALY
    assert 3.0 * ANOMALY > local_gravity(None, 48.1, None).sigma > 2.0 * ANOMALY
    assert local_gravity(None, 48.1, 520.0, 2e-5).sigma == 2e-5


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((None, None, None, 1e-3), "needs --gravity or --latitude"),
        ((9.81, None, None, 3.0), "1-sigma in m/s"),
    ],
)
def test_an_uncertainty_of_no_gravity_is_refused(given, words):
    with pytest.raises(ProcedureError, match=words):
        local_gravity(*given)


def test_a_turntable_target_inherits_the_scale_of_gravity():
    session = simulate(71, grades=("industrial", "industrial"))
    exact = calibrate(session, gravity=G)
    vague = calibrate(session, gravity=G, gravity_uncertainty=VAGUE)
    for one, other in zip(exact, vague, strict=True):
        assert np.array_equal(one.accelerometer.covariance, other.accelerometer.covariance)
        assert one.accelerometer.inherited is None
        m = other.accelerometer.M.ravel()
        expected = (VAGUE / G) ** 2 * np.outer(m, m)
        assert np.allclose(other.accelerometer.inherited[:9, :9], expected, atol=0.02 * expected.max())
        assert other.gyroscope.inherited is None
    assert vague.inherited_from("accelerometer") == "gravity"


def test_turntable_sigmas_hold_where_laboratories_mistake_gravity():
    z = []
    for number, gravity in enumerate(laboratories(72)):
        session = simulate(7200 + number)
        found = calibrate(session, gravity=gravity, gravity_uncertainty=VAGUE)[0].accelerometer
        z.append(scale_z(found, np.diag(session.target_units[0].accelerometer.K)))
    assert is_chi_square(z), z


def test_multipose_sigmas_hold_where_laboratories_mistake_gravity():
    z = []
    for number, gravity in enumerate(laboratories(73)[:6]):
        session = simulate_multipose(
            seed=7300 + number, bias_instability=False, g_sensitivity=False, latitude_deg=None
        )
        found = tumble.multipose(session.recording, gravity=gravity, gravity_uncertainty=VAGUE)
        m, true = found.accelerometer.M.ravel(), session.force_matrix.ravel()
        sigma = math.sqrt(m @ (found.accelerometer.covariance + found.accelerometer.inherited)[:9, :9] @ m)
        z.append(float(m @ (m - true)) / sigma)
    assert is_chi_square(z), z
    kept = found.calibration.accelerometer
    assert kept.inherited.source == "gravity"
    assert np.allclose(kept.total_covariance, kept.covariance + found.accelerometer.inherited, equal_nan=True)


def robot_log(folder, seed):
    session = record([still(), turn(3.0), still(2.0), turn(-3.0), still(2.0)], seed)
    return session, session.write(folder / f"robot_{seed}.csv")


def test_spin_sigmas_hold_where_laboratories_mistake_gravity(tmp_path):
    session, log = robot_log(tmp_path, 74)
    z = []
    for gravity in laboratories(74):
        found = tumble.spin(log, gravity=gravity, gravity_uncertainty=VAGUE)
        up = found.spins[0].up
        covariance = found.covariance[:3, :3] + VAGUE**2 * np.outer(up, up)
        assert np.allclose(found.accelerometer_bias.sigma, np.sqrt(np.diag(covariance)))
        z.append(float(up @ (found.accelerometer_bias.value - session.robot.accelerometer_bias)))
    assert is_chi_square(np.array(z) / math.sqrt(up @ covariance @ up)), z
    kept = found.calibration.accelerometer
    assert np.allclose(kept.inherited.covariance[9:, 9:], VAGUE**2 * np.outer(up, up))
    assert np.allclose(np.diag(kept.total_covariance)[9:], kept.sigma.bias**2)


def test_scale_found_with_the_same_gravity_cancels_its_error(tmp_path):
    _, log = robot_log(tmp_path, 75)
    hand = simulate_multipose(seed=75)
    scaled = tumble.multipose(hand.recording, gravity=G, gravity_uncertainty=VAGUE).calibration
    same = tumble.spin(log, gravity=G, gravity_uncertainty=VAGUE, calibration=scaled)
    assert np.array_equal(same.accelerometer_bias.sigma, np.sqrt(np.diag(same.covariance)[:3]))
    assert np.sqrt(same.calibration.accelerometer.inherited.covariance[11, 11]) < 0.01 * VAGUE
    elsewhere = tumble.spin(log, gravity=G + 0.01, gravity_uncertainty=VAGUE, calibration=scaled)
    kept = elsewhere.calibration.accelerometer.inherited
    assert np.sqrt(kept.covariance[11, 11]) == pytest.approx(math.sqrt(2.0) * VAGUE, rel=0.02)
    assert kept.source == "gravity"


def test_an_uncertain_gravity_is_no_fault_of_a_stated_reference():
    """The reference states 1e-7, gravity has a stated error of 8 mm/s^2: nothing is left to explain."""
    from uncertain_references import calibration_of, exact, stated

    covariances = stated(1e-7, {"accelerometer": 1e-5, "gyroscope": 1e-5})
    options = {"reference_calibration": calibration_of(covariances, exact(covariances)), "gravity": G + 0.008}
    session = simulate(76)
    unexplained = calibrate(session, **options)
    explained = calibrate(session, gravity_uncertainty=VAGUE, **options)
    assert any("|f| deviates" in each for each in unexplained.warnings)
    assert not any("|f| deviates" in each for each in explained.warnings)


def test_a_wrong_reference_does_not_lean_on_an_uncertain_gravity():
    """One axis that is 0.3 % off is no gravity: sigmas are widened as without its uncertainty."""
    session = simulate(81)
    samples = session.reference_unit.samples
    crooked = Recording.from_arrays(
        "crooked", samples.time, samples.accelerometer * [1.003, 1.0, 1.0], samples.gyroscope, clock="table"
    )
    found = [
        tumble.turntable(crooked, session.targets, gravity=G, gravity_uncertainty=sigma, clock="shared")
        for sigma in (0.0, 1e-3)
    ]
    for result in found:
        assert any("|f| deviates" in each for each in result.warnings)
    exact, vague = (result[0].accelerometer.covariance for result in found)
    assert np.allclose(exact, vague)


def test_scale_by_standard_gravity_is_reported_as_relative(tmp_path):
    logs = write(simulate(77), tmp_path)
    done = calibrated(*logs, "-o", tmp_path / "out")
    sentence = "the scale of accelerometers is relative to it"
    assert sentence in done.text
    assert "state --latitude and --height, or --gravity" in done.text
    assert sentence in " ".join((tmp_path / "out/target_1.html").read_text("utf-8").split())
    assert tumble.Calibration.load(tmp_path / "out/target_1.yaml").gravity.sigma is None
    content = json.loads(calibrated(*logs, "-o", tmp_path / "out", "--json").out)
    assert content["gravity"] == {"value": G, "source": "standard", "sigma": None}


def test_files_keep_the_share_of_gravity_apart(tmp_path):
    logs = write(simulate(78, gravity=local_gravity(None, 48.1, 520.0).value), tmp_path)
    place = ("--latitude", "48.1", "--height", "520")
    done = calibrated(*logs, *place, "-o", tmp_path / "out")
    assert "± 0.00035 m/s², within the sigmas of the scale of accelerometers" in done.text
    row = rows(tmp_path / "out")["target_1"]
    share = float(row["sigma in common accelerometer scale x"])
    assert share == pytest.approx(ANOMALY / 9.81, rel=0.05)
    kept = tumble.Calibration.load(tmp_path / "out/target_1.yaml")
    assert kept.gravity.sigma == ANOMALY
    assert kept.accelerometer.inherited.sigma.scale[0] == pytest.approx(share, rel=1e-6)
    assert kept.gyroscope.inherited is None


@pytest.mark.parametrize("command", ["multipose", "spin", "turntable"])
def test_an_uncertainty_without_gravity_is_one_line(command, tmp_path):
    _, log = robot_log(tmp_path, 79)
    targets = [robot_log(tmp_path, 80)[1]] if command == "turntable" else []
    done = typed(command, log, *targets, "--gravity-uncertainty", "1e-3", "-o", tmp_path / "out")
    assert done.code == 2
    assert "--gravity-uncertainty needs --gravity or --latitude" in one_line(done.err)
