"""The table of parameters: value, sigma, limit and how much of it is used, all in one row."""

from __future__ import annotations

import math

from tumble.foundation.results import LimitCheck, Parameter
from tumble.report.parameters import limited_groups, printed_group

AXES = "xyz"


def check(name, value, limit, unit="m/s^2", remark=""):
    return LimitCheck(name, value, limit, unit, not remark and abs(value) <= limit, remark)


def lever_arm(sigma):
    return [Parameter(f"lever arm {axis}", "m", 0.03, sigma, 0.03 - sigma, 0.03 + sigma) for axis in AXES]


def test_a_value_that_was_stated_to_us_is_given_and_has_no_interval():
    group = printed_group("lever arm", lever_arm(0.0), [None] * 3)
    assert {(row.value, row.sigma, row.interval) for row in group.rows} == {("30", "given", "")}
    estimated = printed_group("lever arm", lever_arm(0.001), [None] * 3)
    assert {row.sigma for row in estimated.rows} == {"1.0"}
    assert all(row.interval for row in estimated.rows)


def test_row_states_its_limit_the_share_used_and_the_verdict():
    checks = [check("lever arm x", 0.03, 0.04, "m"), check("lever arm y", 0.03, 0.02, "m"), None]
    rows = printed_group("lever arm", lever_arm(0.001), checks).rows
    assert [(row.limit, row.share, row.kept) for row in rows] == [
        ("± 40", "75 %", True),
        ("± 20", "150 %", False),
        ("", "", None),
    ]


def test_group_is_named_by_the_common_beginning_of_its_rows():
    assert printed_group("lever arm", lever_arm(0.001), [None] * 3).kind == "lever arm"
    assert printed_group("lever arm", lever_arm(0.001)[:1], [None]).kind == ""
    scales = ("gyroscope scale about the axis", "gyroscope scale clockwise")
    mixed = [Parameter(name, "1", 0.0, 0.1, -0.1, 0.1) for name in scales]
    assert printed_group("gyroscope scale", mixed, [None] * 2).kind == "gyroscope scale"


def test_limits_of_what_is_no_parameter_have_rows_too():
    checks = [check(f"accelerometer residual {axis}", 0.002, 0.001) for axis in AXES]
    (group,) = limited_groups("accelerometer", None, checks)
    assert (group.title, group.unit) == ("residual", "mm/s²")
    assert [(row.value, row.limit, row.share, row.kept) for row in group.rows] == [
        ("2.00", "± 1", "200 %", False)
    ] * 3


def test_limits_of_an_uncalibrated_triad_fail_with_the_reason():
    why = "not shown to be within its limit: the gyroscope was not calibrated"
    checks = [check("gyroscope bias x", math.nan, 0.1, "rad/s", why)]
    (group,) = limited_groups("gyroscope", None, checks)
    (row,) = group.rows
    assert (row.value, row.share, row.kept, row.reason) == ("", "", False, why)
    assert limited_groups("accelerometer", None, checks) == ()
