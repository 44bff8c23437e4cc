"""Orders that no run can carry out are refused in one line, before anything is opened or written."""

from __future__ import annotations

import pytest

from tumble.foundation.errors import TumbleError
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.run import run_kind

UNITS = {"a": "udp://:9", "b": "udp://:10"}
BOTH = {"a": "reference", "b": "target"}
REFUSED = {
    "two units in many orientations": ("multipose", {}, "one unit at a time"),
    "two units on one robot": ("spin", {}, "one unit at a time"),
    "an answer out of bounds": ("noise", {"options": {"duration": -1.0}}, "is no number of 0"),
    "a set without a primary": (
        "redundancy",
        {"roles": dict.fromkeys(UNITS, "secondary")},
        "one primary, found none",
    ),
    "a set with two primaries": (
        "redundancy",
        {"roles": dict.fromkeys(UNITS, "primary")},
        "one primary, found a, b",
    ),
    "no reference": ("turntable", {"roles": {"b": "target"}}, "one reference, found none"),
    "no target": ("turntable", {"roles": {"a": "reference"}}, "no target"),
    "a table that is not armed": (
        "turntable",
        {"roles": BOTH, "table": TableOrder(address="simulated:two-axis")},
        "not armed",
    ),
    "a goal that is none": ("turntable", {"roles": BOTH, "options": {"until": "drift 1"}}, "--until"),
}
"""Word of the run, its order beside the units, and the mistake in it."""


@pytest.mark.parametrize("name", REFUSED)
def test_an_order_that_cannot_be_carried_out_is_refused(name, tmp_path):
    word, order, mistake = REFUSED[name]
    with pytest.raises(TumbleError) as refused:
        run_kind(word).begin(RunOrder(folder=tmp_path, sources=UNITS, **order))
    assert mistake in str(refused.value)
    assert "\n" not in str(refused.value)
    assert list(tmp_path.iterdir()) == []
