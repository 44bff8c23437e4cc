"""`tumble.html` in a browser: its size, how soon it is ready, and how long a recording takes to its verdict.

`python -m benchmarks.web_page [--log FILE FILE] [--runs 5]`, after `make web`.
"""

from __future__ import annotations

import argparse
import gzip
import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PAGE = Path(__file__).parents[1] / "out" / "web" / "tumble.html"
RECORDINGS = Path(__file__).parents[2] / "shared" / "data" / "xsens"
CHROMIUM = "/usr/bin/chromium"
SIZE_GOAL = 600 * 1024
"""Bytes of all of it, packed by gzip."""
READY_GOAL, VERDICT_GOAL = 0.5, 3.0
"""s, from opened to ready, and from a log to its verdict."""


def timed(browser: Browser, logs: list[Path]) -> tuple[float, float]:
    """Opens the page and gives it a log of raw counts; returns s to ready, and from log to verdict."""
    page = browser.new_page(viewport={"width": 360, "height": 780})
    page.goto(PAGE.as_uri())
    page.wait_for_selector("body[data-ready]")
    ready = page.evaluate("performance.getEntriesByName('ready')[0].startTime") / 1000.0
    page.get_by_text("Reading of the log").evaluate("each => each.closest('details').hidden = false")
    page.get_by_text("Reading of the log").click()
    page.get_by_label("Readings are counts").check()
    began = time.perf_counter()
    page.set_input_files("#log", [str(path) for path in logs])
    page.locator("#verdict").wait_for()
    verdict = time.perf_counter() - began
    page.close()
    return ready, verdict


def main() -> int:
    """Measures and prints the figures; 1 if a goal is missed."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    default = [RECORDINGS / "xsens_acc.mat", RECORDINGS / "xsens_gyro.mat"]
    parser.add_argument("--log", type=Path, nargs="+", default=default)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    size = len(gzip.compress(PAGE.read_bytes(), 9))
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        runs = [timed(browser, options.log) for _ in range(options.runs)]
        browser.close()
    ready, verdict = (statistics.median(each) for each in zip(*runs, strict=True))
    Console().print({"bytes, gzip": size, "opened to ready, s": ready, "log to verdict, s": verdict})
    missed = [
        name
        for name, is_missed in (
            ("size", size > SIZE_GOAL),
            ("ready", ready > READY_GOAL),
            ("verdict", verdict > VERDICT_GOAL),
        )
        if is_missed
    ]
    print(f"missed: {', '.join(missed)}" if missed else "all goals are met")
    return bool(missed)


if __name__ == "__main__":
    sys.exit(main())
