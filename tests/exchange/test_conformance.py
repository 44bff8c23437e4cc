"""Every target against its own source: names, units and signs in `conformance.yaml`, formulas here.

Peers' loaders (imucal, OpenCV, pymavlink, imufusion) are requirements of the tests: without them this module
cannot be imported, and nothing is skipped.
"""

import re
from collections import defaultdict
from pathlib import Path

import imucal
import numpy as np
import pytest
import yaml
from rosbags.typesys.stores.latest import sensor_msgs__msg__Imu

from exchange_units import calibration, needed, samples, with_current
from target_formulas import COVARIANCES, FORMULAS, NOISE, READERS, corrected, names_in, noise_of_sample
from tumble.calibration.document import Calibration
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import sensing_axes
from tumble.tools.exchange.procedure import export, import_calibrations
from tumble.tools.exchange.registry import TARGETS

TABLE = yaml.safe_load((Path(__file__).parent / "conformance.yaml").read_text())
SOURCE = re.compile(r"this repository \S+|[\w.-]+/[\w.-]+ [0-9a-f]{12} \S.*")
G = 9.80665
FLOAT = 2e-6
"""Single precision of the largest readings, of about 40, over that."""
RATE = 200.0
LETTERS = {"F": 0, "B": 0, "L": 1, "R": 1, "U": 2, "D": 2}
ALL_AXES = ("FRD", "FLU")


def to_flu(axes):
    """Matrix (3, 3) from a frame of these directions to forward, left, up."""
    matrix = np.zeros((3, 3))
    for column, letter in enumerate(axes):
        matrix[LETTERS[letter], column] = 1.0 if letter in "FLU" else -1.0
    return matrix


TO_FLU = {axes: to_flu(axes) for axes in ("FRD", "FLU", "LBU", "DRB")}


OFFERED = {"betaflight": {"counts-per-gauss": "1090"}}
"""Settings by which a target holds all that it can."""


def written(folder, word, unit):
    target = TARGETS[word]
    path = folder / f"{word}{target.ending}"
    exported = export(unit, word, needed(word) | OFFERED.get(word, {}))
    path.write_bytes(exported.content)
    return path, exported


def with_held(word, seed):
    """A drawn calibration of those parts alone that the target holds."""
    unit, held = calibration(seed), TARGETS[word].holds
    update = {}
    for triad in TRIADS:
        section, parts = getattr(unit, triad), held.get(triad, ())
        axes = sensing_axes(section.M)
        factors = {
            "scale": np.diag(axes.scale),
            "non-orthogonality": axes.non_orthogonality,
            "mounting": axes.mounting,
        }
        kept = [factor if part in parts else np.eye(3) for part, factor in factors.items()]
        change = {
            "M": np.linalg.multi_dot(kept),
            "b": section.b if "bias" in parts else np.zeros(3),
        }
        if triad == "gyroscope" and "g-sensitivity" not in parts:
            change["g_sensitivity"] = None
        update[triad] = section.model_copy(update=change)
    return unit.model_copy(update=update)


def frame_of(word, unit):
    """Rotation from the case to the frame in which a target gives its results."""
    if word in ("kalibr", "openvins"):
        turned, upper = np.linalg.qr(unit.accelerometer.M.T)
    elif word.startswith("imu-tk"):
        turned, upper = np.linalg.qr(np.linalg.inv(unit.accelerometer.M))
    else:
        return np.eye(3)
    return (turned * np.sign(np.diag(upper))).T


def test_the_table_and_the_formulas_are_of_all_targets():
    assert set(TABLE) == set(TARGETS) == set(READERS)
    assert sorted((*FORMULAS, *NOISE, *COVARIANCES)) == sorted(TARGETS)


@pytest.mark.parametrize("word", TARGETS)
def test_each_row_states_repository_commit_and_place(word):
    for row in TABLE[word]:
        assert set(row) in ({"names", "is", "source"}, {"axes", "is", "source"})
        assert SOURCE.fullmatch(row["source"]), row["source"]


@pytest.mark.parametrize("word", TARGETS)
def test_the_axes_of_a_target_are_those_of_its_source(word):
    (row,) = (row for row in TABLE[word] if "axes" in row)
    assert row["axes"] in ("any", "the accelerometer's own", *ALL_AXES)
    assert TARGETS[word].body == (row["axes"] if row["axes"] in ALL_AXES else "")


@pytest.mark.parametrize("word", TARGETS)
def test_the_axes_of_a_target_are_in_its_file_and_in_the_remarks(tmp_path, word):
    _, exported = written(tmp_path, word, calibration(1))
    (stated,) = (remark for remark in exported.remarks if remark.startswith("axes: "))
    assert TARGETS[word].axes in stated
    has_comments = not word.startswith(("imu-tk", "record")) or word == "record-c"
    assert (stated in exported.content.decode("latin-1")) == has_comments


@pytest.mark.parametrize("word", [word for word in TARGETS if TARGETS[word].body])
@pytest.mark.parametrize("axes", ["FRD", "FLU", "LBU", "DRB"])
@pytest.mark.parametrize("known_from", ["log", "setting"])
def test_a_target_in_other_axes_corrects_what_is_turned_into_them(tmp_path, word, axes, known_from):
    unit = with_held(word, 2)
    if known_from == "log":
        path, exported = written(tmp_path, word, unit.model_copy(update={"axes": axes}))
    else:
        exported = export(unit.model_copy(update={"axes": "BRU"}), word, {**needed(word), "axes": axes})
        path = tmp_path / f"set{TARGETS[word].ending}"
        path.write_bytes(exported.content)
    turn = TO_FLU[TARGETS[word].body].T @ TO_FLU[axes]
    force, rate = samples(2)
    theirs = corrected(word, path, force @ turn.T, rate @ turn.T)
    rounding = sum(loss.size for loss in exported.losses if loss.part == "rounding to counts")
    for found, expected in zip(theirs, unit.correct(force, rate), strict=True):
        if found is not None:
            assert np.abs(found - expected @ turn.T).max() < FLOAT * np.abs(expected).max() + 1.001 * rounding


@pytest.mark.parametrize("word", TARGETS)
def test_every_name_that_is_written_is_the_targets_own(tmp_path, word):
    parts = () if word.startswith(("px4", "ardupilot", "c", "record")) else ("mounting", "scale", "response")
    unit = calibration(4, parts=parts, over_temperature=not parts)
    if "magnetometer" in TARGETS[word].holds:
        unit = unit.model_copy(update={"magnetometer": with_current(4, "A", number=8).magnetometer})
    path, _ = written(tmp_path, word, unit)
    patterns = [pattern for row in TABLE[word] for pattern in row.get("names", ())]
    matched = defaultdict(list)
    for name in names_in(word, path):
        for pattern in patterns:
            if re.fullmatch(pattern, name):
                matched[name].append(pattern)
    assert {name for name in names_in(word, path) if len(matched[name]) != 1} == set()
    assert {*patterns} - {pattern for found in matched.values() for pattern in found} == set()


@pytest.mark.parametrize("word", FORMULAS)
@pytest.mark.parametrize("seed", range(3))
def test_the_target_corrects_as_tumble_does(tmp_path, word, seed):
    unit = with_held(word, seed)
    path, exported = written(tmp_path, word, unit)
    rounding = sum(loss.size for loss in exported.losses if loss.part == "rounding to counts")
    assert [loss for loss in exported.losses if not loss.part.startswith(("rounding", "mounting in"))] == []
    force, rate = samples(seed)
    frame = frame_of(word, unit)
    ours = [values @ frame.T for values in unit.correct(force, rate)]
    theirs = corrected(word, path, force, rate)
    assert [each is not None for each in theirs] == [triad in TARGETS[word].holds for triad in TRIADS]
    for found, expected in zip(theirs, ours, strict=True):
        if found is not None:
            size = np.abs(expected).max()
            assert np.abs(found - expected).max() < FLOAT * size + 1.001 * rounding


@pytest.mark.parametrize("word", FORMULAS)
@pytest.mark.parametrize("seed", range(3))
def test_the_error_that_stays_is_no_more_than_the_losses(tmp_path, word, seed):
    unit = calibration(seed)
    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(2, 500, 3))
    directions /= np.linalg.norm(directions, axis=2)[:, :, np.newaxis]
    force, rate = G * directions[0], directions[1]
    read_force = force @ unit.accelerometer.M.T + unit.accelerometer.b
    response = force @ unit.gyroscope.g_sensitivity.T
    read_rate = rate @ unit.gyroscope.M.T + response + unit.gyroscope.b
    path, exported = written(tmp_path, word, unit)
    # A triad that the target leaves alone stays as it was read.
    theirs = corrected(word, path, read_force, read_rate)
    for triad, found, read, truth in zip(TRIADS, theirs, (read_force, read_rate), (force, rate), strict=True):
        if triad in TARGETS[word].leaves_out:
            continue
        left = np.linalg.norm((read if found is None else found) - truth, axis=1).max()
        stated = sum(
            # A bias is stated by its largest axis.
            loss.size * (np.sqrt(3.0) if loss.part in ("bias", "rounding to counts") else 1.0)
            for loss in exported.losses
            if loss.triad == triad
        )
        # Products of two small errors stand beside the sum.
        assert left < 1.05 * stated + FLOAT * np.abs(truth).max()


@pytest.mark.parametrize("word", NOISE)
def test_noise_of_a_sample_is_that_of_the_calibration(tmp_path, word):
    unit = calibration(2)
    path, exported = written(tmp_path, word, unit)
    assert exported.losses == ()
    expected = [[2e-3 * np.sqrt(RATE), 1e-4 / np.sqrt(RATE)]] * 2
    assert noise_of_sample(word, path, RATE) == pytest.approx(np.array(expected), rel=1e-6)
    assert any("it holds noise alone" in remark for remark in exported.remarks)


@pytest.mark.parametrize("word", NOISE)
def test_inflated_noise_of_a_sample_is_so_many_times_as_large(tmp_path, word):
    path = tmp_path / f"noise{TARGETS[word].ending}"
    exported = export(calibration(2), word, {**needed(word), "inflation": "10"})
    path.write_bytes(exported.content)
    expected = [[2e-2 * np.sqrt(RATE), 1e-3 / np.sqrt(RATE)]] * 2
    assert noise_of_sample(word, path, RATE) == pytest.approx(np.array(expected), rel=1e-6)
    assert b"10 times that of the calibration" in exported.content
    assert not any("inflation" in remark for remark in exported.remarks)


def test_covariances_are_fields_of_the_message(tmp_path):
    path, exported = written(tmp_path, "robot-localization", calibration(2))
    found = yaml.safe_load(path.read_text())
    message = sensor_msgs__msg__Imu.__annotations__
    assert set(found) < set(message)
    variance = (2e-3) ** 2 * RATE
    for covariance in found.values():
        assert np.reshape(covariance, (3, 3)) == pytest.approx(variance * np.eye(3), rel=1e-6)
    assert any("inflation" in remark for remark in exported.remarks)


HOSTILE = (
    "a\nset reboot\nINS_GYR_CAL,1", "quote \" and ' done", "*/ int broken; /*", "backslash \\", "??/",
    "#include <missing.h>\u2028%YAML:1.0", "{{}}: [x", "\x1b]0;title\x07 café 測",
)  # fmt: skip


@pytest.mark.parametrize("word", TARGETS)
@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_of_a_unit_gets_out_of_its_comment(tmp_path, word, name):
    plain, hostile = (
        with_held(word, 1).model_copy(update={"name": each, "serial": each}) for each in ("unit", name)
    )
    path, _ = written(tmp_path, word, plain)
    names = list(names_in(word, path))
    path, exported = written(tmp_path, word, hostile)
    assert list(names_in(word, path)) == names
    if not word.startswith("record"):
        text = exported.content.decode()
        assert all(character == "\n" or character.isprintable() for character in text.replace("\t", ""))
    if word in FORMULAS:
        force, rate = samples(1)
        theirs = corrected(word, path, force, rate)
        assert [each is not None for each in theirs] == [triad in TARGETS[word].holds for triad in TRIADS]


def test_calibration_by_a_peer_is_read_as_the_peer_applies_it(tmp_path):
    generator = np.random.default_rng(8)
    print("seed 8")
    counts = {"K_a": np.diag([208.0, 207.0, 214.0]), "K_g": np.diag([16.7, 16.2, 16.3])}
    rows = {name: np.eye(3) + 0.02 * generator.normal(size=(3, 3)) for name in ("R_a", "R_g")}
    info = imucal.FerrarisCalibrationInfo(
        from_acc_unit="a.u.", from_gyr_unit="a.u.", comment='a "comment" {', **counts, **rows,
        b_a=np.array([-6.0, -48.0, -29.0]), b_g=np.array([2.0, -4.5, -3.7]),
        K_ga=1e-2 * generator.normal(size=(3, 3)),
    )  # fmt: skip
    path = tmp_path / "imucal.json"
    info.to_json_file(path)
    (unit,) = import_calibrations(path)
    assert isinstance(unit, Calibration)
    assert unit.method.options["readings"] == {"accelerometer": "a.u.", "gyroscope": "a.u."}
    force, rate = 2000.0 * generator.normal(size=(20, 3)), 1000.0 * generator.normal(size=(20, 3))
    true_force, degrees = info.calibrate(force, rate, acc_unit="a.u.", gyr_unit="a.u.")
    ours = unit.correct(force, rate)
    assert np.allclose(ours[0], true_force, rtol=1e-10)
    assert np.allclose(np.degrees(ours[1]), degrees, rtol=1e-10)


@pytest.mark.parametrize(("acc", "gyr"), [("m/s^2", "deg/s"), ("g", "rad/s")])
def test_readings_of_a_peer_in_known_units_are_taken_to_si(tmp_path, acc, gyr):
    info = imucal.TurntableCalibrationInfo(
        from_acc_unit=acc, from_gyr_unit=gyr,
        K_a=np.diag([1.1, 0.9, 1.0]), R_a=np.eye(3), b_a=np.full(3, 0.1),
        K_g=np.diag([0.9, 1.2, 1.0]), R_g=np.eye(3), b_g=np.full(3, 0.3), K_ga=np.full((3, 3), 0.01),
    )  # fmt: skip
    path = tmp_path / "imucal.json"
    info.to_json_file(path)
    (unit,) = import_calibrations(path)
    force, rate = samples(1)
    to_unit = {"m/s^2": 1.0, "g": 1.0 / G, "deg/s": np.degrees(1.0), "rad/s": 1.0}
    true_force, degrees = info.calibrate(
        to_unit[acc] * force, to_unit[gyr] * rate, acc_unit=acc, gyr_unit=gyr
    )
    ours = unit.correct(force, rate)
    assert np.allclose(ours[0], true_force, rtol=1e-10)
    assert np.allclose(np.degrees(ours[1]), degrees, rtol=1e-10)
