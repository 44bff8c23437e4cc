"""Results are collections, tables, and save what their commands write."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import tumble
from redundancy_sets import BIASED, PRIMARY, motion, record, write_table
from tumble import Calibration, TumbleError
from tumble.tools.simulate import write_spin, write_turntable
from turntable_sessions import calibrate, contents, simulate, typed


@pytest.fixture(scope="module")
def batch():
    return calibrate(simulate(21, grades=("consumer", "industrial")))


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spin")
    return write_spin(tumble.simulate_spin(seed=7), folder)["log"]


def test_a_batch_is_a_collection_of_its_targets(batch):
    assert len(batch) == 2
    assert [target.name for target in batch] == ["target_1", "target_2"]
    assert batch["target_2"] is batch[1] is batch[-1] is list(batch)[1]
    assert "target_1" in batch
    assert batch[0] in batch
    assert "reference" not in batch
    with pytest.raises(KeyError, match="target_3: is none of target_1, target_2"):
        batch["target_3"]
    with pytest.raises(IndexError):
        batch[2]


def test_the_frame_of_a_batch_holds_every_parameter_with_its_sigma(batch):
    frame = batch.to_pandas()
    assert len(frame) == 2 * 2 * 12
    for target in batch:
        for triad in (target.accelerometer, target.gyroscope):
            rows = frame[(frame.target == target.name) & (frame.sensor == triad.triad)]
            np.testing.assert_array_equal(rows.value, [each.value for each in triad.parameters])
            np.testing.assert_array_equal(rows.sigma, [each.sigma for each in triad.parameters])
    wide = frame.pivot(index="target", columns=["sensor", "parameter"], values="value")
    assert wide.loc["target_1", ("gyroscope", "bias x")] == batch["target_1"].gyroscope.b[0]
    pd.testing.assert_frame_equal(
        batch["target_2"].to_pandas(), frame[frame.target == "target_2"].reset_index(drop=True)
    )


def test_a_target_that_failed_is_in_the_frame_with_its_reason():
    session = simulate(21, grades=("consumer", "industrial"))
    still = session.units[2].recording
    chunk = next(iter(still.chunks()))
    dead = tumble.Recording.from_arrays(
        "dead", chunk.time, np.ones_like(chunk.accelerometer), chunk.gyroscope
    )
    frame = tumble.turntable(session.reference, [session.targets[0], dead]).to_pandas()
    (row,) = frame[frame.target == "dead"].to_dict("records")
    assert row["verdict"] == "not calibrated"
    assert row["reason"]
    assert not row["observable"]
    assert set(frame.target) == {"target_1", "dead"}


def test_a_spin_is_a_collection_of_its_spins_and_a_table(log):
    result = tumble.spin(log)
    assert len(result) == 1
    assert result["spin 1"] is result[0] is next(iter(result))
    frame = result.to_pandas()
    found = frame[(frame.spin == "all") & frame.parameter.str.startswith("gyroscope bias")]
    np.testing.assert_array_equal(found.value, result.gyroscope_bias.value)
    assert (found.unit == "rad/s").all()
    assert (found.high > found.low).all()
    assert len(frame[frame.spin == "spin 1"]) == len(result[0].parameters)


def test_a_saved_batch_is_what_the_command_writes(tmp_path):
    session = simulate(21, grades=("consumer", "industrial"))
    paths = write_turntable(session, tmp_path / "logs")
    logs = [str(paths[unit.name]) for unit in session.units]
    assert typed("turntable", *logs, "-o", tmp_path / "typed").code == 0
    files = tumble.turntable(logs[0], logs[1:]).save(tmp_path / "called")
    written, expected = contents(tmp_path / "called"), contents(tmp_path / "typed")
    assert sorted(path.name for path in files.values()) == sorted(
        name for name in written if name not in ("target_1.html", "target_2.html")
    )
    # The batch notes what a run would have to repeat, which only a run knows.
    assert written.pop("batch.jsonl").count(b"\n") == expected.pop("batch.jsonl").count(b"\n") == 2
    assert written == expected


def test_a_batch_saved_again_keeps_targets_of_before(tmp_path, batch):
    first, second = batch
    replace(batch, targets=(first,)).save(tmp_path)
    files = replace(batch, targets=(second,)).save(tmp_path)
    with files["summary"].open(newline="", encoding="utf-8") as file:
        assert [row["target"] for row in csv.DictReader(file)] == ["target_1", "target_2"]
    assert Calibration.load(tmp_path / "target_1.yaml").name == "target_1"


def test_a_saved_spin_is_what_the_command_writes(tmp_path, log):
    assert typed("spin", log, "-o", tmp_path / "typed").code == 0
    files = tumble.spin(log).save(tmp_path / "called")
    assert sorted(path.name for path in files.values()) == sorted(contents(tmp_path / "called"))
    assert contents(tmp_path / "called") == contents(tmp_path / "typed")


def test_spin_on_top_of_a_calibration_is_saved_without_renaming_it(tmp_path, log):
    before = Calibration.model_validate(
        {
            "name": "robot",
            "accelerometer": {"M": 1.001 * np.eye(3), "b": [0.01, 0.0, 0.0]},
            "gyroscope": {"M": np.eye(3), "b": np.zeros(3)},
        }
    )
    files = tumble.spin(log, calibration=before).save(tmp_path)
    saved = Calibration.load(files["calibration"])
    np.testing.assert_array_equal(saved.accelerometer.M, before.accelerometer.M)


def test_a_saved_alignment_is_what_the_command_writes(tmp_path):
    session = simulate(21, grades=("consumer",))
    paths = write_turntable(session, tmp_path / "logs")
    logs = [str(paths[unit.name]) for unit in session.units]
    typed("align", "--primary", logs[0], "--secondary", logs[1], "-o", tmp_path / "typed")
    result = tumble.align(logs[0], logs[1])
    assert result[0] is result["target_1"]
    frame = result.to_pandas()
    assert list(frame.value.dropna()) == [each.value for each in result[0].parameters if each.observable]
    result.save(tmp_path / "called")
    assert contents(tmp_path / "called") == contents(tmp_path / "typed")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A log of a primary and a secondary whose errors are found."""
    return write_table(
        tmp_path_factory.mktemp("flown") / "flight.csv", record([PRIMARY, BIASED], 11, motion())
    )


QUICK = {"collect": 20.0, "collect_timeout": 60.0, "evaluate_every": 5.0}


def test_a_replay_is_a_collection_of_stored_errors_and_a_table(flown):
    result = tumble.redundancy("imu1", "imu2", log=flown, settings=QUICK)
    assert [error.name for error in result] == ["imu2 accelerometer", "imu2 gyroscope"]
    assert result["imu2 gyroscope"] is result[1]
    frame = result.to_pandas()
    biases = frame[(frame.sensor == "gyroscope") & frame.parameter.str.startswith("bias")]
    np.testing.assert_array_equal(biases.value, result["imu2 gyroscope"].bias)
    assert frame[~frame.observable].reason.all()


def test_a_saved_replay_is_what_the_command_writes(flown, tmp_path):
    sets = [word for name, value in QUICK.items() for word in ("--set", f"{name}={value:g}")]
    units = ("--primary", "imu1", "--secondary", "imu2")
    typed("redundancy", flown, *units, *sets, "-o", tmp_path / "typed")
    files = tumble.redundancy("imu1", "imu2", log=flown, settings=QUICK).save(tmp_path / "called")
    written, expected = contents(tmp_path / "called"), contents(tmp_path / "typed")
    assert set(files) == {"events", "imu2", "report", "store"}
    assert written == expected


def test_an_inspection_is_a_table_of_channels(log):
    frame = tumble.inspect(log).to_pandas()
    assert list(frame.name) == [
        f"{triad} {axis}" for triad in ("accelerometer", "gyroscope") for axis in "xyz"
    ]
    assert (frame.low <= frame["mean"]).all()


def test_without_pandas_one_line_says_what_to_install(batch, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(TumbleError, match="needs pandas, which is not installed; run pip install pandas"):
        batch.to_pandas()
    assert len(list(batch.rows())) == 2 * 2 * 12


def test_without_xarray_one_line_says_what_to_install(batch, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(TumbleError, match="needs xarray, which is not installed; run pip install xarray"):
        batch.to_xarray()


def test_a_data_set_has_a_dimension_for_each_key_of_a_parameter(batch):
    dataset = batch.to_xarray()
    assert dict(dataset.sizes) == {"target": 2, "sensor": 2, "parameter": 12}
    place = {"target": "target_2", "sensor": "gyroscope", "parameter": "bias y"}
    assert dataset.value.sel(place).item() == batch["target_2"].gyroscope.b[1]


def test_a_table_without_values_has_one_dimension_in_a_data_set(log):
    assert dict(tumble.inspect(log).to_xarray().sizes) == {"row": 6}


def test_estimates_are_the_arrays_of_the_parameters(batch):
    triad = batch["target_1"].gyroscope
    value, sigma = triad.estimates("bias")
    np.testing.assert_array_equal(value, triad.b)
    np.testing.assert_array_equal(sigma, [each.sigma for each in triad.parameters[:3]])
    assert type(value) is type(sigma) is np.ndarray
    with pytest.raises(KeyError, match="lever arm: is none of bias, scale, non-orthogonality, mounting"):
        triad.estimates("lever arm")


def test_hidden_estimates_are_nan_with_infinite_sigma(log):
    spin = tumble.spin(log)[0]
    hidden = replace(spin, parameters=tuple(replace(each, observable=False) for each in spin.parameters))
    value, sigma = hidden.estimates("accelerometer bias")
    assert np.isnan(value).all()
    assert np.isinf(sigma).all()


def test_a_batch_of_one_target_has_a_calibration(batch):
    assert (
        batch.calibrations["target_2"]
        == batch.calibration_of(batch["target_2"])
        == batch.calibration_of("target_2")
    )
    with pytest.raises(TumbleError, match="calibrations of 2 units; take them by name from calibrations"):
        assert batch.calibration
    alone = replace(batch, targets=batch.targets[1:])
    assert alone.calibration == batch.calibrations["target_2"]


def test_a_redundant_set_has_calibrations_by_name(flown):
    result = tumble.redundancy("imu1", "imu2", log=flown, settings=QUICK)
    assert result.calibration == result.calibrations["imu2"] == result.calibration_of("imu2")


def test_every_table_shows_itself_in_a_notebook(batch, log):
    for table in (batch, batch[0], tumble.spin(log), tumble.spin(log)[0], tumble.inspect(log)):
        assert "<table>" in table._repr_html_()
    assert "<b>spin</b>" in tumble.open_recording(log)._repr_html_()


def test_packages_list_the_names_they_give_and_no_more():
    for package in (tumble, tumble.logs, tumble.live):
        assert set(dir(package)) == set(package.__all__)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: tumble.noise(3), "int is neither a path nor a table with named columns"),
        (lambda: tumble.turntable("a.csv", None), "NoneType is neither a path nor a table"),
        (lambda: tumble.compare("a.yaml"), "is one source; give a list of two calibrations or more"),
        (lambda: Calibration.load(3), "3: is no path but int; give the path of a calibration"),
    ],
)
def test_arguments_of_another_type_are_refused_in_words(call, words, tmp_path, monkeypatch, log):
    (tmp_path / "a.csv").write_bytes(log.read_bytes())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TumbleError, match=words):
        call()


def test_gravity_that_is_no_number_is_refused_in_words(log):
    with pytest.raises(TumbleError, match="gravity: 'high' is no number but str"):
        tumble.spin(log, gravity="high")
