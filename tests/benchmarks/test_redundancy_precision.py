"""Single precision, as on a device, decides as double does."""

import pytest
from benchmarks import redundancy_precision
from benchmarks.redundancy_draw import CYCLE
from benchmarks.redundancy_precision import (
    TOLERANCE,
    compared,
    differences,
    said,
    summary,
)
from hypothesis import given
from hypothesis import strategies as st

from repetitions import repetitions

TIMES = st.lists(st.floats(0.0, 100.0), max_size=6).map(sorted)


def named(time, unit=1, reason="out of family"):
    return (time, unit, "unhealthy", {"reason": reason, "value": 0.3 + time, "agreeing": [0, 2]})


JUMP = named(50.0)
LATER = 51.0


@pytest.mark.parametrize(
    ("other", "found"),
    [
        ([JUMP], 0),
        ([named(50.0 + TOLERANCE / 2)], 0),
        ([named(50.0 - 2 * TOLERANCE)], 2),
        ([named(50.0, unit=2)], 2),
        ([named(50.0, reason="noisy")], 2),
        ([], 1),
        ([JUMP, named(LATER)], 1),
    ],
)
def test_decision_is_the_same_for_equal_words_within_two_windows(other, found):
    assert len(differences([JUMP], other)) == found
    assert len(differences(other, [JUMP])) == found


@given(times=TIMES, shifts=st.lists(st.floats(-TOLERANCE / 2, TOLERANCE / 2), min_size=6, max_size=6))
def test_nearly_simultaneous_decisions_are_no_difference(times, shifts):
    apart = [time for index, time in enumerate(times) if not index or time - times[index - 1] > 2 * TOLERANCE]
    shifted = [time + shift for time, shift in zip(apart, shifts, strict=False)]
    assert differences([named(time) for time in apart], [named(time) for time in shifted]) == []


@given(double=TIMES, single=TIMES)
def test_each_decision_is_paired_at_most_once(double, single):
    found = differences([named(time) for time in double], [named(time) for time in single])
    alone = [sum(pair[side] is not None for pair in found) for side in (1, 2)]
    assert len(double) - alone[0] == len(single) - alone[1]


def test_a_difference_is_told_with_both_times_and_counted_by_kind():
    found = differences([JUMP], [])
    assert said(found[0]) == "unit 1 unhealthy (0, 2) out of family: f64 50.000 s, f32 never"
    flown = [
        {"seed": 0, "kind": "jump", "decisions": 1, "differences": found},
        {"seed": 1, "kind": "ramp", "decisions": 4, "differences": []},
    ]
    counted = summary(flown)
    assert counted["kinds"]["jump"] == {"missions": 1, "decisions": 1, "different": 1}
    assert counted["kinds"]["ramp"]["different"] == 0
    assert list(counted["different"]) == ["0"]


@pytest.mark.parametrize("seed", range(repetitions(len(CYCLE))))
def test_single_precision_decides_as_double_does(seed):
    print(f"seed {seed}")
    flown = compared(seed)
    assert flown["decisions"] > 10
    assert [said(each) for each in flown["differences"]] == []


def test_a_part_of_the_missions_is_shown_and_not_kept(monkeypatch, capsys):
    monkeypatch.setattr(redundancy_precision, "save", lambda *_: pytest.fail("kept"))
    assert redundancy_precision.main(["--missions", "1", "--jobs", "1"]) == 0
    assert "decided differently" in capsys.readouterr().out
