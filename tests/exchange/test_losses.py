"""Parts that a format cannot hold are reported, with the error that remains."""

import re

import numpy as np
import pytest

from exchange_units import calibration, needed
from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import TYPICAL, lower_and_rotation, sensing_axes
from tumble.tools.exchange.procedure import export

G = 9.80665


def directions(count=2000):
    generator = np.random.default_rng(0)
    drawn = generator.normal(size=(count, 3))
    return drawn / np.linalg.norm(drawn, axis=1)[:, np.newaxis]


@pytest.mark.parametrize("seed", range(6))
def test_a_matrix_is_its_scale_its_non_orthogonality_and_its_mounting(seed):
    matrix = calibration(seed).gyroscope.M
    axes = sensing_axes(matrix)
    assert np.allclose(np.diag(axes.scale) @ axes.non_orthogonality @ axes.mounting, matrix)
    assert np.allclose(np.triu(axes.non_orthogonality, 1), 0.0)
    assert np.allclose(axes.mounting @ axes.mounting.T, np.eye(3))
    lower, turned = lower_and_rotation(matrix)
    assert np.allclose(lower @ turned, matrix)
    assert (np.diag(lower) > 0.0).all()


@pytest.mark.parametrize("part", ["scale", "non-orthogonality", "mounting"])
@pytest.mark.parametrize("triad", TRIADS)
def test_a_loss_is_the_largest_error_that_leaving_the_part_out_makes(triad, part):
    unit = calibration(5, parts=(part,))
    section = getattr(unit, triad)
    truth = TYPICAL[triad] * directions()
    # Nothing but the bias is taken off.
    error = np.linalg.norm(truth @ section.M.T - truth, axis=1).max()
    lost = [each for each in export(unit, "betaflight").losses if (each.triad, each.part) == (triad, part)]
    assert lost[0].size == pytest.approx(error, rel=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_sum_of_losses_bounds_the_error_of_ardupilot(seed):
    unit = calibration(seed)
    generator = np.random.default_rng(seed)
    force, rate = G * directions(), directions() * generator.uniform(0.0, 1.0, (2000, 1))
    read_force = force @ unit.accelerometer.M.T + unit.accelerometer.b
    read_rate = rate @ unit.gyroscope.M.T + force @ unit.gyroscope.g_sensitivity.T + unit.gyroscope.b
    left = {
        "accelerometer": (read_force - unit.accelerometer.b) / sensing_axes(unit.accelerometer.M).scale
        - force,
        "gyroscope": read_rate - unit.gyroscope.b - rate,
    }
    losses = export(unit, "ardupilot").losses
    for triad, error in left.items():
        stated = sum(loss.size for loss in losses if loss.triad == triad)
        # Products of two small errors stand beside the sum.
        assert 0.3 * stated < np.linalg.norm(error, axis=1).max() < 1.05 * stated


def test_value_that_px4_takes_for_none_is_reported_as_lost():
    unit = Calibration.model_validate(
        {
            "name": "small",
            "accelerometer": {"unit": "m/s^2", "M": np.diag([1.004, 1.0, 1.0]), "b": np.full(3, 0.004)},
            "gyroscope": {"unit": "rad/s", "M": np.eye(3), "b": np.array([0.008, 0.0, 0.0])},
        }
    )
    losses = export(unit, "px4", {"accelerometer-id": "1", "gyroscope-id": "2"}).losses
    assert [(each.triad, each.part.partition(",")[0]) for each in losses] == [
        ("accelerometer", "bias"),
        ("accelerometer", "scale"),
        ("gyroscope", "bias"),
    ]
    assert losses[0].size == pytest.approx(0.004 * np.sqrt(3.0))


@pytest.mark.parametrize(
    ("to", "change", "message"),
    [
        ("ardupilot", {"b": np.array([4.0, 0.0, 0.0])}, "a bias of 4 m/s^2 is more than the 3.5"),
        ("ardupilot", {"M": np.diag([1.3, 1.0, 1.0])}, "a scale of 0.7692 is not within the 0.8 to 1.2"),
        ("px4", {"M": np.eye(3) * 400.0}, "CAL_ACC0_XSCALE would be 0.0025"),
    ],
)
def test_value_that_firmware_refuses_is_refused_before(to, change, message):
    unit = calibration(1, parts=())
    unit = unit.model_copy(update={"accelerometer": unit.accelerometer.model_copy(update=change)})
    with pytest.raises(ProcedureError, match=re.escape(message)):
        export(unit, to, {"accelerometer-id": "1", "gyroscope-id": "2"} if to == "px4" else {})


def test_noise_of_zero_which_estimators_refuse_is_asked_for():
    unit = calibration(1)
    silent = unit.accelerometer.model_copy(update={"random_walk": np.zeros(3)})
    with pytest.raises(ProcedureError, match="accelerometer_random_walk is not in the calibration"):
        export(unit.model_copy(update={"accelerometer": silent}), "openvins", {"rate": "100"})


def test_zero_bias_is_not_taken_by_ardupilot_for_no_calibration():
    unit = calibration(1, parts=("scale",))
    unit = unit.model_copy(update={"accelerometer": unit.accelerometer.model_copy(update={"b": np.zeros(3)})})
    lines = export(unit, "ardupilot").content.decode().splitlines()
    found = dict(line.split(",") for line in lines if not line.startswith("#"))
    offsets = [float(found[f"INS_ACCOFFS_{axis}"]) for axis in "XYZ"]
    assert any(offsets)
    assert np.linalg.norm(offsets) < 1e-5


@pytest.mark.parametrize(
    ("to", "remark"),
    [
        ("px4", "before SENS_BOARD_ROT"),
        ("ardupilot", "before AHRS_ORIENTATION"),
        ("ardupilot", "INS_GYR_CAL,0 keeps ArduPilot from finding gyroscope biases anew"),
        ("betaflight", "after align_acc, align_mag and the alignment of the board"),
        ("kalibr-noise", "it holds noise alone"),
    ],
)
def test_remarks_on_a_format_come_with_each_file(to, remark):
    assert remark in " ".join(export(calibration(1), to, needed(to)).remarks)


@pytest.mark.parametrize("to", ["kalibr", "openvins"])
def test_biases_without_a_field_in_a_chain_are_reported_as_lost(to):
    unit = calibration(1)
    lost = {(each.triad, each.part): each.size for each in export(unit, to, needed(to)).losses}
    for triad in TRIADS:
        assert lost[triad, "bias"] == pytest.approx(np.abs(getattr(unit, triad).b).max())


def test_noise_that_is_not_known_is_asked_for():
    unit = Calibration.model_validate(
        {"name": "quiet", "gyroscope": {"unit": "rad/s", "M": np.eye(3), "b": np.zeros(3)}}
    )
    with pytest.raises(ProcedureError, match="accelerometer_noise_density is not in the calibration"):
        export(unit, "kalibr-noise", {"rate": "100"})
