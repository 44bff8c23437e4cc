"""Settings: those of Python are those of the core, and what makes no sense is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from redundancy_sets import FACING_DOWN, typed
from tumble import _core
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.procedures.redundancy.monitor import settings_from
from tumble.procedures.redundancy.settings import RedundancySettings
from turntable_sessions import one_line

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads((ROOT / "docs" / "schema" / "redundancy.schema.json").read_text(encoding="utf-8"))


def changed(*changes):
    return RedundancySettings().changed(changes)


def written(folder, text, name="settings.yaml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def contradiction(**changes):
    """Error of the core, in the words of `tumble.redundancy`."""
    settings = settings_from(changes)
    units = [_core.RedundancyUnit(1), _core.RedundancyUnit(2)]
    with pytest.raises(_core.CoreError) as caught:
        _core.RedundancyMonitor(units, settings.by_name())
    kind, figures = caught.value.args
    assert kind == "contradictory settings"
    from tumble.procedures.redundancy.messages import explain

    return explain(figures, settings.by_name())


def test_the_core_takes_its_defaults_in_either_precision():
    units = [_core.RedundancyUnit(1), _core.RedundancyUnit(2)]
    for precision in ("f32", "f64"):
        _core.RedundancyMonitor(units, RedundancySettings().by_name(), precision)


@pytest.mark.parametrize(
    "row",
    [row for row in _core.setting_table("redundancy") if row["more_than"]],
    ids=lambda row: row["name"],
)
def test_setting_below_its_lower_setting_is_refused_with_both_names(row):
    other = getattr(RedundancySettings(), row["more_than"])
    line = contradiction(**{row["name"]: other})
    assert f"{row['name']} is {other}" in line
    assert f"{row['more_than']} is {other}" in line


@pytest.mark.parametrize(
    ("typed_as", "means"),
    [
        ("0.2", "0.2"),
        ("last+0.1", "last+0.1"),
        ("last * 1.5", "last*1.5"),
        ("last+ 1e-3", "last+1e-3"),
        ("factory +0.1", "factory+0.1"),
    ],
)
def test_a_threshold_is_a_number_or_refers_to_the_last_error(typed_as, means):
    assert changed(f"secondary_accelerometer_threshold={typed_as}").secondary_accelerometer_threshold == means


@given(st.floats(1e-6, 2.9), st.sampled_from(["", "factory+", "last+", "last*"]))
def test_every_threshold_that_is_taken_is_one_the_core_takes(number, how):
    """Beyond a slow offset of 0.1 m/s^2 and drift within specification, units would dispute for ever."""
    units = [_core.RedundancyUnit(1), _core.RedundancyUnit(2)]
    if how == "last*":
        number += 1.0
    enough = max(0.05, number - 0.09) if how != "last*" else 0.05
    threshold = f"secondary_accelerometer_threshold={how}{number!r}"
    settings = changed(threshold, f"tolerated_specific_force={enough!r}")
    _core.RedundancyMonitor(units, settings.by_name())
    if how != "last*" and number > 0.151:
        with pytest.raises(_core.CoreError, match="tolerated_specific_force"):
            _core.RedundancyMonitor(units, changed(threshold).by_name())


@pytest.mark.parametrize(
    "text", ["0", "-0.1", "last*1", "last-0.1", "first+0.1", "factory*2", "true", "[1]", "nan"]
)
def test_a_threshold_that_everything_or_nothing_exceeds_is_refused(text):
    with pytest.raises(ProcedureError, match="secondary_accelerometer_threshold"):
        changed(f"secondary_accelerometer_threshold={text}")


@pytest.mark.parametrize("text", ["1e-3", "1.0e-3", "1.e-3", "0.001", "+1E-3", "0.1e-2"])
def test_a_number_may_be_written_in_any_way(text):
    assert changed(f"units.imu2.time_offset={text}").units["imu2"].time_offset == 0.001


def test_none_is_never_and_comes_back_as_none():
    settings = changed("evaluate_every=none", "return_after=30", "window=0.1")
    assert settings.evaluate_every is None
    assert settings.return_after == 30.0
    assert RedundancySettings().and_then(settings).evaluate_every is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("secondary_gyroscop_threshold=1", "not a known key, did you mean 'secondary_gyroscope_threshold'?"),
        ("first_threshold=1", "first_threshold is called rest_specific_force_scatter now"),
        ("family_specific_force=1", "family_specific_force is called tolerated_specific_force now"),
        ("family_angular_rate=0.1", "family_angular_rate is called tolerated_angular_rate now"),
        ("sixth_threshold=1", "sixth_threshold is called primary_gyroscope_threshold now"),
        ("gate=whole", "'secondary alone', 'whole primary' or 'sensor by sensor'"),
        ("window=-1", "window needs to be greater than 0"),
        ("fewest_pairs=2.5", "fewest_pairs needs to be a valid integer"),
        ("hold=.inf", "hold needs to be a finite number"),
        ("collect=[", "its value is not YAML"),
        ("collect", "give NAME=VALUE"),
        ("units.imu2=4", "or units.UNIT.NAME=VALUE"),
        ("units.imu2.lever_arm=[1,2]", "units.imu2.lever_arm needs 3 numbers"),
        ("units.imu2.axes=[ax,ab]", "found 'ab'"),
        ("units.imu2.sensor_from_primary=[90,0,0]", "looks like degrees"),
        ("units.imu2.sensor_from_primary=[[1,0,0],[0,1,0],[0,0,-1]]", "right-handed"),
        ("units.imu2.sensor_from_primary=[[1,0,0],[0,1,0],[0,0,2]]", "is no rotation"),
        ("units.imu2.sensor_from_primary=[nan,0,0]", "rotation vector of 3 numbers"),
        ("units.imu2.identity=-1", "identity needs to be greater than or equal to 0"),
    ],
)
def test_a_change_that_makes_no_sense_is_refused_by_name(change, says):
    with pytest.raises(ProcedureError) as caught:
        changed(change)
    line = str(caught.value)
    assert line.startswith(f"--set {change}: ")
    assert says in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("changes", "names", "says"),
    [
        ({"collect_timeout": 20.0}, ("collect_timeout is 20", "collect is 30"), "longer"),
        ({"evaluate_every": 1.0}, ("evaluate_every is 1", "rest_duration is 2"), "longer"),
        (
            {"motion_specific_force": 0.05},
            ("motion_specific_force is 0.05", "rest_specific_force_scatter is 0.1"),
            "larger",
        ),
        (
            {"motion_angular_rate": 0.01},
            ("motion_angular_rate is 0.01", "rest_angular_rate_scatter is 0.02"),
            "larger",
        ),
        ({"fewest_pairs": 5000}, ("fewest_pairs is 5000", "collect is 30"), "do not fit"),
        (
            {"primary_accelerometer_threshold": "last*2"},
            ("primary_accelerometer_threshold is last*2", "data is compensated"),
            "no last error",
        ),
        ({"window": 0.03}, ("window is 0.03",), "a whole number of windows"),
    ],
)
def test_contradictory_settings_are_refused_with_both_names(changes, names, says):
    line = contradiction(**changes)
    assert all(name in line for name in names), line
    assert says in line
    assert "\n" not in line


def test_settings_come_from_a_file_and_what_is_typed_goes_before_it(tmp_path):
    path = written(tmp_path, "schema: tumble-redundancy/1\ncollect: 30\nhold: 0.1\nevaluate_every: none\n")
    settings = RedundancySettings.load(path).changed(["hold=0.2"])
    assert (settings.collect, settings.hold, settings.evaluate_every) == (30.0, 0.2, None)


def test_a_later_file_goes_before_an_earlier_one_unit_by_unit(tmp_path):
    first = written(tmp_path, "collect: 30\nunits: {a: {time_offset: 1.0, axes: [ax]}, b: {identity: 5}}\n")
    second = written(tmp_path, "units: {a: {time_offset: 2.0}}\n", "second.yaml")
    joined = RedundancySettings.load(first).and_then(RedundancySettings.load(second))
    assert joined.collect == 30.0
    assert (joined.units["a"].time_offset, joined.units["a"].axes) == (2.0, ("ax",))
    assert joined.units["b"].identity == 5


def test_error_in_a_file_is_reported_with_line_and_closest_key(tmp_path):
    path = written(tmp_path, "collect: 30\ngaet: whole primary\n")
    with pytest.raises(CalibrationFileError) as caught:
        RedundancySettings.load(path)
    assert str(caught.value).startswith(f"{path}: line 2: gaet is not a known key, did you mean 'gate'?")


def test_error_within_a_unit_is_reported_with_its_line(tmp_path):
    path = written(tmp_path, "units:\n  imu2:\n    lever_arms: [0, 0, 1]\n")
    with pytest.raises(CalibrationFileError, match=r"line 3: units.imu2.lever_arms is not .* 'lever_arm'"):
        RedundancySettings.load(path)


def test_a_settings_file_cannot_run_anything(tmp_path):
    path = written(tmp_path, "collect: !!python/object/apply:os.getcwd []\n")
    with pytest.raises(CalibrationFileError, match="line 1"):
        RedundancySettings.load(path)


def test_a_rotation_is_a_matrix_a_vector_or_that_of_an_alignment(tmp_path):
    turned = yaml.safe_dump({"units": {"imu2": {"sensor_from_primary": FACING_DOWN.tolist()}}})
    written(tmp_path, turned, "align.yaml")
    path = written(tmp_path, "units: {imu2: {sensor_from_primary: align.yaml}}\n")
    axis = (np.pi / np.sqrt(2.0) * np.array([1.0, -1.0, 0.0])).tolist()
    for settings in (
        RedundancySettings.load(path),
        changed(f"units.imu2.sensor_from_primary={tmp_path / 'align.yaml'}"),
        changed(f"units.imu2.sensor_from_primary={axis}"),
    ):
        np.testing.assert_allclose(settings.units["imu2"].sensor_from_primary, FACING_DOWN, atol=1e-12)


def test_an_alignment_of_other_units_or_no_file_at_all_is_refused(tmp_path):
    path = written(tmp_path, "units: {imu3: {sensor_from_primary: [0, 0, 1]}}\n", "align.yaml")
    with pytest.raises(CalibrationFileError, match="does not hold the rotation of imu2; it knows imu3"):
        changed(f"units.imu2.sensor_from_primary={path}")
    with pytest.raises(CalibrationFileError, match="no such redundancy settings file"):
        changed(f"units.imu2.sensor_from_primary={tmp_path / 'gone.yaml'}")


@pytest.mark.parametrize(
    ("content", "valid"),
    [
        (
            {
                "secondary_accelerometer_threshold": 0.1,
                "secondary_gyroscope_threshold": "last*1.5",
                "evaluate_every": "none",
            },
            True,
        ),
        ({"units": {"a": {"sensor_from_primary": [0, 0, 1], "axes": ["gz"], "lever_arm": [0, 0, 1]}}}, True),
        ({"secondary_accelerometer_threshold": "first+1"}, False),
        ({"gate": "open"}, False),
        ({"units": {"a": {"arm": 1}}}, False),
    ],
)
def test_the_published_schema_takes_what_the_reader_takes(content, valid):
    assert Draft202012Validator(SCHEMA).is_valid(content) == valid
    if valid:
        settings_from(content)
    else:
        with pytest.raises(ProcedureError, match="settings: "):
            settings_from(content)


def test_explain_prints_every_setting_for_people_and_for_machines():
    for_people, for_machines = typed("redundancy", "--explain"), typed("redundancy", "--explain", "--json")
    listed = json.loads(for_machines.out)["settings"]
    assert [each["name"] for each in listed] == list(RedundancySettings().by_name())
    for each in listed:
        assert each["name"] in for_people.out
        assert set(each) == {"name", "group", "meaning", "unit", "choices", "default"}
    assert "last+0.1" not in for_people.err


def test_without_a_secondary_the_command_says_what_is_missing():
    done = typed("redundancy", "flight.csv", "--primary", "imu1")
    assert done.code == 2
    assert one_line(done.err).startswith("--secondary is missing")


def test_a_unit_may_have_thresholds_of_its_own():
    unit = changed("units.imu2.accelerometer_threshold=factory+0.2").units["imu2"]
    assert (unit.accelerometer_threshold, unit.gyroscope_threshold) == ("factory+0.2", None)
    _core.RedundancyUnit(1, accelerometer_threshold=unit.accelerometer_threshold)
    with pytest.raises(ProcedureError, match="accelerometer_threshold needs to be a number above 0"):
        changed("units.imu2.accelerometer_threshold=last*0.5")
