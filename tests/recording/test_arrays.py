"""Whatever a caller keeps his numbers in is taken, and what makes no sense is refused in one line."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import tumble
from tumble import Calibration, Recording, TumbleError

CALIBRATION = Calibration.model_validate(
    {
        "name": "unit",
        "accelerometer": {"M": [[2.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "b": [0.1, 0.0, 0.2]},
        "gyroscope": {"M": [[1.0, 0.0, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 0.5]], "b": [0.0, 0.3, 0.0]},
    }
)
RESPONSIVE = Calibration.model_validate(
    {"name": "unit", "gyroscope": {"M": np.eye(3), "b": np.zeros(3), "g_sensitivity": 0.1 * np.eye(3)}}
)
ROWS = [[0.0, 1.0, 9.5], [0.25, -0.5, 9.75], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]

WAYS = {
    "lists": lambda rows: rows.tolist(),
    "tuples": lambda rows: tuple(map(tuple, rows.tolist())),
    "float32": lambda rows: rows.astype(np.float32),
    "Fortran order": np.asfortranarray,
    "every second row of another": lambda rows: np.repeat(rows, 2, axis=0)[::2],
    "columns reversed twice": lambda rows: rows[:, ::-1].copy()[:, ::-1],
    "read only": lambda rows: np.frombuffer(rows.tobytes()).reshape(rows.shape),
    "objects": lambda rows: rows.astype(object),
    "a data frame": lambda rows: pd.DataFrame(rows, columns=list("xyz")),
    "a data frame that knows of missing values": lambda rows: pd.DataFrame(rows).convert_dtypes(),
    "a list of arrays": lambda rows: list(rows),
}


@pytest.mark.parametrize("way", WAYS)
@settings(max_examples=10)
@given(
    drawn=some.lists(some.tuples(*[some.floats(-100.0, 100.0, width=32)] * 3), min_size=2, max_size=6),
)
def test_readings_are_corrected_alike_however_they_are_kept(way, drawn):
    rows = np.array(drawn)
    force, rate = CALIBRATION.correct(WAYS[way](rows), WAYS[way](rows))
    by_hand = [
        np.linalg.solve(CALIBRATION.accelerometer.M, row - CALIBRATION.accelerometer.b) for row in rows
    ]
    np.testing.assert_allclose(force, by_hand, atol=1e-12)
    expected, expected_rate = CALIBRATION.correct(rows, rows)
    np.testing.assert_array_equal(force, expected)
    np.testing.assert_array_equal(rate, expected_rate)


def test_a_single_sample_comes_back_as_one():
    many, many_rates = CALIBRATION.correct(ROWS, ROWS)
    force, rate = CALIBRATION.correct(ROWS[1], tuple(ROWS[1]))
    assert force.shape == rate.shape == (3,)
    np.testing.assert_array_equal(force, many[1])
    np.testing.assert_array_equal(rate, many_rates[1])
    series, _ = CALIBRATION.correct(pd.Series(ROWS[1]), ROWS[1])
    np.testing.assert_array_equal(series, many[1])
    assert CALIBRATION.correct([ROWS[1]], [ROWS[1]])[0].shape == (1, 3)


def test_a_triad_that_was_not_measured_stays_away():
    force, nothing = CALIBRATION.correct(ROWS, None)
    assert nothing is None
    np.testing.assert_array_equal(force, CALIBRATION.correct(ROWS, ROWS)[0])
    nothing, rate = CALIBRATION.correct(None, ROWS)
    assert nothing is None
    np.testing.assert_array_equal(rate, CALIBRATION.correct(ROWS, ROWS)[1])


@pytest.mark.parametrize("force", [None, ROWS[:2]], ids=["none", "too few"])
def test_gyroscope_with_g_sensitivity_is_not_corrected_without_force(force):
    with pytest.raises(TumbleError, match="give a reading of the accelerometer for each of the gyroscope"):
        RESPONSIVE.correct(force, ROWS)


BAD = {
    "turned round": (np.zeros((3, 500)), r"accelerometer: has shape \(3, 500\); .*turn it round with .T"),
    "two axes": ([[1.0, 2.0]], r"has shape \(1, 2\); give \(n, 3\)"),
    "a number": (1.0, r"has shape \(\)"),
    "ragged": ([[1.0, 2.0, 3.0], [4.0]], "rows of different lengths"),
    "text": ([["1", "2", "3"]], "holds text, not numbers"),
    "text in a frame": (pd.DataFrame([["1", "2", "3"]]), "holds text, not numbers"),
    "complex": (np.zeros((2, 3), complex), "holds complex128, not numbers"),
    "bytes": (b"123", "not numbers"),
    "nested objects": (np.array([{}, {}, {}], dtype=object), "holds what is no number"),
}


@pytest.mark.parametrize("case", BAD)
def test_invalid_argument_is_refused_in_one_line_that_names_it(case):
    values, said = BAD[case]
    with pytest.raises(TumbleError, match=said) as refused:
        CALIBRATION.correct(values, ROWS)
    assert str(refused.value).startswith("accelerometer: ")
    assert "\n" not in str(refused.value)
    assert "contiguous" not in str(refused.value)


def test_a_masked_reading_is_no_reading():
    masked = np.ma.masked_array(ROWS, mask=np.eye(4, 3, dtype=bool))
    force, _ = CALIBRATION.correct(masked, None)
    assert np.isnan(force[:3]).any(axis=1).all()
    assert np.isfinite(force[3]).all()


@pytest.mark.parametrize("way", WAYS)
def test_a_recording_is_made_of_whatever_numbers_are_kept_in(way):
    rows = np.array(ROWS)
    made = Recording.from_arrays("unit", [0, 1, 2, 3], WAYS[way](rows), WAYS[way](rows), [20, 20, 21, 21])
    (chunk,) = made.chunks()
    for array, shape in ((chunk.time, (4,)), (chunk.accelerometer, (4, 3)), (chunk.temperature, (4,))):
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        assert array.shape == shape
    np.testing.assert_array_equal(chunk.gyroscope, rows)


NOON = datetime(2026, 1, 2, 12, tzinfo=timezone.utc)
DATES = {
    "numpy": np.datetime64("2026-01-02T12:00:00") + np.arange(4) * np.timedelta64(10, "ms"),
    "pandas": pd.Series(pd.date_range("2026-01-02 12:00", periods=4, freq="10ms")),
    "pandas elsewhere": pd.date_range("2026-01-02 13:00", periods=4, freq="10ms", tz="Europe/Zurich"),
    "standard library": [NOON + timedelta(milliseconds=10 * k) for k in range(4)],
    "without a zone": [(NOON + timedelta(milliseconds=10 * k)).replace(tzinfo=None) for k in range(4)],
}


@pytest.mark.parametrize("dates", DATES)
def test_dates_become_seconds_since_1970(dates):
    (chunk,) = Recording.from_arrays("unit", DATES[dates], ROWS, ROWS).chunks()
    np.testing.assert_allclose(chunk.time - NOON.timestamp(), [0.0, 0.01, 0.02, 0.03], atol=1e-6)


def test_arrays_of_different_lengths_are_refused_by_recording_name():
    with pytest.raises(TumbleError) as refused:
        Recording.from_arrays("unit", [0, 1, 2], ROWS, ROWS)
    assert str(refused.value) == (
        "unit: accelerometer: holds 4 samples, time 3; give one of each for every sample"
    )


def test_a_recording_of_ones_own_may_yield_what_is_no_array():
    simulated = tumble.simulate_spin(seed=7).recording
    (chunk,) = simulated.chunks()

    def pieces():
        yield tumble.Chunk(
            chunk.time.tolist(), np.asfortranarray(chunk.accelerometer), chunk.gyroscope.tolist()
        )

    own = Recording(simulated.metadata, pieces)
    np.testing.assert_array_equal(
        tumble.spin(own).accelerometer_bias.value, tumble.spin(simulated).accelerometer_bias.value
    )
