"""Magnetometers of logs: as tables, flight logs, bags and phones hold them."""

from pathlib import Path

import numpy as np
import pandas
import pytest
import scipy.io

from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MagneticTrack
from tumble.logs.columns import recognise
from tumble.logs.options import ReadOptions
from tumble.logs.reading import open_recording
from tumble.logs.repeated_readings import firsts_of_runs

RNG = np.random.default_rng(34)
ROWS = 400
TIME = np.arange(ROWS) / 200
FIELD = np.array([20.0, -5.0, 42.0]) + RNG.normal(0, 8.0, (ROWS, 3))
STILL = np.tile([0.0, 0.0, 9.81, 0.0, 0.0, 0.0], (ROWS, 1)) + RNG.normal(0, 0.01, (ROWS, 6))


def table(field: np.ndarray = FIELD, names: tuple[str, ...] = ("mx", "my", "mz")) -> pandas.DataFrame:
    columns = ("ax [m/s^2]", "ay [m/s^2]", "az [m/s^2]", "gx [rad/s]", "gy [rad/s]", "gz [rad/s]")
    frame = pandas.DataFrame(STILL, columns=columns)
    frame.insert(0, "time", TIME)
    for axis, name in enumerate(names):
        frame[name] = field[:, axis]
    return frame


def magnetic(source: object, **options: object) -> MagneticTrack:
    found = open_recording(source, ReadOptions(**options), need_imu=False).magnetic
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("name", "axis", "imu", "unit"),
    [
        ("mx", 0, "", None),
        ("my_uT", 1, "", "uT"),
        ("mz_mG", 2, "", "mG"),
        ("mag_x", 0, "", None),
        ("magY", 1, "", None),
        ("MagneticField.z", 2, "", None),
        ("magnetometer_x [nT]", 0, "", "nT"),
        ("magnetic_field.y", 1, "", None),
        ("imu2_mag_z", 2, "imu2", None),
        ("Mag_X (G)", 0, "", "G"),
        ("Shimmer_Mag_X_CAL", 0, "Shimmer", None),
    ],
)
def test_names_of_a_magnetometer_are_known(name: str, axis: int, imu: str, unit: str | None) -> None:
    column = recognise(name)
    assert column is not None
    assert (column.quantity, column.axis, column.imu, column.unit) == ("magnetometer", axis, imu, unit)


@pytest.mark.parametrize(
    ("unit", "scale"), [("uT", 1.0), ("nT", 1e-3), ("T", 1e6), ("G", 100.0), ("mG", 0.1)]
)
def test_field_is_read_in_the_unit_of_the_column(unit: str, scale: float, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    table(FIELD / scale, (f"mx_{unit}", f"my_{unit}", f"mz_{unit}")).to_csv(path, index=False)
    found = magnetic(path)
    np.testing.assert_allclose(found.field, FIELD, rtol=1e-12)
    np.testing.assert_allclose(found.time, TIME)
    assert (found.unit, found.unit_reason, found.remarks) == (unit, "column name", ())


@pytest.mark.parametrize("ending", ["csv", "parquet", "feather", "mat", "npz", "frame"])
def test_all_tables_hold_the_same_magnetometer(ending: str, tmp_path: Path) -> None:
    path, frame = tmp_path / f"log.{ending}", table()
    arrays = {
        "time": TIME,
        "acc": STILL[:, :3],
        "gyro": STILL[:, 3:],
        "mag": FIELD,
    }
    if ending == "csv":
        frame.to_csv(path, index=False)
    elif ending in ("parquet", "feather"):
        getattr(frame, f"to_{ending}")(path)
    elif ending == "mat":
        scipy.io.savemat(path, {name: np.atleast_2d(values.T).T for name, values in arrays.items()})
    elif ending == "npz":
        np.savez(path, **arrays)
    found = magnetic(frame if ending == "frame" else path)
    np.testing.assert_allclose(found.field, FIELD, rtol=1e-12)
    np.testing.assert_allclose(found.time, TIME, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("time,mx,my,mz\n0.0,20,0,40\n0.1,21,0,40\n0.2,20,1,40\n", 3),
        ("millis;magX;magY;magZ\n0;20;0;40\n100;21;0;40\n200;20;1;40\n", 3),
        ("20 0 40\n21 0 40\n20 1 40\n", 3),
        ("0.0 20 0 40\n0.1 21 0 40\n0.2 20 1 40\n", 3),
    ],
)
def test_magnetometer_alone_is_read_where_asked_for(text: str, count: int, tmp_path: Path) -> None:
    path = tmp_path / "mag.txt"
    path.write_text(text)
    recording = open_recording(path, need_imu=False)
    assert (recording.metadata.triads, list(recording.chunks())) == ((), [])
    assert recording.magnetic is not None
    assert len(recording.magnetic) == count
    assert recording.magnetic.field[1].tolist() == [21.0, 0.0, 40.0]
    step = recording.magnetic.time[1] - recording.magnetic.time[0]
    assert step == pytest.approx(0.1 if "0.1" in text or "100" in text else 1.0)
    with pytest.raises(LogError):
        open_recording(path)


def test_magnetometer_alone_names_the_procedure_for_it(tmp_path: Path) -> None:
    path = tmp_path / "mag.csv"
    path.write_text("time,mx,my,mz\n0.0,20,0,40\n0.1,21,0,40\n")
    with pytest.raises(LogError, match="tumble magnetometer reads it"):
        open_recording(path)


def test_axes_of_the_case_turn_the_field_with_the_imu(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    table().to_csv(path, index=False)
    turned = magnetic(path, axes="y,-x,z").field
    np.testing.assert_allclose(turned, FIELD @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]).T)


def test_unlikely_strength_is_reported_with_the_unit_that_fits(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    table(FIELD / 100.0).to_csv(path, index=False)
    (remark,) = magnetic(path).remarks
    assert "it would be in G; state it with --magnetometer-unit" in remark
    assert magnetic(path, magnetometer_unit="G").remarks == ()


@pytest.mark.parametrize("current", ["current", "throttle", "I_esc"])
def test_current_stands_beside_each_reading(current: str, tmp_path: Path) -> None:
    path, frame = tmp_path / "log.csv", table()
    frame[current] = np.linspace(0.0, 1.0, ROWS)
    frame.to_csv(path, index=False)
    found = magnetic(path, columns={"current": current} if current == "I_esc" else {})
    np.testing.assert_allclose(found.current, np.linspace(0.0, 1.0, ROWS))
    assert found.current_unit == ("1" if current == "throttle" else "A")


def test_times_of_its_own_are_those_of_the_magnetometer(tmp_path: Path) -> None:
    path, frame = tmp_path / "log.csv", table()
    own = frame.index % 10 == 0
    frame["magnetic_time_s"] = np.where(own, TIME - 0.002, np.nan)
    for name in ("mx", "my", "mz"):
        frame.loc[~own, name] = np.nan
    frame.to_csv(path, index=False)
    found = magnetic(path)
    np.testing.assert_allclose(found.time, TIME[::10] - 0.002)
    np.testing.assert_allclose(found.field, FIELD[::10])


@pytest.mark.parametrize("rows", [10, 4, 2])
def test_repeated_rows_of_a_slower_magnetometer_are_left_out(rows: int, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    table(np.repeat(FIELD, rows, axis=0)[:ROWS]).to_csv(path, index=False)
    found = magnetic(path)
    np.testing.assert_allclose(found.field, FIELD[: ROWS // rows])
    np.testing.assert_allclose(found.time, TIME[::rows])
    assert f"is slower, about {200 / rows:g} Hz" in found.remarks[0]


def test_rows_of_three_quarters_of_the_rate_are_told_from_chance() -> None:
    slower = np.floor(np.arange(2000) * 0.75).astype(int)
    kept = firsts_of_runs(RNG.normal(size=(2000, 3))[slower])
    assert kept is not None
    assert kept.sum() == 1500


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.3, 1.0])
def test_coarse_sensor_at_rest_keeps_all_its_rows(noise: float) -> None:
    """Counts of 1 with noise well below them repeat by chance, with runs of all lengths."""
    counts = np.round(np.array([20.3, -5.45, 42.1]) + RNG.normal(0, noise, (4000, 3)))
    assert firsts_of_runs(counts) is None


def test_folder_of_poses_joins_the_magnetometers_of_its_files(tmp_path: Path) -> None:
    for pose in range(3):
        table(FIELD + pose).to_csv(tmp_path / f"pose_{pose}.csv", index=False)
    recording = open_recording(tmp_path)
    assert recording.magnetic is not None
    np.testing.assert_allclose(recording.magnetic.field, np.concatenate([FIELD + pose for pose in range(3)]))
    samples = np.concatenate([chunk.time for chunk in recording.chunks()])
    np.testing.assert_array_equal(recording.magnetic.time, samples)
