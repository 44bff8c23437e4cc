"""The page of a redundancy replay: whole, self-contained, complete, safe, light and repeatable."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import report_redundancy_cases as cases
from report_reader import Page
from tumble.procedures.redundancy.report import text as words
from tumble.procedures.redundancy.report.page import MOST_ROWS, REDUNDANCY_REPORT
from tumble.report.numbers import MINUS

RESULTS = {
    name: getattr(cases, name)
    for name in ("mission", "quiet", "untriggered", "missing", "unfit", "disputed", "everything", "unseen")
}


@pytest.fixture(scope="module")
def pages():
    return {name: Page(REDUNDANCY_REPORT.render(make())) for name, make in RESULTS.items()}


def headline(page):
    """Everything before the sections."""
    return page.words.partition("Time line")[0]


def rows_after(page, heading):
    """Cells of the rows below the one that begins with `heading`."""
    cells = [[cell.strip() for cell in row] for row in page.rows]
    start = next(place for place, row in enumerate(cells) if row and row[0] == heading)
    return cells[start + 1 :]


def test_top_names_primary_calibrated_successor_and_refusals(
    pages,
):
    top = headline(pages["mission"])
    assert "imu1 is the primary of 2 secondary units" in top
    assert "Calibrated: imu2, with 4.00 mm/s² of specific force and 0.500 mrad/s of angular rate left." in top
    assert "Refused (not better): imu3." in top
    assert "imu1: late (0.110 s), since 89.98 s; imu2 took over at 90.00 s." in top


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("quiet", "Nothing happened"),
        ("untriggered", "No secondary was calibrated: none deviated enough"),
        ("untriggered", "imu1 was the source all the time"),
        ("missing", "imu3 sent nothing"),
        ("unfit", "No unit was ever healthy enough to be the source"),
        ("disputed", "imu1 and imu2 disagree since 46.60 s, and nobody knows which is wrong"),
        ("unfit", "the platform never rested long enough"),
    ],
)
def test_where_there_is_little_to_tell_the_top_says_so(pages, name, sentence):
    assert sentence in headline(pages[name])


def test_top_lists_a_few_reasons_and_counts_the_others(pages):
    top = headline(pages["everything"])
    told = len(re.findall(r"(?:Refused|Abandoned|Not calibrated) \(", top))
    reasons = [cases.EVERY_EVENT[name] for name in ("withheld", "refused", "abandoned")]
    # A calibration under way is no reason to worry, so it is not listed.
    assert f"{sum(map(len, reasons)) - 1 - told} further reasons below" in top
    assert told == 5


def test_every_event_of_the_interface_is_on_the_page_with_its_reason(pages):
    text = pages["everything"].words
    for name, all_figures in cases.EVERY_EVENT.items():
        title = words.event_title(cases.event(0.0, "imu2", name, **all_figures[0]))
        assert title in text, name
        for figures in all_figures:
            if name != "selected" and "reason" in figures:
                assert str(figures["reason"]) in text, (name, figures)


@pytest.mark.parametrize("name", ["withheld", "refused", "abandoned", "unhealthy", "record rejected"])
def test_every_reason_not_to_calibrate_or_trust_has_a_remedy(name):
    for figures in cases.EVERY_EVENT[name]:
        assert words.remedy(cases.event(0.0, "imu2", name, **figures)).endswith("."), figures


def test_events_of_the_documentation_and_of_this_test_are_the_same():
    assert set(cases.EVERY_EVENT) == set(words._EVENTS)


def test_figures_of_a_refusal_carry_the_unit_of_what_was_exceeded():
    def said(**figures):
        return words.event_details(cases.event(0.0, "imu2", "refused", value=0.4, limit=0.1, **figures))

    assert "0.400 m/s² against 0.100 m/s²" in said(sensor="accelerometer", reason="drifting")
    assert "0.400 rad/s against 0.100 rad/s" in said(sensor="gyroscope", reason="drifting")
    assert "0.400 rad against 0.100 rad" in said(sensor="gyroscope", reason="implausible misalignment")
    assert "0.400 m against 0.100 m" in said(sensor="accelerometer", reason="implausible lever arm")
    assert "(0.400 against 0.100)" in said(sensor="gyroscope", reason="implausible scale")


def test_verdict_figures_carry_unit_time_and_agreeing_units():
    def said(**figures):
        return words.event_details(cases.event(0.0, "imu2", "unhealthy", value=0.4, limit=0.1, **figures))

    assert said(sensor="gyroscope", reason="noisy") == "gyroscope, noisy (0.400 rad/s against 0.100 rad/s)"
    likelihood = "(log-likelihood ratio 0.400 against 0.100)"
    step = said(sensor="accelerometer", reason="isolated", ground="own step")
    assert "(share of the difference 0.400 against 0.100)" in step
    assert likelihood in said(sensor="accelerometer", reason="isolated", ground="rest")
    assert likelihood in said(sensor="gyroscope", reason="isolated", ground="own gyroscope")
    assert likelihood in said(sensor="gyroscope", reason="isolated", ground="aiding")
    outlier = said(sensor="accelerometer", reason="out of family", scale=10.0, agreeing=("imu1", "imu3"))
    assert "(0.400 m/s² apart against 0.100 m/s²), over 10.0 s, agreeing: imu1 and imu3" in outlier


def test_every_error_found_is_on_the_page_with_its_sigma(pages):
    rows = rows_after(pages["mission"], "parameter")
    names = [row[0] for row in rows if row]
    for kind in ("bias", "scale", "mounting"):
        assert all(names.count(f"{kind} {axis}") == 2 for axis in "xyz"), kind
    assert all(names.count(f"non-orthogonality {pair}") == 2 for pair in ("xy", "yz", "zx"))
    assert all(names.count(f"lever arm {axis}") == 1 for axis in "xyz")
    assert ["bias x", "0.3000", "0.0010"] in [row[:3] for row in rows]
    assert ["bias y", f"{MINUS}30.00", "0.10"] in [row[:3] for row in rows]
    assert ["lever arm x", "21.00", "0.20"] in [row[:3] for row in rows]
    # A change of an axis by one percent of its length is a scale error of one percent.
    assert ["scale x", "1.000", "0.010"] in [row[:3] for row in rows]


def test_unobservable_value_has_its_reason_and_no_number(pages):
    page = pages["unseen"]
    rows = rows_after(page, "parameter")
    assert ["lever arm x", "not observable: the motion did not show it"] in [row[:2] for row in rows]
    # The first column of M was not shown: hidden is what hangs on it, not the scale of y and z.
    reason = "not observable: the motion did not show all of M that it depends on"
    assert ["scale x", reason] in [row[:2] for row in rows]
    assert ["non-orthogonality xy", reason] in [row[:2] for row in rows]
    assert "shown along 2 of 3 directions only" in headline(page)
    assert "Its residual was never measured." in page.words
    assert "stored before the replay" in page.words


def test_secondary_minus_primary_is_bias_before_and_noise_after(pages):
    cells = [[cell.strip() for cell in row] for row in pages["mission"].rows]
    found = {tuple(row[:3]): row[3:5] for row in cells if len(row) == 6 and row[0] == "imu2"}
    before, after = found["imu2", "accelerometer", "in motion"]
    bias = np.linalg.norm(cases.ACCELEROMETER_BIAS) / np.sqrt(3.0)
    assert before.endswith(" m/s²")
    assert float(before.split()[0]) == pytest.approx(bias, rel=0.02)
    assert after.endswith(" m/s²")
    assert float(after.split()[0]) == pytest.approx(cases.LEFT_IN_FORCE, rel=0.1)


def test_settings_that_differ_from_their_defaults_come_first(pages):
    text = pages["mission"].words.rpartition(" Settings ")[2]
    changed, folded, others = text.partition("All other settings")
    assert folded
    assert "secondary_accelerometer_threshold last+0.05 (default 0.1)" in changed
    assert "return_after 5 (default none)" in changed
    assert "rest_specific_force_scatter" in others
    assert "rest_specific_force_scatter" not in changed


def test_names_with_signs_of_html_do_not_become_html(tmp_path):
    hostile = "<script>alert('x')</script>&\"$\\frac"
    made = cases.everything()
    changed = replace(
        made,
        primary="<b>1</b>",
        secondaries=(hostile, "imu3"),
        events=tuple(
            replace(each, unit=hostile, figures={**each.figures, "detail": "<i>d</i>"})
            for each in made.events
        ),
        errors=tuple(replace(each, unit=hostile) for each in made.errors),
        traces=tuple(
            replace(trace, name=name)
            for trace, name in zip(made.traces, ("<b>1</b>", hostile, "imu3"), strict=True)
        ),
        warnings=("<u>w</u>",),
    )
    REDUNDANCY_REPORT.write(changed, tmp_path / "redundancy.html")
    text = (tmp_path / "redundancy.html").read_text()
    assert not set(Page(text).tags) & {"script", "i", "u"}
    for raw in ("<script>", "<b>1", "<i>d", "<u>w"):
        assert raw not in text


def test_day_of_eight_units_is_below_2_mb_and_states_its_omissions():
    made = cases.long_day()
    text = REDUNDANCY_REPORT.render(made)
    assert len(text.encode()) < 2_000_000
    page = Page(text)
    refused = sum(event.event == "refused" for event in made.events)
    assert f"{refused - MOST_ROWS} more are in events.jsonl." in page.words


def test_non_finite_figures_are_words():
    made = cases.mission()
    broken = cases.event(
        3.0,
        "imu2",
        "evaluated",
        sensor="accelerometer",
        check="norm",
        deviation=float("nan"),
        threshold=float("inf"),
        exceeded=True,
    )
    page = Page(REDUNDANCY_REPORT.render(replace(made, events=(*made.events, broken))))
    assert "norm unknown > unknown" in page.words
    assert not re.search(r"\b(nan|inf)\b", page.words)


def test_a_notebook_shows_the_summary_and_every_error():
    table = cases.mission()._repr_html_()
    assert "took over" in table
    page = Page(table)
    assert sum(len(row) == 6 and row[2].startswith("bias") for row in page.rows) == 6


@pytest.mark.parametrize(
    ("name", "verdict", "all_well", "badge"),
    [
        ("mission", "not calibrated", False, "imu1 failed, imu2 in use, not all calibrated"),
        ("quiet", "fail", False, "no unit in use"),
        ("untriggered", "pass", True, "imu1 in use"),
        ("missing", "not calibrated", False, "imu1 failed, imu2 in use"),
        ("unfit", "fail", False, "imu1 failed, no unit in use"),
        ("disputed", "fail", False, "imu1 in use, output in doubt"),
    ],
)
def test_the_badge_is_the_state_at_the_end(pages, name, verdict, all_well, badge):
    result = RESULTS[name]()
    assert result.verdict == verdict
    assert result.all_well is all_well
    assert badge in headline(pages[name])


def test_the_top_says_of_each_unit_how_it_stood_at_the_end(pages):
    top = headline(pages["mission"])
    assert re.search(r"imu1\s+✕\s+Unhealthy\s+late \(0\.110 s\), since \d", top)
    assert re.search(r"imu2\s+●\s+Adopted\s+at \d", top)
    assert re.search(r"imu3\s+○\s+Refused\s+not better, at \d", top)


def test_top_names_both_sides_of_a_disagreement_at_the_end(pages):
    top = headline(pages["disputed"])
    assert re.search(r"imu1\s+≠\s+Disagree\s+with imu2, since 46\.60 s", top)
    assert re.search(r"imu2\s+≠\s+Disagree\s+with imu1, since 46\.60 s", top)


def test_a_faster_machine_writes_the_same_page():
    made = cases.mission()
    faster = replace(made, replay_rate=10.0 * made.replay_rate)
    assert REDUNDANCY_REPORT.render(faster) == REDUNDANCY_REPORT.render(made)


def keys_of(result):
    found = re.findall(r'<p class="key">(.*?)</p>', REDUNDANCY_REPORT.render(result))
    return [" ".join(re.sub(r"<span[^>]*>[^<]*</span>", "", key).split()) for key in found]


@pytest.mark.parametrize("name", RESULTS)
def test_keys_explain_what_a_page_draws_and_nothing_else(name):
    result = RESULTS[name]()
    adopted = any(event.event == "adopted" for event in result.events)
    exceeded = {event.figures["check"] for event in result.events if event.figures.get("exceeded")}
    for key in keys_of(result):
        if "compensated" in key:
            assert ("adopted" in key) == adopted, key
        else:
            assert {check for check in ("norm", "vector") if f"{check} exceeded" in key} == exceeded, key
