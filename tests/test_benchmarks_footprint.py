"""What the benchmark of the device makes of what the image says."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks import footprint  # noqa: E402

SAID = """\
check 10000 {check}
Apply 10 12800
Push 1 1280
Push 1 2560
Push 1 128000000
bytes Monitor 4000
"""
ONE = 2**footprint.SHIFT


def said(checked):
    """What an image says whose timer counts as many instructions in the loop of the check."""
    return SAID.format(check=checked * ONE)


def test_pushes_that_solve_are_counted_and_bytes_are_kept_apart():
    instructions, sizes = footprint.understood(said(footprint.CHECKED + 13))
    assert instructions["Apply"]["mean"] == 10.0
    push = instructions["Push"]
    assert (push["times"], push["median"], push["largest"]) == (3, 20.0, 1_000_000.0)
    assert (push["solving"], push["mean_without_solving"]) == (1, 15.0)
    assert sizes == {"Monitor": 4000}


@pytest.mark.parametrize("factor", [0.5, 0.99, 1.01, 2.0])
def test_a_timer_that_counts_anything_but_instructions_is_refused(factor):
    with pytest.raises(ValueError, match="the timer counted"):
        footprint.understood(said(int(footprint.CHECKED * factor)))
