"""Take the picture of `tumble view` in the documentation, from the page itself.

`.venv/bin/python scripts/draw_view.py`
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from check_commands import ROOT, run, snippets
from playwright.sync_api import Page, sync_playwright

PAGE = ROOT / "docs" / "how-to" / "view.md"
PICTURE = ROOT / "docs" / "images" / "view.png"
CHROMIUM = "/usr/bin/chromium"
SIZE = {"width": 1320, "height": 1290}


def main() -> None:
    """Runs the commands of the page, opens their result in a browser, and takes the picture."""
    with tempfile.TemporaryDirectory() as place:
        for snippet in snippets(PAGE.read_text(encoding="utf-8")):
            run(snippet, Path(place))
        command = [sys.executable, "-m", "tumble", "view", "hand/results", "--no-browser", "--json"]
        server = subprocess.Popen(command, cwd=place, stdout=subprocess.PIPE, text=True)
        try:
            assert server.stdout is not None
            _take(json.loads(server.stdout.readline())["address"])
        finally:
            server.terminate()
            server.wait()
    print(PICTURE.relative_to(ROOT))


def _take(address: str) -> None:
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE)  # type: ignore[arg-type]
        page.goto(address)
        page.get_by_text("Procedures that it suits").wait_for()
        _arrange(page)
        page.screenshot(path=PICTURE)
        browser.close()


def _arrange(page: Page) -> None:
    """Selects a rest in the middle of a part of the recording, and shows its spectrum."""
    page.locator(".tumble-plot").first.focus()
    for key in ("ArrowUp", "n", "n", "n", "n", "n", "n", "n"):
        page.keyboard.press(key)
    page.get_by_role("button", name="Spectrum").click()
    page.get_by_role("heading", name="Amplitude spectral density: multipose").wait_for()
    page.wait_for_timeout(800)


if __name__ == "__main__":
    main()
