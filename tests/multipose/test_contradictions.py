"""Turns against rests, and a stated rate against stamps: what contradicts the model reaches the verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas
import pytest

import tumble
from repetitions import drawn_seed, few
from tumble import ReadOptions
from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT
from tumble.procedures.multipose.report.text import sentences
from tumble.procedures.multipose.turn_bias import TurnLoss
from tumble.tools.simulate import simulate_multipose
from turntable_sessions import typed

RATE = 100.0
"""Hz."""
SMALL = {"bias_instability": False, "g_sensitivity": False, "latitude_deg": None, "rate_hz": RATE}
SESSIONS = [
    (seed, grade, size) for seed in (1, 2, 3, 4) for grade in ("consumer", "industrial") for size in (12, 18)
]
"""Seed, grade and number of orientations."""


def session(seed, grade="consumer", orientations=18, **changes):
    print(f"seed {seed}, {grade}, {orientations} orientations")
    return simulate_multipose(seed=seed, grade=grade, orientations=orientations, **{**SMALL, **changes})


def read_as(samples, gyroscope):
    return tumble.Recording.from_arrays("unit", samples.time, samples.accelerometer, gyroscope)


def at_rest(hand):
    """(n,) true where a sample was taken at rest."""
    time = hand.unit.samples.time
    rest = np.zeros(len(time), dtype=bool)
    for each in hand.session.rests:
        rest |= (time >= each.start) & (time <= each.end)
    return rest


def table(samples, gyroscope=None, keep=slice(None), **columns):
    rate = samples.gyroscope if gyroscope is None else gyroscope
    found = {"time": samples.time[keep]} | columns
    found |= {f"a{axis} (m/s^2)": samples.accelerometer[keep, k] for k, axis in enumerate("xyz")}
    found |= {f"g{axis} (rad/s)": rate[keep, k] for k, axis in enumerate("xyz")}
    return pandas.DataFrame(found)


def objections(found):
    return [] if found.gyroscope is None else list(found.gyroscope.objections)


@pytest.mark.parametrize(("seed", "grade", "size"), few(SESSIONS, 5))
def test_a_gyroscope_that_zeroes_itself_has_two_biases(seed, grade, size):
    hand = session(seed, grade, size)
    samples = hand.unit.samples
    bias = np.array([0.02, -0.01, 0.015])
    rates = samples.gyroscope - hand.unit.gyroscope.b + np.where(at_rest(hand)[:, None], 0.0, bias)
    found = tumble.multipose(read_as(samples, rates))
    assert found.verdict == "model not met"
    (objection,) = objections(found)
    assert "reads otherwise in turns than at rest" in objection
    assert "its bias cannot be found from rests" in objection
    assert objection in found.warnings


def test_an_angle_lost_in_every_turn_is_named():
    sentence = TurnLoss(np.radians(0.63), np.radians(0.05)).sentence()
    assert sentence.startswith("the gyroscope loses 0.63 ± 0.05 deg in every turn, however far it goes")


@pytest.mark.parametrize(("seed", "grade", "size"), few(SESSIONS, 5))
@pytest.mark.parametrize("width", [0.02, 0.04])
def test_a_dead_band_is_named_with_its_width(seed, grade, size, width):
    hand = session(seed, grade, size)
    samples = hand.unit.samples
    random = np.random.default_rng(seed)
    rates = samples.gyroscope - hand.unit.gyroscope.b + 1e-3
    rates = np.where(np.abs(rates) < width, 0.0, rates) + 1e-4 * random.normal(size=rates.shape)
    found = tumble.multipose(read_as(samples, rates))
    assert found.verdict == "model not met"
    (objection,) = objections(found)
    assert "dead band" in objection
    assert f"{1e3 * width:.1g}"[0] in objection


@pytest.mark.parametrize("grade", ["consumer", "industrial", "tactical"])
def test_sound_sessions_stay_calibrated(grade):
    start = drawn_seed()
    for seed in range(start, start + 8):
        size = 10 + seed % 3 * 5
        found = tumble.multipose(session(seed, grade, size).recording)
        assert found.verdict == "calibrated"
        assert not objections(found)


def test_a_bias_that_wanders_is_no_contradiction():
    for seed in range(4):
        hand = session(seed, **dict.fromkeys(("bias_instability", "g_sensitivity"), True))
        assert not objections(tumble.multipose(hand.recording))


def test_turns_far_beyond_noise_are_no_calibration():
    for seed in range(3):
        samples = session(seed).unit.samples
        keep = np.random.default_rng(seed).random(len(samples)) > 0.03
        found = tumble.multipose(table(samples, keep=keep).drop(columns="time"), read=ReadOptions(rate=RATE))
        assert found.verdict == "model not met"
        assert any("times what noise explains" in each for each in objections(found))


@pytest.mark.parametrize("share", [0.003, 0.03])
def test_lost_rows_are_named_where_a_rate_is_stated(share):
    for seed in range(3):
        samples = session(seed).unit.samples
        keep = np.random.default_rng(seed).random(len(samples)) > share
        keep[[0, -1]] = True
        found = tumble.multipose(table(samples, keep=keep), read=ReadOptions(rate=RATE))
        assert found.verdict == "model not met"
        (objection,) = objections(found)
        shown = (keep.sum() - 1) / (samples.time[-1] - samples.time[0])
        assert f"states {RATE:g} Hz, but the log's stamps show {shown:.5g} Hz" in objection
        assert f"with {np.sum(~keep)} samples missing" in objection
        assert tumble.multipose(table(samples, keep=keep)).verdict == "calibrated"


@pytest.mark.parametrize("stated", [103.0, 99.0, 100.2])
def test_a_stated_rate_that_stamps_contradict_is_named(stated):
    samples = session(1).unit.samples
    found = tumble.multipose(table(samples), read=ReadOptions(rate=stated))
    right = tumble.multipose(table(samples))
    assert found.verdict == "model not met"
    (objection,) = objections(found)
    off = found.gyroscope.M[0, 0] / right.gyroscope.M[0, 0] - 1.0
    assert abs(off - (RATE / stated - 1.0)) < 1e-4
    assert f"off by {100 * off:+.2g} %" in objection


def times(kind, samples):
    random = np.random.default_rng(3)
    return {
        "exact": samples.time,
        "late": samples.time + random.uniform(0.0, 0.009, len(samples)),
        "in whole seconds": np.floor(samples.time),
        "a step of a crystal": samples.time * (1.0 + 1e-4),
        "of another unit": samples.time * 3.7,
        "all alike": np.zeros(len(samples)),
        "backwards": samples.time[::-1],
    }[kind]


@pytest.mark.parametrize(
    "kind",
    ["exact", "late", "in whole seconds", "a step of a crystal", "of another unit", "all alike", "backwards"],
)
def test_a_stated_rate_that_stamps_do_not_contradict_stands(kind):
    samples = session(2).unit.samples
    found = tumble.multipose(table(samples).assign(time=times(kind, samples)), read=ReadOptions(rate=RATE))
    assert found.verdict == "calibrated"
    assert not any("--rate" in line for line in found.warnings)


def test_one_lost_row_is_named_but_calibrates():
    samples = session(2).unit.samples
    keep = np.arange(len(samples)) != len(samples) // 2
    found = tumble.multipose(table(samples, keep=keep), read=ReadOptions(rate=RATE))
    assert found.verdict == "calibrated"
    assert any("with 1 sample missing" in line for line in found.warnings)


def test_the_scale_is_relative_to_the_clock_and_the_page_says_so(tmp_path):
    samples = session(4).unit.samples
    log = tmp_path / "log.csv"
    table(samples).drop(columns="time").to_csv(log, index=False)
    found = {rate: tumble.multipose(log, read=ReadOptions(rate=rate)) for rate in (100.0, 103.0)}
    assert np.allclose(found[103.0].gyroscope.M * 1.03, found[100.0].gyroscope.M, atol=1e-4)
    for rate, each in found.items():
        sentence = f"time: {rate:g} Hz, taken as exact; the gyroscope's scale is relative to the stated rate"
        assert any(line.startswith(sentence) for line in sentences(each))
        assert "scale is relative to the stated rate" in MULTIPOSE_REPORT.render(each).replace("&#39;", "'")
    stamped = tumble.multipose(table(samples))
    assert any("relative to their clock" in line for line in sentences(stamped))
    without = replace(stamped, time_base=None)
    assert not any(line.startswith("time: ") for line in sentences(without))
    done = typed("multipose", log, "--rate", 103, "-o", tmp_path / "out")
    assert done.code == 0
    assert "relative to the stated rate" in " ".join(done.text.split())


def test_the_command_ends_with_3_where_turns_contradict(tmp_path):
    hand = session(1)
    samples = hand.unit.samples
    rates = samples.gyroscope - hand.unit.gyroscope.b + np.where(at_rest(hand)[:, None], 0.0, 0.02)
    table(samples, rates).to_csv(tmp_path / "log.csv", index=False)
    done = typed("multipose", tmp_path / "log.csv", "-o", tmp_path / "out")
    assert done.code == 3
    assert "zeroes itself at rest" in " ".join(done.text.split())
