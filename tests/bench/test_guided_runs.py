"""Runs without a table, clicked through in a browser: still log, set, spin, and a unit in a hand.

Each screen is compared with its picture of docs/how-to/bench.md; see `screens` for how to accept a change.
"""

from __future__ import annotations

import re

import pytest

import tumble
from bench_pages import chromium, held, opened, serving, violations, waited
from screens import differences
from tumble.procedures.redundancy.command_files import event_lines
from tumble.procedures.redundancy.settings import RedundancySettings

pytestmark = pytest.mark.random_order(disabled=True)
"""Each test goes on where the one before it ended."""

FAST = ("--speed", "4", "--rate", "50")
"""Simulated bench on which a run takes seconds."""
PATIENT = "late=3"
"""Settings of a set on a computer that is late itself."""
TITLES = {
    "noise": "Still log",
    "redundancy": "Set",
    "spin": "Spin of a robot",
    "multipose": "Many orientations",
}


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("bench"), "--simulated", *FAST, "--registry", "") as found:
        yield found


@pytest.fixture(scope="module")
def page(bench):
    with chromium() as browser:
        page = opened(browser, bench.address, reduced_motion="reduce")
        yield page
        assert page.script_errors == []


def begin(page, word, **answers):
    """Chooses a kind of run on the first screen, answers its questions and starts it."""
    page.locator(".screen-link", has_text="Sources").click()
    choose(page, TITLES[word])
    page.get_by_role("button", name="Continue").click()
    answer_and_start(page, **answers)


def choose(page, title):
    """Chooses a kind of run."""
    page.locator(".kind", has_text=title).first.click()
    page.locator(".kind[aria-pressed=true]", has_text=title).wait_for()


def answer_and_start(page, **answers):
    """Answers the questions of a run, and starts it."""
    page.get_by_role("button", name="Start").wait_for()
    page.locator("details.more summary").click()
    for label, answer in answers.items():
        field = page.get_by_label(re.compile(re.escape(label)))
        field.fill(answer)
        field.press("Tab")
    page.get_by_role("button", name="Start").click()
    page.locator(".stop-bar.shown").wait_for()


def verdict(page):
    """Waits for the verdict of a run; returns it."""
    page.locator(".verdict-word").wait_for()
    return page.locator(".verdict-word").inner_text()


def folder_of(bench, word):
    (found,) = bench.folder.glob(f"*_{word}_*")
    return found


def test_still_log_draws_its_curve_while_it_grows(page, bench):
    begin(page, "noise", **{"Time at rest": "60"})
    words = page.locator(".figure-words").first
    words.wait_for()
    lengths = {re.search(r"Longest average (.*)\.", words.inner_text())[1]}
    waited(
        page,
        lambda: lengths.add(re.search(r"Longest average (.*)\.", words.inner_text())[1]) or len(lengths) > 1,
    )
    assert page.locator(".plot canvas").count() == 2
    assert differences(page, "still-log") == []
    assert "At 1 s: reference" in page.locator(".plot").first.get_attribute("aria-label")
    assert not violations(page)


def test_still_log_ends_with_the_noise_of_the_command(page, bench):
    page.get_by_role("button", name="Finish now").click()
    assert verdict(page) == "Look at it"
    folder = folder_of(bench, "noise")
    (unit, *_) = page.locator(".unit-tile .unit-name").all_inner_texts()
    found = tumble.Calibration.load(folder / f"{unit}.noise.yaml").content()
    again = tumble.noise(f"{folder / 'session'}:{unit}").calibration.content()
    assert found["gyroscope"] == again["gyroscope"]


def test_set_shows_each_unit_its_deviations_and_events(page, bench):
    page.locator(".screen-link", has_text=TITLES["redundancy"]).click()
    answer_and_start(page, **{"Changes of settings": PATIENT})
    assert page.url.endswith("/redundancy")
    page.locator(".state-table tbody tr").nth(2).wait_for()
    waited(page, lambda: "primary (source)" in page.locator(".state-table").inner_text())
    assert page.get_by_role("button", name="Evaluate now").count() == 1
    page.locator(".plot canvas").nth(1).wait_for()
    assert "threshold" in page.locator(".figure .section").nth(1).inner_text()
    assert page.locator(".events .event").count() > 0
    (found,) = waited(page, lambda: compared_without_fault(page))
    assert found == []
    assert not violations(page)


def compared_without_fault(page):
    """Compares the screen of a set in which no unit is at fault; returns a list of what differs, or None.

    A busy computer loses samples of its own simulated units: a line for each unit at fault, for as long as it
    is, pushes down all that is below.
    """
    faults = page.locator(".wrong")
    if faults.count():
        return None
    # Another unit may be the source since: the names have one width wherever its mark is.
    page.evaluate(_SOURCE_FIRST)
    found = differences(page, "set")
    return None if faults.count() else [found]


_SOURCE_FIRST = """() => document.querySelectorAll('.state-table tbody tr').forEach((row, place) => {
    const texts = document.createTreeWalker(row.cells[0], NodeFilter.SHOW_TEXT)
    const name = texts.nextNode()
    if (name) name.data = name.data.replace(' (source)', '') + (place === 0 ? ' (source)' : '')
})"""


def test_finished_set_has_the_events_of_a_replay(page, bench):
    page.get_by_role("button", name="Finish now").click()
    shown = verdict(page)
    folder = folder_of(bench, "redundancy")
    assert page.locator(".unit-tile").count() == 3
    assert (folder / "redundancy.html").exists()
    settings = RedundancySettings.load(bench.folder / "set.yaml").changed([PATIENT])
    units = ["secondary_1", "secondary_2"]
    again = tumble.redundancy("primary", units, log=folder / "session", settings=settings)
    events = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
    assert events == list(event_lines(again))
    # Units of a busy computer are late, in the replay too.
    assert (shown == "Failed") == (again.verdict == "fail")


def test_spin_counts_turns_and_passes(page, bench):
    begin(page, "spin")
    page.locator(".tile.current").first.wait_for()
    page.locator(".instruction", has_text="turning").wait_for()
    with held(page):
        assert differences(page, "spin") == []
        assert not violations(page)
    assert verdict(page) == "Passed"
    assert (folder_of(bench, "spin") / "robot_imu.live.yaml").exists()


def test_sphere_fills_until_the_unit_is_calibrated(page, bench):
    begin(page, "multipose", Orientations="10", **{"Time at rest in each": "3"})
    count = page.locator(".legend-item.good")
    count.wait_for()
    waited(page, lambda: int(re.search(r"\d+", count.inner_text())[0]) >= 4)
    with held(page):
        assert differences(page, "orientations") == []
        assert "orientations held so far: " in page.locator(".sphere").get_attribute("aria-label").lower()
        assert page.locator(".instruction").bounding_box()["height"] >= 24.0
        assert not violations(page)
    assert verdict(page) in ("Passed", "Look at it")
    folder = folder_of(bench, "multipose")
    found = tumble.Calibration.load(folder / "hand_imu.multipose.yaml").content()
    again = tumble.multipose(folder / "session").calibration.content()
    assert found["accelerometer"] == again["accelerometer"]
    assert found["gyroscope"] == again["gyroscope"]
