"""Properties of the pages of all procedures: self-contained, repeatable, readable on paper and aloud."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

import report_fixtures as sessions
import report_redundancy_cases as missions
import report_spin_cases as spins
from made_up_pages import PAGES, RESULTS, aligned, write_pages
from report_reader import Page
from tumble.foundation.errors import OutputError
from tumble.procedures.align.report.page import ALIGN_REPORT
from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT
from tumble.procedures.spin.report.page import SPIN_REPORT
from tumble.procedures.turntable.report.pages import write_reports
from tumble.report.text import VERDICT_SIGNS
from turntable_sessions import typed

WARNING = "1 % of it would be 0.098 m/s^2, it differs by -1.05 ms"
PRINTED = "1 % of it would be 0.098 m/s², it differs by \N{MINUS SIGN}1.05 ms"
NAMES = ("turntable", "target", "spin", "redundancy", "align")
LARGEST = 600_000
"""Bytes of a page that opens at once on a phone."""
NO_VALUE = re.compile(r"\b(nan|inf|None|True|False|array)\b")
SUPPORT = str(Path(__file__).parents[1] / "support")


@pytest.fixture(scope="module")
def every_page(tmp_path_factory, shown):
    """Every page that is made up, and those that the commands wrote, by name."""
    folder = tmp_path_factory.mktemp("made up")
    write_pages(folder)
    made = {path.stem: path.read_text(encoding="utf-8") for path in folder.iterdir()}
    written = {f"{word} {name}": page for word, each in shown.items() for name, page in each.pages.items()}
    return made | written


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    batch = sessions.batch()
    first = replace(batch.targets[0], warnings=(WARNING,))
    paths = write_reports(replace(batch, targets=(first,), warnings=(WARNING,)), folder)
    return {
        "turntable": paths[0].read_text(),
        "target": paths[1].read_text(),
        "spin": SPIN_REPORT.render(replace(spins.several(), warnings=(WARNING,))),
        "redundancy": REDUNDANCY_REPORT.render(replace(missions.mission(), warnings=(WARNING,))),
        "align": ALIGN_REPORT.render(replace(aligned(), warnings=(WARNING,))),
    }


def style(page):
    return page.partition("<style>")[2].partition("</style>")[0]


def test_pages_are_well_formed_and_need_nothing_from_outside(every_page):
    files = {name.rpartition(" ")[2] for name in every_page} | {
        f"{target.name}.html" for target in sessions.batch().targets
    }
    for name, text in every_page.items():
        found = Page(text)
        assert found.sources == [], name
        assert not found.tags & {"script", "link", "img", "iframe", "object", "embed", "image"}, name
        for link in found.links:
            assert link.removeprefix("#") in found.ids if link.startswith("#") else link in files, name
        assert set(found.references) <= set(found.ids), name
        assert len(found.ids) == len(set(found.ids)), name
        assert set(re.findall(r"https?://[^\"' <]+", text)) <= {"http://www.w3.org/2000/svg"}, name
        assert "@import" not in text, name


def test_pages_are_light_and_print_numbers_or_words_for_none(every_page):
    for name, text in every_page.items():
        assert len(text.encode()) < LARGEST, name
        assert not NO_VALUE.search(Page(text).words), name


def test_every_colour_of_a_page_is_defined_for_light_and_dark(every_page):
    for name, text in every_page.items():
        light, dark = re.findall(r":root \{(.*?)\}", text, flags=re.DOTALL)
        used = {f"--{colour}:" for colour in re.findall(r"var\(--([\w-]+)\)", text)}
        assert {colour for colour in used if colour not in light or colour not in dark} == set(), name


def test_another_process_with_another_hash_seed_writes_the_same(every_page, tmp_path):
    code = "import sys, pathlib, made_up_pages; made_up_pages.write_pages(pathlib.Path(sys.argv[1]))"
    path = {"PYTHONPATH": os.pathsep.join([SUPPORT, *sys.path]), "PYTHONHASHSEED": "1"}
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True, env=os.environ | path)
    assert len(list(tmp_path.iterdir())) == len(PAGES)
    for written in tmp_path.iterdir():
        assert written.read_text(encoding="utf-8") == every_page[written.stem], written.stem


@pytest.mark.parametrize("name", RESULTS)
def test_a_page_that_cannot_be_made_leaves_what_was_there(name, tmp_path):
    page, make = RESULTS[name]
    result, path = make(), tmp_path / "page.html"
    with pytest.raises(OutputError, match="folder"):
        page.write(result, tmp_path / "missing" / "page.html")
    path.write_text("the last page")
    with pytest.raises(AttributeError):
        page.write(None, path)
    assert path.read_text() == "the last page"
    path.unlink()
    path.mkdir()
    with pytest.raises(OutputError, match=r"page\.html"):
        page.write(result, path)
    assert [each.name for each in tmp_path.iterdir()] == ["page.html"]


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
