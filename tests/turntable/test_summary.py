"""Statements of a run on its targets count targets."""

from __future__ import annotations

from types import SimpleNamespace

from tumble.procedures.turntable.summary import ScreenSummary


def warned(target, *warnings):
    return SimpleNamespace(target=target, verdict="calibrated", fails=False, warnings=warnings)


def said_of(*records):
    summary = ScreenSummary(None, len(records))
    for record in records:
        summary.add(record)
    return list(summary.warnings())


def test_warning_at_several_poses_counts_its_target_once():
    knocks = [f"pose {place} was knocked at" for place in range(40)]
    assert said_of(warned("a", *knocks), warned("b", *knocks[:23])) == [
        "2 of 2: such as a: pose 0 was knocked at, and 61 more like it"
    ]
    assert said_of(warned("a", *knocks), warned("b")) == ["a: pose 0 was knocked at, and 39 more like it"]


def test_warning_common_to_all_targets_is_reported_once():
    assert said_of(warned("a", "clock is 5 ppm fast"), warned("b", "clock is 5 ppm fast")) == [
        "2 of 2: clock is 5 ppm fast"
    ]
