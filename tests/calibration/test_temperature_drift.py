"""Temperature drift of bias and scale, as a calibration file stores it."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from tests.support.calibration_files import VERSION_1, VERSION_2, load

from tumble.calibration.document import Calibration
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation.errors import CalibrationFileError

COEFFICIENT = st.floats(-1e-4, 1e-4) | st.sampled_from([5e-324, 1e-310])
POWERS = st.lists(st.tuples(COEFFICIENT, COEFFICIENT, COEFFICIENT), max_size=3)


def test_version_1_file_reads_and_saves_unchanged(tmp_path):
    read = load(tmp_path, VERSION_1)
    assert read.hash() == "82f9efb27308825200330e1063c847e301ebdc52d274885f2a0406945c329211"
    assert "schema: tumble-calibration/1\n" in read.text()


def test_a_drift_survives_the_file_and_what_was_not_seen_is_null(tmp_path):
    read = load(tmp_path, VERSION_2)
    drift = read.accelerometer.temperature_drift
    assert np.array(drift.bias).tolist() == [[1e-3, 0.0, -2e-3], [0.0, 1e-5, 0.0]]
    assert np.isnan(drift.bias_sigma[1][2])
    assert np.isnan(drift.hysteresis[1])
    assert load(tmp_path, read.text()) == read
    assert yaml.safe_load(read.text())["accelerometer"]["temperature_drift"]["hysteresis"] == [
        1e-3,
        None,
        2e-3,
    ]


def test_representation_states_the_drift_and_its_source(tmp_path):
    contributions = [{"gave": ["accelerometer temperature drift"], "method": {"procedure": "thermal"}}]
    content = load(tmp_path, VERSION_2).content() | {"contributions": contributions}
    shown = repr(Calibration.model_validate(content))
    assert "m/s^2 at 25 degC, drift known from -20 to 70 degC" in shown
    assert "accelerometer temperature drift by thermal" in shown


@pytest.mark.parametrize(
    ("old", "new", "refusal"),
    [
        (
            "calibration/2",
            "calibration/1",
            "is none of the keys of tumble-calibration/1; say schema: ",
        ),
        ("[-20.0, 70.0]", "[70.0, -20.0]", "range needs to be [lowest, highest] degC, found [70, -20]"),
        ("[-20.0, 70.0]", "[-300.0, 70.0]", "range needs to be [lowest, highest] degC, found [-300, 70]"),
        ("reference: 25.0", "reference: 90.0", "reference 90 degC is not within range [-20, 70]"),
        ("[1.0e-5, -2.0e-5, 0.0]", "[1.0e-5, -2.3e-2, 0.0]", "scale falls to -0.035 of itself within range"),
        ("[0.0, 1.0e-5, 0.0]", "[0.0, 1.0e+5, 0.0]", "temperature_drift.bias adds up to 2.02e+08 m/s^2"),
        ("[0.0, 1.0e-5, 0.0]", "[0.0, .nan, 0.0]", "temperature_drift.bias.1 needs 3 numbers"),
        ("    - [1.0e-6, 1.0e-6, null]\n", "", "bias_sigma needs as many rows as bias, 2"),
        ("    - [0.0, 1.0e-5, 0.0]\n", "    - [0.0, 1.0e-5, 0.0]\n" * 3, "at most 3 items"),
    ],
)
def test_a_drift_that_no_sensor_has_is_refused_by_line_and_key(tmp_path, old, new, refusal):
    assert old in VERSION_2
    with pytest.raises(CalibrationFileError, match=re.escape(refusal)) as refused:
        load(tmp_path, VERSION_2.replace(old, new, 1))
    assert "\n" not in str(refused.value)


@given(bias=POWERS, reference=st.floats(-20.0, 70.0))
def test_bias_change_over_the_range_never_exceeds_the_reported_one(bias, reference):
    drift = TemperatureDrift.model_validate({"reference": reference, "range": [-20.0, 70.0], "bias": bias})
    t = np.linspace(-20.0, 70.0, 500) - reference
    change = sum((np.outer(t ** (k + 1), row) for k, row in enumerate(bias)), np.zeros((500, 3)))
    assert np.abs(change).max() <= drift.largest_bias * (1.0 + 1e-9) + 1e-300
