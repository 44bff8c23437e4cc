"""Output that the platform would have used, and the settings of the literature, as they are typed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyarrow.csv as pc
import pyarrow.parquet as pq
import pytest

import tumble
from redundancy_sets import BIASED, PRIMARY, QUICK, SOUND, motion, of, record, replay, typed, units
from tumble.calibration.document import Calibration
from turntable_sessions import one_line

MOVED = motion()
TILTED = (0.0, 0.0, 0.04)
"""Bias of the primary's accelerometer that its own calibration takes off, m/s^2."""


@pytest.fixture(scope="module")
def failing(tmp_path_factory):
    """Words for a set whose primary, with a calibration of its own, is silent from 36 s on."""
    folder = tmp_path_factory.mktemp("failing")
    said = record([replace(PRIMARY, accelerometer_bias=TILTED), BIASED, SOUND], 14, MOVED)
    said["imu1"].readings[said["imu1"].time > 36.0] = np.nan
    paths = [said[name].write(folder / f"{name}.csv") for name in said]
    accelerometer = {"M": np.eye(3), "b": np.array(TILTED)}
    own = Calibration.model_validate({"name": "imu1", "accelerometer": accelerometer})
    own.save(folder / "own.yaml")
    return (*units(paths), *QUICK, "--calibration", folder / "own.yaml")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_output_stays_compensated_before_and_after_a_failover(failing, tmp_path, ending):
    log = tmp_path / f"output.{ending}"
    result, _ = replay(*failing, "--output-log", log, "-o", tmp_path / "out", code=None)
    assert result["files"]["output"] == str(log)
    table = pc.read_csv(log) if ending == "csv" else pq.read_table(log)
    assert table.column_names == ["time", "ax", "ay", "az", "gx", "gy", "gz", "source", "flags"]
    time, source = table["time"].to_numpy(), np.array(table["source"].to_pylist())
    assert list(dict.fromkeys(source)) == [span["unit"] for span in result["selected"]]
    force = np.column_stack([table[name].to_numpy() for name in ("ax", "ay", "az")])
    for at_rest in ((time < 4.0) & (source == "imu1"), (time > 38.0) & (source != "imu1")):
        assert at_rest.sum() > 50
        np.testing.assert_allclose(force[at_rest].mean(axis=0), [0.0, 0.0, 9.80665], atol=0.03)
    assert not table["flags"].to_numpy().any()


def test_the_output_from_python_is_that_of_the_file(failing, tmp_path):
    words = [str(word) for word in failing]
    paths = [words[i + 1] for i, word in enumerate(words) if word in ("--primary", "--secondary")]
    result = tumble.redundancy(paths[0], paths[1:], calibration=words[-1])
    assert result.output.units == ("imu1", "imu2", "imu3")
    written = pq.read_table(result.output.save(tmp_path / "output.parquet"))
    np.testing.assert_array_equal(written["az"].to_numpy(), result.output.specific_force[:, 2])
    assert len(result.output) == written.num_rows > 3000
    assert tumble.redundancy(paths[0], paths[1:], keep_output=False).output is None


def test_output_that_a_format_cannot_hold_is_refused_before_replay(failing, tmp_path):
    done = typed("redundancy", *failing, "--output-log", "output.mcap", "-o", tmp_path / "out")
    assert done.code == 2
    assert "output.mcap: the output of a set is written as .csv or .parquet" in one_line(done.err)


def test_published_option_presets_the_settings_of_the_literature(failing, tmp_path):
    result, events = replay(*failing, "--as-published", "-o", tmp_path / "out", code=None)
    settings = result["settings"]
    assert (settings["largest_fit_model"], settings["adoption"]) == ("offset", "always")
    assert (settings["vector_check"], settings["fit_rests"]) == (False, False)
    assert result["preset"] == "as published"
    assert {event["figures"]["check"] for event in of(events, "imu2", "evaluated")} == {"norm"}
    assert {error["fit_model"] for error in result["errors"]} == {"offset"}
    page = (tmp_path / "out" / "redundancy.html").read_text(encoding="utf-8")
    assert "as published" in page
    changed, _ = replay(
        *failing, "--as-published", "--set", "largest_fit_model=gain", "-o", tmp_path / "b", code=None
    )
    assert changed["settings"]["largest_fit_model"] == "gain"
