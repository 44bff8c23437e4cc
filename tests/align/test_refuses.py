"""Logs that are no good: `tumble align` leaves samples out with a remark, or ends with one line."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble
from align_motions import Motion, Sensor, drawn, errors, record
from tumble import _core
from turntable_sessions import contents, one_line, typed, write_table

SECONDS = 40.0


@pytest.fixture
def pair():
    """Tables of a primary and a secondary, to be corrupted: time, specific force, angular rate."""
    sensors = (Sensor(rate_hz=100.0), drawn(41, rate_hz=100.0, skew=0.0))
    return [np.column_stack(record(Motion(41), sensor, SECONDS, k)) for k, sensor in enumerate(sensors)]


def logs(pair, folder, header="time,ax,ay,az,gx,gy,gz"):
    return [
        write_table(folder / f"{name}.csv", table, header)
        for name, table in zip(("first", "second"), pair, strict=True)
    ]


def arguments(pair, folder, *options):
    first, second = logs(pair, folder)
    return ["align", "--primary", first, "--secondary", second, "-o", folder / "out", *options]


def refused(*arguments, folder):
    """The one line, beside results of an earlier run, which stay as they are."""
    out = folder / "out"
    out.mkdir(exist_ok=True)
    (out / "align.yaml").write_text("schema: tumble-redundancy/1\n# of an earlier run\n")
    before = contents(out)
    done = typed(*arguments)
    assert done.code == 2, f"exit code {done.code}: {done.out}{done.err}"
    assert done.out == ""
    assert contents(out) == before
    return one_line(done.err)


def aligned(pair):
    first, second = (
        tumble.Recording.from_arrays(f"u{k}", table[:, 0], table[:, 1:4], table[:, 4:])
        for k, table in enumerate(pair)
    )
    return tumble.align(first, [second]).units[0]


def assert_right(unit):
    found = errors(unit, Sensor(), drawn(41, skew=0.0), SECONDS)
    for name, (error, sigma) in found.items():
        assert np.all(np.abs(error) < 6.0 * sigma), name


def test_samples_that_are_no_numbers_are_left_out(pair):
    generator = np.random.default_rng(41)
    for table in pair:
        table[generator.integers(0, len(table), 30), generator.integers(1, 7, 30)] = np.nan
    unit = aligned(pair)
    assert_right(unit)
    assert unit.pairs < SECONDS / unit.window - 30


@pytest.mark.parametrize("triad", [slice(1, 4), slice(4, 7)], ids=["accelerometer", "gyroscope"])
def test_samples_at_the_end_of_a_range_are_left_out_and_counted(pair, triad):
    limit = np.quantile(np.abs(pair[1][:, triad]), 0.98)
    limit = max(limit, 15.5) if triad.start == 1 else limit
    pair[1][::50, triad.start] += 30.0 if triad.start == 1 else 0.0
    clipped = np.abs(pair[1][:, triad]) >= limit
    pair[1][:, triad] = np.clip(pair[1][:, triad], -limit, limit)
    unit = aligned(pair)
    assert_right(unit)
    said = [warning for warning in unit.warnings if "at the end of its range" in warning]
    assert said == [f"left out {clipped.any(axis=1).sum()} samples of the secondary at the end of its range"]


def test_gaps_are_not_averaged_over(pair):
    kept = np.ones(len(pair[1]), dtype=bool)
    for start in range(200, 3600, 400):
        kept[start : start + 80] = False
    unit = aligned([pair[0], pair[1][kept]])
    assert_right(unit)


def test_samples_with_the_time_stamp_of_the_one_before_do_no_harm(pair):
    doubled = np.sort(np.concatenate([np.arange(len(pair[1])), np.arange(100, 3000, 250)]))
    assert_right(aligned([pair[0], pair[1][doubled]]))


def test_time_that_runs_backwards_is_refused(tmp_path, pair):
    pair[1][1000:, 0] -= 3.0
    line = refused(*arguments(pair, tmp_path), folder=tmp_path)
    assert "second: time runs backwards" in line
    assert "sort the log by time" in line


def test_logs_of_two_different_motions_are_refused(tmp_path, pair):
    pair[1] = np.column_stack(record(Motion(42), drawn(41, rate_hz=100.0), SECONDS, 1))
    line = refused(*arguments(pair, tmp_path), folder=tmp_path)
    assert line.startswith("second: does not show the motion of first: their rates correlate by ")


def test_a_unit_that_lay_still_beside_one_that_moved_is_refused(tmp_path, pair):
    noise = np.random.default_rng(1).normal(0.0, 0.001, (len(pair[1]), 6))
    pair[1][:, 1:] = noise + np.array([0.0, 0.0, 9.8, 0.01, 0.0, 0.0])
    line = refused(*arguments(pair, tmp_path), folder=tmp_path)
    assert line.startswith("second: never turned together with first: root mean square rate 0.00")


def test_gyroscope_in_deg_taken_as_rad_names_the_option_that_helps(tmp_path, pair):
    pair[1][:, 4:] = np.degrees(pair[1][:, 4:])
    typed_words = arguments(pair, tmp_path, "--gyroscope-unit", "rad/s")
    line = refused(*typed_words, folder=tmp_path)
    assert re.match(r"second: turns 57\.\d times as fast as first; one of the two was read in deg/s", line)
    assert "--for NAME:gyroscope-unit=deg/s" in line
    done = typed(*typed_words, "--for", "second:gyroscope-unit=deg/s")
    assert done.code == 0, done.err


def test_left_handed_unit_is_refused_with_the_option_that_helps(tmp_path, pair):
    pair[1][:, [3, 6]] *= -1.0
    line = refused(*arguments(pair, tmp_path), folder=tmp_path)
    assert line.startswith("second: its gyroscope mirrors that of first")
    done = typed(*arguments(pair, tmp_path), "--for", "second:axes=x,y,-z")
    assert done.code == 0, done.err


@pytest.mark.parametrize(
    "corrupt",
    [
        lambda force: force[:, [1, 0, 2]],
        lambda force: force[::-1],
        lambda force: force / 9.80665,
    ],
    ids=["axes exchanged", "of another time", "in g"],
)
def test_accelerometer_that_does_not_fit_is_refused_beside_gyroscopes(pair, corrupt):
    pair[1][:, 1:4] = corrupt(pair[1][:, 1:4].copy())
    with pytest.raises(tumble.ProcedureError, match=r"^u1: its accelerometer does not fit that of u0"):
        aligned(pair)


def test_a_dead_accelerometer_is_refused_by_its_name(pair):
    pair[1][:, 1:4] = 0.0
    with pytest.raises(tumble.ProcedureError, match=r"^u1: accelerometer x is stuck at 0 m/s\^2"):
        aligned(pair)


def test_logs_that_are_too_short_are_refused(tmp_path, pair):
    line = refused(*arguments([table[:150] for table in pair], tmp_path, "--search", "0"), folder=tmp_path)
    assert line.startswith("second: shares less than 2 s with first")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--primary", "{first}", "--secondary", "{first}"],
            "is the primary and cannot be its own secondary",
        ),
        (["--primary", "{first}", "--secondary", "{second}", "--secondary", "{second}"], "is named twice"),
        (["--primary", "{first}", "--secondary", "nowhere.csv"], "nowhere.csv: no such file"),
        (["{first}", "--primary", "imu1", "--secondary", "imu2"], "no IMU 'imu1'"),
        (
            ["--primary", "{first}", "--secondary", "{second}", "--for", "third:rate=3"],
            "no recording is named",
        ),
    ],
)
def test_units_that_are_not_there_or_there_twice_are_refused(tmp_path, pair, words, said):
    first, second = logs(pair, tmp_path)
    named = [word.format(first=first, second=second) for word in words]
    assert said in refused("align", *named, "-o", tmp_path / "out", folder=tmp_path)


def test_a_search_that_is_no_time_is_refused():
    table = np.zeros((10, 7))
    unit = tumble.Recording.from_arrays("a", table[:, 0], table[:, 1:4], table[:, 4:])
    other = tumble.Recording.from_arrays("b", table[:, 0], table[:, 1:4], table[:, 4:])
    with pytest.raises(tumble.ProcedureError, match="--search nan: give a time in s"):
        tumble.align(unit, [other], search=float("nan"))


def test_arrays_in_column_order_are_refused_not_misread(pair):
    first, second = ((table[:, 0].copy(), table[:, 1:4].copy(), table[:, 4:].copy()) for table in pair)
    assert _core.align_units(first, second)["correlation"] > 0.99
    turned = (second[0], second[1], np.asfortranarray(second[2]))
    with pytest.raises(ValueError, match="gyroscope must be C-contiguous"):
        _core.align_units(first, turned)


def test_swapped_files_give_the_inverse_rotation_not_a_wrong_one(pair):
    there, back = aligned(pair), aligned(pair[::-1])
    product = Rotation.from_matrix(there.sensor_from_primary @ back.sensor_from_primary)
    assert product.magnitude() < 1e-4
