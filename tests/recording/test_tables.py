"""A table in memory is read as a file is, by the names of its columns, whichever library it is of."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import tumble
from tumble import ReadOptions, TumbleError
from turntable_sessions import simulate


def frame_of(recording, **units):
    """A data frame of a recording, as a logger of others would write it."""
    chunk = next(iter(recording.chunks()))
    columns = {"time": chunk.time}
    for triad, name in ((chunk.accelerometer, "acc"), (chunk.gyroscope, "gyro")):
        for axis, values in zip("xyz", triad.T, strict=True):
            unit, factor = units.get(name, ("", 1.0))
            columns[f"{name}_{axis}{unit}"] = factor * values
    return pd.DataFrame(columns)


SPUN = tumble.simulate_spin(seed=7).recording
FRAME = frame_of(SPUN)
DATED = FRAME.assign(time=pd.to_datetime(FRAME.time, unit="s"))
KINDS = {
    "data frame": FRAME,
    "time in the index": FRAME.set_index("time"),
    "dates": DATED,
    "dates of some zone in the index": DATED.assign(time=DATED.time.dt.tz_localize("UTC")).set_index("time"),
    "time in an index without a name": FRAME.drop(columns="time").set_index(pd.Index(FRAME.time.to_numpy())),
    "columns of two levels": FRAME.set_axis(
        pd.MultiIndex.from_tuples([("time", ""), *(tuple(name.split("_")) for name in FRAME.columns[1:])]),
        axis=1,
    ),
    "mapping of lists": {name: list(values) for name, values in FRAME.items()},
    "table of pyarrow": pa.table(FRAME),
    "structured array": FRAME.to_records(index=False),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_spin_from_a_table_is_that_from_its_recording(kind):
    expected = tumble.spin(SPUN)
    found = tumble.spin(KINDS[kind])
    np.testing.assert_allclose(
        found.accelerometer_bias.value, expected.accelerometer_bias.value, rtol=0.0, atol=1e-9
    )
    assert found.name == "table"


def test_the_unit_in_the_name_of_a_column_holds():
    frame = frame_of(SPUN, acc=("_g", 1.0 / 9.80665), gyro=("_dps", np.degrees(1.0)))
    found = tumble.spin(frame)
    np.testing.assert_allclose(
        found.accelerometer_bias.value, tumble.spin(SPUN).accelerometer_bias.value, atol=1e-8
    )


def test_own_names_are_stated_as_for_a_file():
    frame = FRAME.rename(columns={"acc_x": "sideways"})
    with pytest.raises(TumbleError, match="table: no column for ax; columns found: time, sideways"):
        tumble.spin(frame)
    tumble.spin(frame, read=ReadOptions(columns={"ax": "sideways"}))


def test_the_callers_table_stays_as_it_was():
    frame = frame_of(SPUN, acc=("_g", 1.0 / 9.80665))
    before = frame.copy()
    tumble.spin(frame, read=ReadOptions(axes="x,y,-z", accelerometer_sign=-1, gyroscope_zero=(0.1, 0.2, 0.3)))
    pd.testing.assert_frame_equal(frame, before)


def test_one_of_several_imus_is_picked_by_its_prefix():
    both = FRAME.rename(columns=lambda name: name if name == "time" else f"imu1_{name}")
    both = both.join(FRAME.drop(columns="time").rename(columns=lambda name: f"imu2_{name}"))
    with pytest.raises(TumbleError, match=r"holds 2 IMUs; name one with ReadOptions\(topic=...\)"):
        tumble.spin(both)
    with pytest.raises(TumbleError, match="holds no IMU 'imu3'"):
        tumble.spin(both, read=ReadOptions(topic="imu3"))
    assert tumble.spin(both, read=ReadOptions(topic="imu2")).name == "table-imu2"


def test_every_procedure_takes_tables_and_paths_and_a_single_target(tmp_path):
    session = simulate(11)
    reference, target = (frame_of(unit.recording) for unit in session.units[:2])
    from_frames = tumble.turntable(reference, target)
    expected = tumble.turntable(session.reference, [session.targets[0]])
    np.testing.assert_allclose(
        from_frames.targets[0].accelerometer.b, expected.targets[0].accelerometer.b, atol=1e-9
    )
    path = tmp_path / "target.csv"
    target.to_csv(path, index=False)
    assert tumble.inspect(path).rests
    assert (
        len(tumble.inspect(path).rests)
        == len(tumble.inspect(str(path)).rests)
        == len(expected["target_1"].rests)
    )
    assert len(tumble.inspect(target).rests) == len(tumble.inspect(path).rests)
    aligned = tumble.align(reference, [target])
    assert len(aligned.units) == 1
    calibration = expected.calibration_of(expected.targets[0])
    calibration.save(tmp_path / "target.yaml")
    applied = tumble.apply(tmp_path / "target.yaml", target, tmp_path / "corrected.csv")
    assert applied.samples == len(target)


def test_names_tell_tables_of_one_batch_apart():
    session = simulate(11, grades=("consumer", "industrial"))
    frames = [frame_of(unit.recording) for unit in session.units]
    result = tumble.turntable(frames[0], frames[1:])
    assert [target.name for target in result.targets] == ["table-1", "table-2"]
    named = [
        tumble.open_recording(frame, name=f"unit_{k}", keep_faults=True) for k, frame in enumerate(frames)
    ]
    assert [target.name for target in tumble.turntable(named[0], named[1:]).targets] == ["unit_1", "unit_2"]


@pytest.mark.parametrize(
    "source", [np.zeros((5, 7)), 3, None, [1, 2]], ids=["array", "number", "none", "list"]
)
def test_invalid_source_is_refused_in_one_line(source):
    with pytest.raises(TumbleError, match="neither a path nor a table with named columns"):
        tumble.spin(source)


def test_a_column_of_text_is_refused_by_its_name():
    with pytest.raises(TumbleError, match="table: gyro_y: holds text, not numbers"):
        tumble.spin(FRAME.assign(gyro_y="a"))


def test_an_empty_table_is_refused():
    with pytest.raises(TumbleError, match="table: names columns, but holds no samples"):
        tumble.spin(FRAME[:0])


@pytest.mark.parametrize("option", ["truth", "clock"])
def test_a_word_that_no_option_knows_is_refused_with_those_it_knows(option):
    session = simulate(11)
    with pytest.raises(TumbleError, match=f"{option} 'sideways': give one of "):
        tumble.turntable(session.reference, session.targets, **{option: "sideways"})


def test_nothing_of_tumble_imports_pandas():
    code = (
        "import sys, tumble; tumble.spin(tumble.simulate_spin(seed=7).recording);"
        "sys.exit('pandas' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
