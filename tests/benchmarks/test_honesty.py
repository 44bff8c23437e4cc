"""The adversary of the procedures: its simulator, its catalogue and its law."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.honesty.catalogue import CATALOGUE
from benchmarks.honesty.draw import draw
from benchmarks.honesty.law import Judgement
from benchmarks.honesty.motion import attitude_after, attitude_with_up, moved, rotation_vector, visits
from benchmarks.honesty.sessions import SESSIONS
from benchmarks.honesty.summary import summary

from repetitions import drawn_seed, few

PLAIN = Judgement(1, "spin", (), (), 0, 1.0, "accelerometer bias x", 6, 6, True)


def test_rates_are_the_derivative_of_the_attitude():
    rng = np.random.default_rng(4)
    attitudes = [attitude_with_up(rng.normal(size=3), 0.3)]
    for _ in range(3):
        up = rng.normal(size=3)
        attitudes.append(attitude_after(attitudes[-1], up / np.linalg.norm(up), 0.2))
    motion = moved(visits(attitudes, 1.0, 1.0), attitudes[0], 1000.0)
    between = motion.attitude[:-1].transpose(0, 2, 1) @ motion.attitude[1:]
    turned = 1000.0 * np.array([rotation_vector(each) for each in between])
    assert np.abs(turned - 0.5 * (motion.rate[1:] + motion.rate[:-1])).max() < 1e-4
    assert np.abs(1000.0 * np.diff(motion.rate, axis=0) - motion.acceleration[:-1]).max() < 0.05
    for number, attitude in enumerate(attitudes):
        assert np.abs(motion.attitude[motion.pose == number] - attitude).max() < 1e-9


def test_rows_of_the_catalogue_differ_and_say_what_names_them():
    assert len({row.name for row in CATALOGUE}) == len(CATALOGUE)
    for row in CATALOGUE:
        assert 0.0 < row.low < row.high
        assert set(row.procedures) <= set(SESSIONS)
        assert row.seen
        re.compile(row.says)


@pytest.mark.parametrize("procedure", SESSIONS)
def test_every_imperfection_changes_the_files_of_a_session(procedure, tmp_path):
    def written(row=None, size=0.0):
        rng = np.random.default_rng(8)
        session = SESSIONS[procedure](rng)
        # A unit that lies still for an hour shows in a minute what changes its readings.
        session.segments = [replace(each, seconds=min(each.seconds, 60.0)) for each in session.segments]
        if row is not None:
            row.put(session, size)
        words = session.write(tmp_path)
        return words, [path.read_text() for path in sorted(tmp_path.glob("*.csv"))]

    as_it_is = written()
    for row in CATALOGUE:
        if procedure in row.procedures:
            assert any(written(row, size) != as_it_is for size in (row.low, row.high)), row.name


@pytest.mark.parametrize("procedure", SESSIONS)
def test_without_an_imperfection_intervals_hold(procedure):
    first = drawn_seed()
    for seed in (first, first + 1):
        found = draw(procedure, seed, only=("none",))
        assert (found.code, found.rows) == (0, ())
        assert found.stated >= 6
        assert found.worst < 5.0, found


ONCE_SILENT = {
    "multipose": (56, 88, 112, 141, 174, 225, 281, 50040, 50208, 50263, 50292, 50348, 50460, 50543),
    "turntable": (
        6,
        11,
        33,
        46,
        72,
        105,
        112,
        132,
        138,
        145,
        156,
        186,
        199,
        204,
        237,
        268,
        298,
        70073,
        70205,
        70401,
        80138,
        140122,
        140155,
    ),
    "spin": (48, 72, 161, 209, 70047, 70323, 70507, 80029, 80140, 80142),
    "noise": (50033, 50143, 70123, 70201, 70323, 80003, 140006, 140044, 150186, 150284),
    "thermal": (102, 132, 70200, 70325, 70421, 70475, 70500, 80171, 120021, 120071),
    "align": (
        120025,
        120026,
        120083,
        120090,
        120104,
        120132,
        120173,
        120188,
        120214,
        120279,
        140145,
        140271,
        140516,
    ),
}
"""Seeds whose numbers were once wrong without a word."""


@pytest.mark.parametrize("procedure", ONCE_SILENT)
def test_seeds_that_were_once_silent_are_wrong_no_more(procedure):
    for seed in few(ONCE_SILENT[procedure], 4):
        found = draw(procedure, seed)
        assert not found.is_silent_wrong, found


HOLDS = {
    "a filter that passed for noise": ("align", 140327),
    "a filter of a tenth of a second": ("align", 140012),
    "stamps that scatter and were kept": ("align", 140270),
    "turns one way, of two scales": ("turntable", 140518),
    "a filter of a part of a sample": ("noise", 150246),
    "a level that drifts at the begin": ("noise", 140564),
}
"""Seeds of kinds of errors that once passed without a word, and whose values now hold."""


@pytest.mark.parametrize("kind", HOLDS)
def test_values_hold_in_kinds_once_silent(kind):
    found = draw(*HOLDS[kind])
    assert found.stated
    assert found.worst < 5.0, found


NAMED = {
    ("multipose", "resolution"): (56, 84),
    ("multipose", "dead band"): (174, 258),
    ("turntable", "resolution"): (33, 132),
    ("turntable", "dead band"): (6, 72),
    ("spin", "resolution"): (161, 207),
    ("spin", "dead band"): (48, 209),
}
"""Seeds whose sigmas are made of rounding or of a dead band."""


@pytest.mark.parametrize(("procedure", "row"), NAMED)
def test_what_readings_do_not_resolve_is_named(procedure, row):
    found = [draw(procedure, seed) for seed in NAMED[procedure, row]]
    assert row in found[0].rows
    assert all(each.named for each in found if each.stated), found


def test_a_draw_is_a_function_of_its_seed():
    assert draw("spin", 3, pair=True) == draw("spin", 3, pair=True)
    assert draw("spin", 3) != draw("spin", 4)


def test_a_wrong_number_is_silent_only_with_the_exit_code_of_success():
    wrong = replace(PLAIN, worst=5.1)
    assert wrong.is_silent_wrong
    assert not replace(wrong, code=3).is_silent_wrong
    assert not PLAIN.is_silent_wrong
    assert replace(PLAIN, code=3).is_refused_in_vain
    assert not replace(wrong, code=3).is_refused_in_vain
    assert Judgement.of(wrong.record()) == wrong


def test_a_summary_states_where_a_fault_matters_and_is_named():
    drawn = [
        replace(PLAIN, seed=number, rows=("spikes",), sizes=(size,), worst=worst, code=code, named=named)
        for number, (size, worst, code, named) in enumerate(
            [(0.2, 1.0, 0, False), (2.0, 7.0, 0, False), (5.0, 9.0, 3, True), (9.0, 1.0, 3, True)]
        )
    ]
    found = summary([PLAIN, *drawn])
    assert (found["silent"], found["silent_seeds"], found["refused_in_vain"]) == (1, [1], 1)
    [row] = found["rows"]
    assert (row["matters"], row["named"], row["first_wrong"], row["first_named"]) == (3, 2, 2.0, 5.0)
