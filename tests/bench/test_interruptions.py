"""An interrupted session goes on where it was: reloads, a browser that is gone, a server that is killed."""

from __future__ import annotations

import json
import random

from bench_pages import LIMITS, QUICK, BenchProcess, chromium, gone_on, opened, waited, write_limits
from repetitions import SOAK, drawn_seed
from tumble.bench.run_folder import runs_in
from tumble.foundation import clock
from turntable_sessions import typed

INTERRUPTIONS = 100 if SOAK else 1
KINDS = ("reload", "killed", "socket", "second browser", *(["gone"] if SOAK else []))
"""`test_takeover` takes browsers away by the simulated clock."""
FAULTY = "target_4"


def started(page):
    """Begins a session on the armed table."""
    page.get_by_label("Time at each pose (s)").fill("2")
    page.get_by_label("Turns for the gyroscopes").uncheck()
    page.get_by_label("Limits", exact=True).select_option(LIMITS)
    page.get_by_role("button", name="Arm the table").click()
    page.locator(".arm-button[aria-pressed=true]").wait_for()
    page.get_by_role("button", name="Start").click()


def position_of_table(bench):
    kept = json.loads((bench.folder / "bench.json").read_text())
    return typed("table", "position", kept["choice"]["table"]["address"]).out


class InterruptedSession:
    """A session, the browser that shows it, and the server, which both come and go."""

    def __init__(self, folder, browser):
        self.folder = folder
        write_limits(folder)
        self.browser = browser
        self.bench = self.served()
        self.page = opened(browser, self.bench.address)
        self.page.locator(".holder.mine").wait_for()
        self.page.get_by_role("link", name="Run").click()
        started(self.page)

    def served(self):
        return BenchProcess(self.folder, "--port", "0", "--simulated", *QUICK)

    def opened(self):
        """Opens the screen at which the session is."""
        screen = "result" if self.bench.is_finished() else "run"
        return opened(self.browser, f"{self.bench.address}{screen}")

    def is_done(self):
        return gone_on(self.page)

    def is_under_way(self):
        """Returns whether a run that can go on, as it is recorded, or its result is shown."""
        is_shown = self.page.locator(".stop-bar.shown").count() > 0
        return self.is_done() or (is_shown and runs_in(self.folder)[0].has_recording)

    def wait_for_verdict(self):
        """Waits until the session is calibrated, and compares what is found with the truth."""
        waited(self.page, self.is_done)
        bad = self.page.locator(".unit-tile.bad")
        assert bad.locator(".unit-name").all_inner_texts() == [FAULTY], bad.all_inner_texts()
        assert self.page.locator(".unit-tile").count() == 5

    def repeat(self):
        """Begins the same session once more; the browser before may have held the bench."""
        self.page.locator(".holder.mine").wait_for()
        self.page.get_by_role("button", name="Repeat").click()
        self.page.get_by_role("button", name="Start").wait_for()
        started(self.page)

    def interrupt(self, kind):
        getattr(self, kind.replace(" ", "_"))()
        assert self.page.script_errors == []

    def reload(self):
        self.page.reload()
        self.page.wait_for_selector(".head")

    def gone(self):
        """Takes the browser away while the table moves, which then stands still."""
        before = position_of_table(self.bench)
        # A long recording takes a while to be read again before the table goes on.
        waited(self.page, lambda: position_of_table(self.bench) != before or self.is_done())
        self.page.context.close()
        clock.sleep(4.0)
        stopped = position_of_table(self.bench)
        clock.sleep(1.5)
        assert position_of_table(self.bench) == stopped
        self.page = self.opened()
        why = self.page.locator(".detail", has_text="browser was gone")
        why.or_(self.page.locator(".verdict-word")).first.wait_for()

    def killed(self):
        self.bench.kill()
        self.page.context.close()
        self.bench = self.served()
        self.page = opened(self.browser, self.bench.address)
        offered = self.page.locator(".banner.shown", has_text="was not finished")
        # A server that was killed as it wrote the verdict has nothing to offer but that.
        if self.bench.is_finished():
            self.page.get_by_role("button", name="Show result").first.click()
        else:
            offered.wait_for()

    def socket(self):
        """Cuts the line; the page opens another."""
        self.page.evaluate("window.socket.io.engine.close()")
        self.page.locator("body:not(.connected)").wait_for()
        self.page.locator("body.connected").wait_for()

    def second_browser(self):
        """Hands the bench over to another browser, and the first one goes."""
        self.page.locator(".holder.mine").wait_for()
        other = self.opened()
        other.get_by_role("button", name="Ask for the bench").click()
        self.page.get_by_role("button", name="Hand over").click()
        other.locator(".holder.mine").wait_for()
        self.page.context.close()
        self.page = other


def test_interrupted_session_recovers_with_the_right_verdicts(tmp_path):
    chance = random.Random(drawn_seed())
    # Each kind comes before any comes again.
    kinds = [kind for _ in range(INTERRUPTIONS) for kind in chance.sample(KINDS, len(KINDS))][:INTERRUPTIONS]
    with chromium() as browser:
        session = InterruptedSession(tmp_path, browser)
        try:
            while kinds:
                waited(session.page, session.is_under_way)
                if SOAK:
                    clock.sleep(chance.uniform(0.2, 3.0))
                if session.is_done():
                    session.wait_for_verdict()
                    session.repeat()
                    continue
                kind = kinds.pop()
                print(kind, flush=True)
                session.interrupt(kind)
            session.wait_for_verdict()
        finally:
            session.bench.end()
