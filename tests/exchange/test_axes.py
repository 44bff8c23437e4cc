"""Axes from the log through the calibration into the file of another program."""

import numpy as np
import pytest

from exchange_units import calibration, needed
from tumble.calibration.document import Calibration
from tumble.calibration.turned_axes import turned as turned_calibration
from tumble.foundation.body_axes import are_axes, rotation, turned
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.logs import ReadOptions, open_recording
from tumble.tools.exchange.procedure import export, import_calibrations
from turntable_sessions import typed

PX4 = ("--set", "accelerometer-id=1", "--set", "gyroscope-id=2")
LETTERS = "FBLRUD"
RIGHT_HANDED = [
    axes for axes in (a + b + c for a in LETTERS for b in LETTERS for c in LETTERS) if are_axes(axes)
]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A session of poses as a bag of ROS, whose axes are FLU by REP 103."""
    folder = tmp_path_factory.mktemp("axes")
    assert (
        typed("simulate", "multipose", "--orientations", "12", "--seed", "7", "-o", folder / "hand").code == 0
    )
    path = folder / "hand.mcap"
    done = typed("convert", folder / "hand" / "multipose.csv", "-o", path)
    assert done.code == 0, done.err
    return path


def of_bag(bag, folder, *options):
    done = typed("multipose", bag, *options, "-o", folder)
    assert done.code == 0, done.err
    return folder / "hand.multipose.yaml"


def test_there_are_24_axes_and_each_is_turned_into_each():
    assert len(RIGHT_HANDED) == 24
    for one in RIGHT_HANDED:
        for other in RIGHT_HANDED:
            matrix = rotation(other, one)
            assert np.linalg.det(matrix) == pytest.approx(1.0)
            assert turned(one, matrix) == other


def test_a_bag_in_flu_gives_px4_what_the_same_bag_read_in_frd_gives(tmp_path, bag):
    flu, frd = of_bag(bag, tmp_path / "flu"), of_bag(bag, tmp_path / "frd", "--axes", "x,-y,-z")
    assert (Calibration.load(flu).axes, Calibration.load(frd).axes) == ("FLU", "FRD")
    texts = []
    for path in (flu, frd):
        out = path.with_suffix(".params")
        done = typed("export", path, "--format", "px4", *PX4, "-o", out)
        assert done.code == 0, done.err
        texts.append([line.split("\t") for line in out.read_text().splitlines() if not line.startswith("#")])
    assert "is turned into these" in "".join(flu.with_suffix(".params").read_text().splitlines()[:4])
    assert "was calibrated in these" in "".join(frd.with_suffix(".params").read_text().splitlines()[:4])
    first, second = ({row[2]: float(row[3]) for row in rows} for rows in texts)
    assert set(first) == set(second)
    # Results depend on the order of axes in the last digits.
    assert all(first[name] == pytest.approx(second[name], abs=1e-6) for name in first)
    assert abs(first["CAL_ACC0_YOFF"]) > 1e-3


def test_axes_of_a_log_that_were_left_handed_are_not_stated(bag):
    assert open_recording(bag).metadata.body == "FLU"
    assert open_recording(bag, ReadOptions(axes="y,-x,z")).metadata.body == "LBU"
    assert open_recording(bag, ReadOptions(axes="x,-y,z")).metadata.body == ""


def test_axes_of_a_program_come_back_and_are_turned_again(tmp_path):
    unit = calibration(5, parts=()).model_copy(update={"axes": "FLU"})
    path = tmp_path / "imu.params"
    path.write_bytes(export(unit, "px4", needed("px4")).content)
    (back,) = import_calibrations(path)
    assert back.axes == "FRD"
    assert back.accelerometer.b == pytest.approx(np.array([1, -1, -1]) * unit.accelerometer.b, rel=1e-6)
    again = export(back, "ros2").content.decode()
    numbers = next(line for line in again.splitlines() if "accelerometer_bias" in line).partition("[")[2]
    assert [float(each) for each in numbers.strip("] ").split(",")] == pytest.approx(
        unit.accelerometer.b, rel=1e-6
    )


def test_axes_that_nobody_defines_are_remarked_on_and_can_be_stated():
    unit = calibration(5)
    (stated, *_) = export(unit, "ros2").remarks
    assert "does not define its axes" in stated
    assert "--set axes=" in stated
    (stated, *_) = export(unit, "ros2", {"axes": "flu"}).remarks
    assert "was calibrated in these" in stated


@pytest.mark.parametrize("axes", ["XYZ", "FRU", "FFU", "F", "FLUD"])
def test_axes_that_are_none_are_refused(tmp_path, axes):
    with pytest.raises(ProcedureError, match=f"--set axes={axes}: give directions"):
        export(calibration(5), "ros2", {"axes": axes})
    path = tmp_path / "unit.yaml"
    calibration(5).save(path)
    path.write_text(f"{path.read_text()}axes: {axes}\n")
    with pytest.raises(CalibrationFileError, match="are none of a vehicle"):
        Calibration.load(path)


@pytest.mark.parametrize("to", ["FRD", "LBU", "DRB"])
def test_uncertainty_and_temperature_turn_with_the_axes(to):
    unit = calibration(9, over_temperature=True).model_copy(update={"axes": "FLU"})
    generator = np.random.default_rng(9)
    spread = generator.normal(size=(12, 12))
    covariance = spread @ spread.T
    covariance[3], covariance[:, 3] = np.nan, np.nan
    section = unit.accelerometer.model_copy(update={"covariance": covariance})
    unit = unit.model_copy(update={"accelerometer": section})
    other = turned_calibration(unit, to)
    turn = np.array(rotation(to, "FLU"))
    rows = np.kron(turn, turn)
    known = np.where(np.isnan(covariance), 0.0, covariance)
    whole = np.zeros((12, 12))
    whole[:9, :9], whole[9:, 9:] = rows, turn
    expected = whole @ known @ whole.T
    found = other.accelerometer.covariance
    gaps = np.isnan(found)
    assert gaps.sum() == 23
    assert np.allclose(found[~gaps], expected[~gaps])
    force, rate = 9.8 * generator.normal(size=(20, 3)), generator.normal(size=(20, 3))
    for degrees in (-5.0, 45.0):
        ours = unit.correct(force, rate, degrees)
        theirs = other.correct(force @ turn.T, rate @ turn.T, degrees)
        for one, two in zip(ours, theirs, strict=True):
            assert np.allclose(one @ turn.T, two, rtol=1e-12, atol=1e-12)
