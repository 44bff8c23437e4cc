"""Logs with one triad serve what they can, and everything else refuses them in one line."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from log_fixtures import refusal
from tumble.foundation.errors import ArrayError, LogError, ProcedureError
from tumble.foundation.recording import Recording
from tumble.logs import open_recording
from tumble.tools.inspect.procedure import inspect
from turntable_sessions import one_line, simulate, typed

SEED = 41
COLUMNS = {"acc": (1, 2, 3), "gyro": (4, 5, 6), "both": (1, 2, 3, 4, 5, 6)}
NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz")


@pytest.fixture(scope="module")
def session():
    return simulate(SEED)


def arrays(recording):
    chunks = list(recording.chunks())
    return tuple(
        np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    )


def only(recording, triad, name=""):
    time, accelerometer, gyroscope = arrays(recording)
    return Recording.from_arrays(
        name or f"{recording.name}-{triad}",
        time,
        accelerometer if triad == "accelerometer" else None,
        gyroscope if triad == "gyroscope" else None,
    )


def log(folder, recording, kind):
    """A CSV log of a recording with the columns of one triad, or both."""
    table = np.column_stack(arrays(recording))
    kept = [0, *COLUMNS[kind]]
    path = folder / f"{recording.name}_{kind}.csv"
    np.savetxt(
        path, table[:, kept], fmt="%.9g", delimiter=",", header=",".join(NAMES[k] for k in kept), comments=""
    )
    return path


@pytest.mark.parametrize("triad", ["accelerometer", "gyroscope"])
def test_single_triad_target_equals_that_triad_beside_the_other(session, triad):
    target = session.targets[0]
    result = tumble.turntable(session.reference, [target, only(target, triad)])
    both, alone = (getattr(each, triad) for each in result.targets)
    other = "gyroscope" if triad == "accelerometer" else "accelerometer"
    assert getattr(result.targets[1], other) is None
    assert np.abs(alone.M - both.M).max() < 1e-3
    assert all(parameter.observable for parameter in alone.parameters)
    assert any(f"no {other} readings were recorded" in warning for warning in result.targets[1].warnings)


def test_six_faces_of_accelerometers_alone_are_a_session(session):
    reference, target = (only(each, "accelerometer") for each in (session.reference, session.targets[0]))
    result = tumble.turntable(reference, [target, session.targets[0]])
    first, second = result.targets
    assert first.gyroscope is None
    assert second.gyroscope is None
    assert np.allclose(first.accelerometer.M, second.accelerometer.M, atol=1e-3)
    assert np.isnan(result.reference.gyroscope_bias).all()
    assert any("the reference has no gyroscope" in warning for warning in second.warnings)


def test_units_without_gyroscope_are_not_reported_to_share_one(session):
    reference, target = (only(each, "accelerometer") for each in (session.reference, session.targets[0]))
    result = tumble.turntable(reference, [target])
    assert not any("read the same to the bit" in warning for warning in result.targets[0].warnings)


def test_a_reference_without_accelerometer_is_refused_in_one_line(session):
    with pytest.raises(ProcedureError, match="the reference has no accelerometer"):
        tumble.turntable(only(session.reference, "gyroscope"), session.targets[:1])


def test_rates_without_rates_of_the_reference_are_refused(session):
    reference = only(session.reference, "accelerometer")
    with pytest.raises(ProcedureError, match="gyroscope readings only, and the reference has none"):
        tumble.turntable(reference, [only(session.targets[0], "gyroscope")])


def test_commands_accept_logs_of_one_triad_as_typed(session, tmp_path):
    target, reference = session.targets[0], session.reference
    forces, rates = log(tmp_path, target, "acc"), log(tmp_path, target, "gyro")
    whole = log(tmp_path, reference, "both")
    done = typed("turntable", whole, forces, rates, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert {path.name for path in (tmp_path / "out").glob("*.yaml")} == {
        f"{forces.stem}.yaml",
        f"{rates.stem}.yaml",
    }
    for page in (tmp_path / "out").glob("*.html"):
        assert "nan" not in page.read_text().lower().split()
    calibration = tmp_path / "out" / f"{forces.stem}.yaml"
    assert typed("apply", calibration, forces, "-o", tmp_path / "corrected.csv").code == 0
    assert inspect(open_recording(tmp_path / "corrected.csv")).metadata.triads == ("accelerometer",)
    refused = typed("apply", calibration, forces, "-o", tmp_path / "corrected.mcap")
    assert "holds both triads" in one_line(refused.err)
    assert "needs accelerometer and gyroscope" in one_line(typed("spin", forces).err)


def test_inspect_says_what_one_triad_cannot_show(session, tmp_path):
    shown = {}
    for kind in ("acc", "gyro"):
        done = typed("inspect", log(tmp_path, session.targets[0], kind))
        assert done.code == 0, done.err
        shown[kind] = done.text
    assert "gyroscope not recorded" in shown["acc"]
    assert "turntable, as target: yes, but the gyroscope stays unknown" in shown["acc"]
    assert "spin: no, it needs gyroscope readings" in shown["acc"]
    assert "gyroscope x" not in shown["acc"]
    assert "accelerometer not recorded" in shown["gyro"]
    assert "turntable, as reference: no, it needs accelerometer readings" in shown["gyro"]
    assert "direction" not in shown["gyro"]


def test_columns_are_not_asked_for_where_there_is_nothing_to_name(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,ax,ay,gx,gy,gz\n" + "0,1,2,3,4,5\n" * 9)
    line = refusal(path)
    assert "no column for az" in line
    assert "--columns" not in line
    path.write_text("time,ax,ay,up,gx,gy,gz\n" + "0,1,2,3,4,5,6\n" * 9)
    assert "--columns" in refusal(path)


def test_neither_triad_is_no_recording():
    with pytest.raises(ArrayError, match="neither accelerometer nor gyroscope"):
        Recording.from_arrays("nothing", np.arange(9.0), None, None)


def test_a_triad_of_another_name_beside_a_whole_imu_is_another_sensor(tmp_path):
    path = tmp_path / "log.csv"
    names = [*NAMES, "aux_ax", "aux_ay", "aux_az"]
    path.write_text(
        ",".join(names) + "\n" + "".join(f"{0.01 * k},0,0,9.8,0,0,0.01,1,1,1\n" for k in range(50))
    )
    assert open_recording(path).metadata.alone
    with pytest.raises(LogError, match="no column prefix 'aux'"):
        open_recording(f"{path}:aux")
