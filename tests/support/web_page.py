"""The page that calibrates in a browser: opened from the disk, and run without a browser."""

from __future__ import annotations

import json
import subprocess
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import pytest

import tumble
from patience import PATIENCE
from tumble.foundation.errors import TumbleError
from tumble.logs import ReadOptions

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "out" / "web" / "tumble.html"
HEADLESS = ROOT / "out" / "web" / "build" / "headless.mjs"
CORE = ROOT / "target" / "wasm32-unknown-unknown" / "web" / "tumble_web.wasm"


DATE, SECONDS = "2023-11-14T22:13:20Z", "1700000000"
"""Date that page and command write: that of the page, and `SOURCE_DATE_EPOCH` of the command."""


def built(path: Path) -> Path:
    """Returns a file that `make web` builds; fails the test where nobody did."""
    if not path.exists():
        pytest.fail(f"{path.name} is not built; run make web")
    return path


def headless(jobs):
    """Runs jobs by the page's own code, without a browser; returns what a person would be shown of each."""
    lines = "".join(json.dumps(job) + "\n" for job in jobs)
    done = subprocess.run(
        ["node", str(built(HEADLESS)), str(built(CORE))],
        input=lines,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@lru_cache(1)
def found_in(path: Path, **read):
    """Returns what the command finds; once for its file and its exports."""
    options = ReadOptions(
        rate=read.get("rate"),
        serial=read.get("serial", ""),
        gyroscope_unit=read.get("gyroscopeUnit"),
        accelerometer_scale=read.get("accelerometerScale"),
        gyroscope_scale=read.get("gyroscopeScale"),
    )
    return tumble.multipose(path, read=options, raw=read.get("raw", False))


def by_command(path: Path, read):
    """Returns what the command would write, or its line of error without the folders of the log."""
    try:
        found = found_in(path, **read)
    except TumbleError as error:
        return {"failure": str(error).replace(str(path), path.name)}
    return {"text": found.calibration.text(), "warnings": list(found.warnings)}


@contextmanager
def opened_page(browser, *, width: int = 360, scheme: str = "light", locale: str = "en-US", **options):
    """Opens the page from the disk in a browser without network; it makes no request but for itself."""
    context = browser.new_context(
        viewport={"width": width, "height": 780}, color_scheme=scheme, locale=locale, offline=True, **options
    )
    context.set_default_timeout(1000.0 * PATIENCE)
    page = context.new_page()
    page.requests, page.script_errors = [], []
    page.on("request", lambda request: page.requests.append(request.url))
    page.on("pageerror", lambda error: page.script_errors.append(str(error)))
    page.goto(built(PAGE).as_uri())
    page.wait_for_selector("body[data-ready]")
    try:
        yield page
    finally:
        context.close()
    assert page.script_errors == []
    assert [url for url in page.requests if not url.startswith(("data:", "blob:"))] == [PAGE.as_uri()]


def give(page, *paths: Path) -> None:
    """Gives logs to the page as a person who chooses them does."""
    page.set_input_files("#log", [str(path) for path in paths])


def downloaded(page, name: str) -> tuple[str, str]:
    """Presses the button of a file; returns the name and the text of what is saved."""
    with page.expect_download() as download:
        page.get_by_role("button", name=name).click()
    return download.value.suggested_filename, Path(download.value.path()).read_text(encoding="utf-8")
