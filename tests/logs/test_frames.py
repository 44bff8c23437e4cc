"""Recordings become tables of pandas and xarray and are read from them, with units by name."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tumble


@pytest.fixture(scope="module")
def recording():
    return tumble.simulate_multipose(seed=7).recording


def samples_of(recording):
    chunks = list(recording.chunks())
    return tuple(
        np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    )


@pytest.mark.parametrize("form", ["to_pandas", "to_xarray"])
def test_a_recording_comes_back_from_a_table(recording, form):
    read = tumble.open_recording(getattr(recording, form)())
    for found, expected in zip(samples_of(read), samples_of(recording), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert not read.metadata.accelerometer_unit.is_assumed
    assert not read.metadata.time_unit.is_assumed


def test_units_beside_the_variables_of_a_data_set_are_applied(recording):
    table = recording.to_xarray()
    table["gyroscope"] = table.gyroscope.copy(data=np.degrees(table.gyroscope.values))
    table.gyroscope.attrs["units"] = "deg/s"
    _, _, rate = samples_of(tumble.open_recording(table))
    np.testing.assert_allclose(rate, samples_of(recording)[2], rtol=1e-12)


def test_units_beside_the_columns_of_a_frame_are_applied(recording):
    frame = recording.to_pandas()
    frame[["ax", "ay", "az"]] /= 9.80665
    frame.attrs["units"] |= dict.fromkeys(["ax", "ay", "az"], "g")
    _, force, _ = samples_of(tumble.open_recording(frame))
    np.testing.assert_allclose(force, samples_of(recording)[1], rtol=1e-12)


def test_axes_may_be_variables_of_their_own_in_a_data_set(recording):
    table = recording.to_xarray()
    split = table.drop_vars(["accelerometer", "axis"]).assign(
        {f"accel_{axis}": table.accelerometer.sel(axis=axis).drop_vars("axis") for axis in "xyz"}
    )
    for found, expected in zip(samples_of(tumble.open_recording(split)), samples_of(recording), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_a_recording_of_one_triad_has_no_columns_of_the_other(recording):
    time, force, _ = samples_of(recording)
    alone = tumble.Recording.from_arrays("unit", time, force, None)
    assert list(alone.to_pandas().columns) == ["ax", "ay", "az"]
    assert set(alone.to_xarray().data_vars) == {"accelerometer"}
    pd.testing.assert_index_equal(alone.to_pandas().index, pd.Index(time, name="time"))
