"""What the benchmark of the device makes of what the image says."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks import footprint  # noqa: E402

SAID = """\
check 10000 {check} 0
Apply 10 12800 0
Push 4 2560 1280
Fit 0 0 0
bytes Monitor 4000
"""
ONE = 2**footprint.SHIFT


def said(checked):
    """What an image says whose timer counts as many instructions in the loop of the check."""
    return SAID.format(check=checked * ONE)


def test_instructions_are_means_and_largest_and_bytes_are_kept_apart():
    instructions, sizes = footprint.understood(said(footprint.CHECKED + 13))
    assert instructions == {
        "Apply": {"times": 10, "mean": 10.0, "largest": 0},
        "Push": {"times": 4, "mean": 5.0, "largest": 10},
        "Fit": {"times": 0, "mean": 0.0, "largest": 0},
    }
    assert sizes == {"Monitor": 4000}


@pytest.mark.parametrize("factor", [0.5, 0.99, 1.01, 2.0])
def test_a_timer_that_counts_anything_but_instructions_is_refused(factor):
    with pytest.raises(ValueError, match="the timer counted"):
        footprint.understood(said(int(footprint.CHECKED * factor)))
