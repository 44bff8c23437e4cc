"""Figures that the benchmark of the device computes from the output of the image."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

from benchmarks import footprint  # noqa: E402

SAID = """\
check 10000 {check}
Apply 10 1600
Push 1 160
Push 1 320
Push 1 16000000
Restore 1 160
Restore 1 320
"""
MEMORY = """\
device: start 1
device: stack 3000 bytes: Push, by the function at 0x401
device: stack 9000 bytes: Fit, by the function at 0x401
device: start 2
device: stack 4000 bytes: Push, by the function at 0x401
device: stack 500 bytes: Save, by the function at 0x801
device: stack 60 bytes: all, states and words included
device: state 4000 bytes: Monitor
device: state 96 bytes: Corrections
"""
ONE = 2**footprint.SHIFT


def said(checked):
    """Output of an image whose timer counts as many instructions in the loop of the check."""
    return SAID.format(check=checked * ONE)


def test_frequent_phase_has_mean_median_and_largest():
    instructions = footprint.understood(said(footprint.CHECKED + 13))
    assert instructions["Apply"]["mean"] == 10.0
    push = instructions["Push"]
    assert (push["times"], push["sum"]) == (3, 1_000_030.0)
    assert (push["median"], push["largest"]) == (20.0, 1_000_000.0)


def test_all_samples_of_a_spin_and_of_a_fit_count():
    instructions = footprint.understood(
        said(footprint.CHECKED) + "SpinSlice 1 160\nSpinSlice 1 320\nFitDense 1 160\nFitDense 1 480\n"
    )
    whole = [footprint.whole_instructions(instructions, phase) for phase in footprint.WHOLE_GOALS]
    assert whole == [30.0, 40.0]


def test_rare_phase_is_listed_one_by_one():
    instructions = footprint.understood(said(footprint.CHECKED))
    assert instructions["Restore"]["each"] == [10.0, 20.0]
    assert instructions["Push"]["each"] is None


def test_phase_longer_than_the_timer_has_no_figure():
    with pytest.raises(ValueError, match="SpinPush took longer than the timer counts"):
        footprint.understood(said(footprint.CHECKED) + "SpinPush 1 longer\n")


def test_larger_stack_of_both_starts_counts():
    states, stack, functions = footprint.remembered(MEMORY)
    assert states == {"Monitor": 4000, "Corrections": 96}
    assert stack == {"Push": 4000, "Fit": 9000, "Save": 500, "all": 60}
    assert functions == {"Fit": 0x401, "Save": 0x801}


@pytest.mark.parametrize("factor", [0.5, 0.99, 1.01, 2.0])
def test_a_timer_that_counts_anything_but_instructions_is_refused(factor):
    with pytest.raises(ValueError, match="the timer counted"):
        footprint.understood(said(int(footprint.CHECKED * factor)))
