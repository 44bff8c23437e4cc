"""A session that is interrupted goes on where it was: reloads, a browser that is gone, a server that is killed."""

from __future__ import annotations

import json
import random
import time

from bench_pages import QUICK, BenchProcess, chromium, opened, waited
from repetitions import SOAK
from turntable_sessions import typed

INTERRUPTIONS = 100 if SOAK else 3
KINDS = ("reload", "gone", "killed")
FAULTY = "target_4"


def started(page):
    """Begins a session on the armed table."""
    page.get_by_role("link", name="Run").click()
    page.get_by_label("Time at each pose (s)").fill("2")
    page.get_by_label("Turns for the gyroscopes").uncheck()
    page.get_by_label("Limits", exact=True).select_option("limits.yaml")
    page.get_by_role("button", name="Arm the table").click()
    page.locator(".arm-button[aria-pressed=true]").wait_for()
    page.get_by_role("button", name="Start").click()


def gone_on(page):
    """Takes up whatever the page offers; True once there is a verdict."""
    if page.locator(".verdict-word").count():
        return True
    for name in ("Go on", "Arm the table and go on"):
        button = page.get_by_role("button", name=name, exact=True)
        if button.count() and button.first.is_visible():
            button.first.click()
            page.wait_for_timeout(500)
    return False


def position_of_table(bench):
    kept = json.loads((bench.folder / "bench.json").read_text())
    return typed("table", "position", kept["choice"]["table"]["address"]).out


def test_interrupted_session_recovers_with_the_right_verdicts(tmp_path):
    seed = random.SystemRandom().randrange(2**32)
    print(f"seed {seed}")
    chance = random.Random(seed)
    kinds = [*KINDS, *(chance.choice(KINDS) for _ in range(INTERRUPTIONS - len(KINDS)))]
    options = (str(tmp_path), "--port", "0", "--simulated", *QUICK)
    bench = BenchProcess(tmp_path, *options[1:])
    try:
        with chromium() as browser:
            page = opened(browser, bench.address)
            waited(page, lambda: page.locator(".holder.mine").count())
            started(page)
            for kind in kinds:
                if waited(page, lambda: gone_on(page) or page.locator(".tile").count(), 120.0) is True:
                    break
                page.wait_for_timeout(1000.0 * chance.uniform(0.2, 3.0))
                if kind == "reload":
                    page.reload()
                    page.wait_for_selector(".head")
                elif kind == "gone":
                    page.context.close()
                    time.sleep(4.0)
                    assert position_of_table(bench) == position_of_table(bench)
                    page = opened(browser, f"{bench.address}run")
                    page.locator(".detail", has_text="browser was gone").or_(page.locator(".verdict-word")).wait_for()
                else:
                    bench.kill()
                    bench = BenchProcess(tmp_path, *options[1:])
                    page.context.close()
                    page = opened(browser, bench.address)
                    page.locator(".banner.shown", has_text="was not finished").wait_for()
            waited(page, lambda: gone_on(page), 300.0)
            assert page.locator(".unit-tile.bad .unit-name").all_inner_texts() == [FAULTY]
            assert page.locator(".unit-tile").count() == 5
            assert page.script_errors == []
    finally:
        bench.end()
