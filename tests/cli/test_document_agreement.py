"""A calibration of which the parts disagree is refused, by every command that takes one."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError
from turntable_sessions import typed
from workplaces import work_in


def angle(section):
    section["angles"]["mounting"][0] += 5.0


def skew(section):
    section["angles"]["non-orthogonality"]["yz"] += 0.01


def sigma_of_bias(section):
    section["sigma"]["bias"] = [0.01 * each for each in section["sigma"]["bias"]]


def sigma_of_mounting(section):
    section["sigma"]["mounting"][2] *= 2.0


def variance(section):
    section["covariance"][0][0] = -1.0


def asymmetry(section):
    section["covariance"][0][1] += 1e-3


def correlation(section):
    rows = section["covariance"]
    for one, other in ((1, 3), (2, 6), (5, 7)):
        rows[one][other] = rows[other][one] = -3.0 * (rows[one][one] * rows[other][other]) ** 0.5


def gap(section):
    section["covariance"][2][3] = None


EDITS = (angle, skew, sigma_of_bias, sigma_of_mounting, variance, asymmetry, correlation, gap)
"""Edits of one number or three of a section."""
NAMED = ("angles.mounting", "angles.non-orthogonality", "sigma.bias", "sigma.mounting", *["covariance"] * 4)


@pytest.fixture
def good(tmp_path, monkeypatch):
    """A calibration with all that can disagree, in a folder with what commands need besides."""
    work_in(tmp_path, monkeypatch)
    assert typed("simulate", "turntable", "-o", "table", "--seed", "1").code == 0
    assert typed(
        "turntable", "table/reference.csv", "table/target_1.csv", "-o", "found", "--operator", "Ann"
    ).code in (0, 3)
    [path] = [each for each in (tmp_path / "found").glob("*.yaml") if "target" in each.name]
    return path


def edited(path, edit):
    """The file after an edit of its accelerometer."""
    content = yaml.safe_load(path.read_text())
    edit(content["accelerometer"])
    other = path.with_name(f"{edit.__name__}.yaml")
    other.write_text(yaml.safe_dump(content, sort_keys=False))
    return other


def test_the_line_names_file_and_field(good):
    assert Calibration.load(good).accelerometer.sigma is not None
    for edit, name in zip(EDITS, NAMED, strict=True):
        path = edited(good, edit)
        with pytest.raises(CalibrationFileError, match=f"{path.name}: .*accelerometer {name}"):
            Calibration.load(path)


COMMANDS = (
    ("compare", "{}", "found/reference.yaml"),
    ("export", "{}", "--format", "ardupilot", "-o", "exported.param"),
    ("apply", "--force", "{}", "table/target_1.csv", "-o", "corrected.csv"),
    ("certificate", "{}", "--number", "X1", "--registry", "", "-o", "certificates"),
    ("registry", "add", "{}"),
)
"""Commands that take a calibration, which stands at `{}`."""


def test_no_command_takes_a_calibration_that_disagrees(good):
    (good.parent / "reference.yaml").write_bytes(good.read_bytes())
    for command in COMMANDS:
        done = typed(*(each.replace("{}", str(good)) for each in command))
        assert done.code in (0, 3), (command, done.err)
        for edit in EDITS:
            path = edited(good, edit)
            done = typed(*(each.replace("{}", str(path)) for each in command))
            assert done.code == 2, (command, edit.__name__, done.out)
            [line] = [each for each in done.err.splitlines() if each.startswith("tumble: error: ")]
            assert path.name in line, (command, line)
            path.unlink()


def test_a_covariance_with_unknown_rows_is_one(good):
    calibration = Calibration.load(good)
    content = calibration.content()
    rows = np.array(content["accelerometer"]["covariance"], dtype=object)
    rows[2, :] = rows[:, 2] = None
    content["accelerometer"]["covariance"] = rows.tolist()
    del content["accelerometer"]["sigma"]
    good.write_text(yaml.safe_dump(content, sort_keys=False))
    assert np.isnan(Calibration.load(good).accelerometer.covariance[2]).all()
