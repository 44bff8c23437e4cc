"""Sentences of the pages."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

import report_fixtures as sessions
from tumble.foundation.results import LimitCheck
from tumble.procedures.turntable.report import text as words
from tumble.procedures.turntable.result import ClockFit
from tumble.report.numbers import MINUS


@pytest.fixture(scope="module")
def result():
    return sessions.batch()


def with_fit(triad, chi_square, freedom):
    return replace(triad, chi_square=chi_square, degrees_of_freedom=freedom)


@pytest.mark.parametrize(
    ("chi_square", "freedom", "said"),
    [
        (24.0, 24, "explain what was measured"),
        (80.0, 24, "larger than the noise explains"),
        (38.0, 24, "by chance in about"),
        (4.0, 24, "smaller than the noise"),
        (0.0, 0, "do not test the fit"),
    ],
)
def test_chi_square_is_put_in_words_that_follow_its_p_value(result, chi_square, freedom, said):
    triad = with_fit(result["target_1"].accelerometer, chi_square, freedom)
    assert said in words.chi_square_sentence(triad)


@pytest.mark.parametrize(
    ("chi_square", "said"), [(80.0, "below 0.001"), (9.0, "above 0.99"), (4.0, "above 0.999")]
)
def test_a_p_value_is_never_rounded_to_certainty(result, chi_square, said):
    assert f"p {said}:" in words.chi_square_sentence(
        with_fit(result["target_1"].accelerometer, chi_square, 24)
    )


def test_a_fit_without_degrees_of_freedom_shows_no_p_value(result):
    sentence = words.chi_square_sentence(with_fit(result["target_1"].accelerometer, 0.0, 0))
    assert not re.search(r"\d", sentence)
    assert words.fit_in_brief(with_fit(result["target_1"].accelerometer, 0.0, 0)) == "cannot be tested"


def test_unobservable_value_has_a_reason_and_no_number(result):
    sentences = words.unobserved_sentences(result["target_4"])
    text = " ".join(sentences)
    assert "Gyroscope scale, non-orthogonality and mounting" in text
    assert sessions.NO_SCALE in text
    assert not re.search(r"\d|nan|inf\b", text)


def test_everything_shown_leaves_nothing_to_say(result):
    assert words.unobserved_sentences(result["target_1"]) == []


def test_a_triad_without_calibration_is_named(result):
    target = replace(result["target_1"], gyroscope=None)
    assert words.unobserved_sentences(target) == ["The gyroscope was not calibrated."]


def test_a_failure_names_the_worst_parameter_with_value_and_limit():
    checks = (
        LimitCheck("accelerometer bias x", 0.41, 0.5, "m/s^2", passed=True),
        LimitCheck("accelerometer bias y", -0.61, 0.5, "m/s^2", passed=False),
        LimitCheck("gyroscope bias z", 0.4, 0.1, "rad/s", passed=False),
    )
    target = replace(sessions.batch()["target_5"], checks=checks)
    sentence = words.verdict_sentence(target)
    assert sentence.startswith("2 of 3 limits failed: gyroscope bias z is 0.400 rad/s, its limit 0.1 rad/s;")
    assert f"accelerometer bias y is {MINUS}0.610 m/s², its limit 0.5 m/s²" in sentence


def test_unknown_value_comes_first_and_shows_no_number():
    unknown = LimitCheck(
        "gyroscope scale x", float("nan"), 0.03, "1", passed=False, remark="not shown: no turns"
    )
    known = LimitCheck("gyroscope bias z", 0.4, 0.1, "rad/s", passed=False)
    assert words.worst((known, unknown)) is unknown
    assert words.used_share(unknown) == "an unknown share"
    assert words.check_sentence(unknown) == "gyroscope scale x was not shown: no turns"


def test_a_limit_of_zero_is_no_division_by_zero():
    assert words.used_share(LimitCheck("bias x", 0.1, 0.0, "m/s^2", passed=False)) == "more than all"
    assert words.used_share(LimitCheck("bias x", 0.0, 0.0, "m/s^2", passed=True)) == "0 %"


def test_clocks_are_described_with_sigma_or_as_one():
    apart = words.clock_sentence(ClockFit(False, 1.23456, 0.0021, 14.2, 3.3, turns=1))
    assert "offset 1.2346 ± 0.0021 s, skew 14.2 ± 3.3 ppm, found from 1 turn." in apart
    shared = words.clock_sentence(ClockFit(True, 0.0, 0.0, 0.0, 0.0, turns=0))
    assert "one clock" in shared
    assert not re.search(r"\d", shared)


def test_unestimated_mounting_angle_is_a_reason_and_no_number():
    sentence = words.mounting_sentence(sessions.batch_without_mounting().reference)
    assert "no pose list was given" in sentence
    assert not re.search(r"\d", sentence)


@pytest.mark.parametrize(
    ("names", "text"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_names_are_joined_as_in_speech(names, text):
    assert words.join(names) == text
