"""Every table of the benchmarks stands on one page, and every page is in the menu."""

from __future__ import annotations

from collections import Counter

from benchmarks.report import PAGES, ROOT, SUMMARIES, TABLES, subjects
from benchmarks.results import measured
from benchmarks.subjects import SUBJECTS


def test_every_table_stands_on_one_page():
    placed = Counter(name for tables in PAGES.values() for name in tables if name in TABLES)
    assert placed == Counter(TABLES.keys())
    assert {name for tables in PAGES.values() for name in tables} == {*TABLES, *SUMMARIES}


def test_every_page_of_a_subject_is_in_the_menu_and_the_summary():
    menu = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    summary = (ROOT / "docs" / "benchmarks" / "README.md").read_text(encoding="utf-8")
    for subject in SUBJECTS:
        assert f"benchmarks/{subject.page}.md" in menu
        assert f"({subject.page}.md)" in summary


def test_the_summary_counts_every_goal_once():
    from benchmarks.goals import all_goals

    results = measured([*TABLES])
    counted = [line.split("|")[3].split() for line in subjects(results) if " of " in line.split("|")[3]]
    goals = all_goals(results)
    assert sum(int(cells[0]) for cells in counted) == sum(goal.is_met for goal in goals)
    assert sum(int(cells[2]) for cells in counted) == len(goals)
