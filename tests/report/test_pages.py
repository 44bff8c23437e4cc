"""Properties of the pages of all procedures: verdict first, readable on paper, on a phone and aloud."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

import report_fixtures as sessions
import report_redundancy_cases as missions
import report_spin_cases as spins
from align_motions import Motion, Sensor, drawn, recordings
from report_reader import Page
from tumble.procedures.align.procedure import align
from tumble.procedures.align.report.page import ALIGN_REPORT
from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT
from tumble.procedures.spin.report.page import SPIN_REPORT
from tumble.procedures.turntable.report.pages import write_reports
from tumble.report.text import VERDICT_SIGNS
from turntable_sessions import typed

WARNING = "1 % of it would be 0.098 m/s^2, it differs by -1.05 ms"
PRINTED = "1 % of it would be 0.098 m/s², it differs by \N{MINUS SIGN}1.05 ms"
NAMES = ("turntable", "target", "spin", "redundancy", "align")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    batch = sessions.batch()
    first = replace(batch.targets[0], warnings=(WARNING,))
    paths = write_reports(replace(batch, targets=(first,), warnings=(WARNING,)), folder)
    units = recordings(Motion(71), (Sensor(rate_hz=100.0), drawn(71, rate_hz=100.0)), 30.0)
    return {
        "turntable": paths[0].read_text(),
        "target": paths[1].read_text(),
        "spin": SPIN_REPORT.render(replace(spins.several(), warnings=(WARNING,))),
        "redundancy": REDUNDANCY_REPORT.render(replace(missions.mission(), warnings=(WARNING,))),
        "align": ALIGN_REPORT.render(replace(align(units[0], units[1:]), warnings=(WARNING,))),
    }


def style(page):
    return page.partition("<style>")[2].partition("</style>")[0]


@pytest.mark.parametrize("name", NAMES)
def test_a_verdict_stands_before_all_else_that_was_found(pages, name):
    body = pages[name].partition("</h1>")[2]
    word = re.search(r'<span class="verdict ([a-z-]+)">', body)
    assert word
    assert word[1] in {verdict.replace(" ", "-") for verdict in VERDICT_SIGNS}
    assert len(re.sub(r"<[^>]*>|\s", "", body[: word.start()])) <= len("15 targets")


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_name_to_be_read_aloud_or_is_passed_over(pages, name):
    figures = [ElementTree.fromstring(svg) for svg in re.findall(r"<svg.*?</svg>", pages[name], re.DOTALL)]
    assert figures
    for figure in figures:
        named = figure.get("role") == "img" and len(figure.get("aria-label", "")) > 20
        assert named or figure.get("aria-hidden") == "true"


@pytest.mark.parametrize("name", NAMES)
def test_signs_of_a_key_are_not_read_aloud(pages, name):
    keys = re.findall(r'<p class="key">.*?</p>', pages[name])
    assert keys or name == "redundancy"
    for key in keys:
        spoken = re.sub(r'<span[^>]*aria-hidden="true"[^>]*>[^<]*</span>|<[^>]*>', "", key)
        assert not re.search(r"[^\w\s(),;:.²/·-]", spoken), spoken


@pytest.mark.parametrize("name", NAMES)
def test_units_and_negative_numbers_are_typeset_in_warnings_too(pages, name):
    found = Page(pages[name])
    assert PRINTED in found.words
    assert "^2" not in found.words
    assert not re.search(r"(?<![^\s(=])-\.?\d", found.words)


@pytest.mark.parametrize("name", NAMES)
def test_printing_unfolds_sections_and_keeps_headings_with_content(pages, name):
    printed = style(pages[name]).partition("@media print")[2]
    opened = re.search(r"details::details-content \{([^}]*)\}", printed)
    assert opened
    assert "content-visibility: visible" in opened[1]
    kept = re.search(r"([^{}]*)\{ break-after: avoid; \}", printed)
    assert kept
    assert {"h2", "h3", "thead", "summary"} <= {each.strip() for each in kept[1].split(",")}


@pytest.mark.parametrize("name", NAMES)
def test_a_chart_too_wide_for_a_narrow_screen_says_that_it_scrolls(pages, name):
    rules = style(pages[name])
    narrow = re.search(r"@media screen and \(max-width: (\d+)px\) \{\s*\.wide \.scroll::before", rules)
    width = re.search(r"\.wide svg, \.wide table \{ min-width: (\d+)px; \}", rules)
    margins = 2 * 24 + 4
    assert int(narrow[1]) == int(width[1]) + margins - 1
    for figure in re.findall(r'<figure class="wide">.*?</figure>', pages[name], re.DOTALL):
        assert '<div class="scroll">' in figure


def test_no_page_names_a_folder_of_the_machine(tmp_path):
    typed("simulate", "spin", "--seed", "7", "-o", str(tmp_path / "logs"))
    typed("simulate", "flight", "--seed", "7", "-o", str(tmp_path / "logs"))
    log = {name: str(tmp_path / "logs" / f"{name}.csv") for name in ("spin", "primary", "secondary_1")}
    units = ("--primary", log["primary"], "--secondary", log["secondary_1"])
    typed("spin", log["spin"], "-o", str(tmp_path / "out"))
    typed("align", *units, "-o", str(tmp_path / "out"))
    typed("redundancy", *units, "-o", str(tmp_path / "out"))
    pages = list((tmp_path / "out").glob("*.html"))
    assert len(pages) == 3
    for page in pages:
        assert str(tmp_path) not in page.read_text()
