"""Times are seconds from the start of a recording; its date, where its stamps are dates, is shown once."""

from __future__ import annotations

import json
import math
import re

import pytest

from dated_logs import EPOCH, START
from tumble.foundation.log_time import DATES, FROM_START, UNKNOWN_TIME, LogTime
from turntable_sessions import typed

STAMP = re.compile(rf"{EPOCH // 10**5}\d{{5}}")
WITHOUT_LOG = ("compare",)


def test_no_page_shows_a_stamp_as_logged(shown):
    pages = {name: page for each in shown.values() for name, page in each.pages.items()}
    assert len(pages) == 11
    for name, page in pages.items():
        assert not STAMP.search(page), name


def test_the_start_stands_once_on_each_page_of_a_dated_log(shown):
    for procedure, each in shown.items():
        for name, page in each.pages.items():
            assert page.count(START) == (procedure not in WITHOUT_LOG), name


def test_no_screen_shows_a_stamp_but_that_of_inspect(shown):
    for procedure, each in shown.items():
        assert bool(STAMP.search(each.screen)) == (procedure == "inspect"), procedure
    assert f"start: {START}, {EPOCH}.000000 s of its clock" in shown["inspect"].screen


def test_the_page_of_an_alignment_bears_the_serials_of_all_units(shown):
    head = shown["align"].pages["align.html"].partition("<main>")[2].partition("<h1>")[0]
    assert "primary SIM-7-0, secondary_1 SIM-7-1, secondary_2 SIM-7-2" in head


def test_json_keeps_the_times_of_the_log(shown):
    spin, redundancy, multipose = (
        json.loads(shown[procedure].json) for procedure in ("spin", "redundancy", "multipose")
    )
    for time in (spin["spins"][0]["start"], redundancy["start"], multipose["rests"][0]["start"]):
        assert EPOCH <= time < EPOCH + 3600


def test_times_of_options_are_from_the_start_as_on_the_page(shown, dated_folder):
    spin = json.loads(shown["spin"].json)["spins"][0]
    start, end = spin["start"] - EPOCH, spin["end"] - EPOCH
    assert f"{start:.1f} to {end:.1f} s" in shown["spin"].pages["spin.html"]
    log = dated_folder / "spin/spin.csv"
    again = typed("spin", log, "--at", f"{start}:{end + 0.1}", "-o", dated_folder / "again", "--json")
    assert json.loads(again.out)["spins"][0]["end"] == pytest.approx(spin["end"], abs=0.2)
    late = typed("spin", log, "--at", f"{spin['start']}:{spin['end']}", "-o", dated_folder / "late")
    assert late.code == 2
    assert "lies outside the log" in late.err
    assert "seconds from its start" in late.err


def test_a_log_that_counts_from_anything_else_shows_no_date(tmp_path):
    typed("simulate", "spin", "--seed", "7", "-o", tmp_path)
    typed("spin", tmp_path / "spin.csv", "-o", tmp_path)
    assert "<span>start</span>" not in (tmp_path / "spin.html").read_text()


def test_times_are_printed_from_the_first_sample():
    time = LogTime(EPOCH + 0.25)
    assert time.at(EPOCH + 12.75) == "12.5 s"
    assert time.span(EPOCH + 0.2, EPOCH + 3.25, 2) == "-0.05 to 3.00"
    assert time.at(EPOCH + 0.2499) == "0.0 s"
    assert time.date == START
    assert UNKNOWN_TIME.at(7.0) == FROM_START.at(7.0) == "7.0 s"


def test_only_stamps_of_the_size_of_dates_are_dates():
    assert [bool(LogTime(start).date) for start in DATES] == [True, True]
    for start in (0.0, 5e8, math.nextafter(DATES[1], math.inf), math.nan, math.inf, -1e9):
        assert LogTime(start).date == ""
