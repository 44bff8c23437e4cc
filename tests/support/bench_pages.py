"""A bench that serves pages from a process of its own, and a browser that opens them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

from patience import PATIENCE
from repetitions import SOAK
from tumble.foundation import clock

CHROMIUM = "/usr/bin/chromium"
SOFTWARE_PICTURES = "--enable-unsafe-swiftshader"
"""Draws WebGL without a graphics card."""
LOOKS = ((1400, "light"), (800, "dark"), *(((1400, "dark"), (800, "light")) if SOAK else ()))
"""Widths and colours in which screens are examined."""
BY_LAYOUT = ("color-contrast", "link-in-text-block", "scrollable-region-focusable", "target-size")
"""Rules of axe-core whose result follows from width and colours; the others read what a page holds, which
is the same in each look."""
QUICK = ("--speed", "4", "--rate", "25")
"""Simulated bench on which a session takes seconds."""
TICK = 0.05
"""s between two rounds in which simulated units send: several samples a round cost what one does."""
FORGOTTEN_AFTER = 60.0
"""s after which a bench takes a browser on a busy computer for gone."""
PROGRAM = f"""
from tumble.bench import lateness, server
from tumble.tools.simulate.live import procedure
procedure.TICK = {TICK}
server.FORGOTTEN_AFTER = {FORGOTTEN_AFTER}
lateness.MOST_LATE = {PATIENCE}
from tumble.cli.console import main
main()
"""

LIMITS = "accelerometer.yaml"
"""File of limits that rests alone can show to be kept."""


def write_limits(folder: Path) -> None:
    """Puts the limits into the folder of a bench."""
    text = "schema: tumble-limits/1\naccelerometer: {bias: 1.0, scale: 0.05, non-orthogonality: 2.0}\n"
    (folder / LIMITS).write_text(text)


class BenchProcess:
    """`tumble bench` in a process; `address` is that of operators."""

    def __init__(self, folder: Path, *options: str) -> None:
        words = ["bench", "--folder", str(folder), "--json", *options]
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        line = self.process.stdout.readline()
        assert line, self.process.stderr.read()
        self.served = json.loads(line)
        self.address = self.served["operator"]

    @property
    def site(self) -> str:
        """Scheme, host and port."""
        return self.address.partition("/?")[0].rstrip("/")

    def is_finished(self) -> bool:
        """Returns whether the latest run has its results."""
        runs = sorted(
            self.folder.glob("*_*_*/order.json"), key=lambda path: int(path.parent.name.split("_")[-1])
        )
        return bool(runs) and (runs[-1].parent / "outcome.json").is_file()

    def kill(self) -> None:
        """Ends it as a power cut does."""
        self.process.kill()
        self.process.communicate()

    def end(self) -> str:
        """Ends it as Ctrl-C does; returns what it printed as errors."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.communicate(timeout=PATIENCE)[1]
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


@contextmanager
def serving(folder: Path, *options: str):
    """Serves a bench at a free port while the block runs."""
    bench = BenchProcess(folder, "--port", "0", *options)
    try:
        yield bench
    finally:
        bench.end()


@contextmanager
def chromium():
    """Opens the system's browser; skips the test where there is none."""
    if not Path(CHROMIUM).exists():
        pytest.skip(f"no {CHROMIUM}; scripts/install_test_tools.sh installs it")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", SOFTWARE_PICTURES], timeout=1000.0 * PATIENCE
        )
        try:
            yield browser
        finally:
            browser.close()


def opened(browser, address: str, *, width: int = 1400, scheme: str = "light", **options):
    """Opens a page of a browser of its own, with cookies of its own; errors of its scripts fail the test."""
    context = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, ignore_https_errors=True, **options
    )
    context.set_default_timeout(1000.0 * PATIENCE)
    page = context.new_page()
    page.script_errors = []
    page.on("pageerror", lambda error: page.script_errors.append(str(error)))
    page.goto(address)
    page.wait_for_selector(".head")
    page.wait_for_function("window.did_handshake === true")
    return page


@contextmanager
def held(page):
    """Keeps a screen as it is while the block runs: runs end faster than a busy computer compares screens.

    Updates of the server are shown afterwards.
    """
    page.evaluate("() => { window.waiting = []; socket.onevent = packet => waiting.push(packet); }")
    try:
        yield
    finally:
        page.evaluate("() => { delete socket.onevent; waiting.forEach(packet => socket.onevent(packet)); }")


def await_drawing(page, times: int) -> None:
    """Waits until a page has been drawn so many times."""
    page.wait_for_function(
        """times => {
            window.drawn = (window.drawn ?? 0) + 1;
            return window.drawn > times && !(window.drawn = 0);
        }""",
        arg=times,
    )


def await_rest(page) -> None:
    """Waits until a page has its size and colours: it is drawn with them, and nothing moves to an end."""
    await_drawing(page, 2)
    page.wait_for_function(
        """document.getAnimations().every(
            each => each.playState !== "running" || each.effect.getComputedTiming().endTime === Infinity
        )"""
    )


def waited(page, condition):
    """Waits until a condition of ours is true, and returns what it gave."""
    until = clock.now() + PATIENCE
    while clock.now() < until:
        if found := condition():
            return found
        # Twice asked by a timer of the page: to draw it meanwhile takes a core.
        page.wait_for_function("(window.asked = !window.asked) === false", polling=100)
    raise AssertionError(f"not within the time: {page.locator('body').inner_text()[:500]}")


def gone_on(page):
    """Takes up whatever the page offers to go on with; True once there is a verdict."""
    if page.locator(".verdict-word").count():
        return True
    for name in ("Go on", "Arm the table and go on"):
        button = page.get_by_role("button", name=name, exact=True)
        if button.count() and button.first.is_visible():
            # It may be gone by now, as the run goes on; the page takes a while to show it.
            button.evaluate_all("found => found.forEach(each => each.click())")
            await_drawing(page, 60)
    return False


def scan(page, text: str) -> None:
    """Types as a scanner does: all letters at once, then Enter."""
    page.evaluate(
        """text => {
            const press = { bubbles: true, cancelable: true };
            for (const key of [...text, "Enter"])
                document.body.dispatchEvent(new KeyboardEvent("keydown", { key, ...press }));
        }""",
        text,
    )


def violations(page):
    """Names the rules of axe-core that a screen breaks: all wide and light, those of layout narrow and dark.

    `make soak` holds all rules in all four looks.
    """
    from axe_playwright_python.sync_playwright import Axe

    found = []
    for width, scheme in LOOKS:
        page.set_viewport_size({"width": width, "height": 900})
        page.emulate_media(color_scheme=scheme)
        await_rest(page)
        # A notice that fades has less contrast for a moment, and a line that was lost is looked for.
        page.wait_for_function(
            "!document.querySelector('.q-notification, .nicegui-error-popup[aria-hidden=false]')"
        )
        options = {"resultTypes": ["violations"], "preload": False}
        if not SOAK and (width, scheme) != LOOKS[0]:
            options["runOnly"] = {"type": "rule", "values": BY_LAYOUT}
        results = Axe().run(page, options=options)
        found += [
            f"{width} {scheme} {each['id']}: {each['nodes'][0]['html'][:120]} ({len(each['nodes'])})"
            for each in results.response["violations"]
        ]
    page.set_viewport_size({"width": 1400, "height": 900})
    page.emulate_media(color_scheme="light")
    return found
