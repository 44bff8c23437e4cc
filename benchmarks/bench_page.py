"""`tumble bench` in a browser: first paint, click to effect, eight units at 1 kHz beside `record`, memory.

`python -m benchmarks.bench_page [--seconds 30] [--units 8] [--rate 1000] [--hours 8] [--no-save]`
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from benchmarks.results import Content, machine, save
from tumble.logs.session import Session

if TYPE_CHECKING:
    from playwright.sync_api import Page

PAINT_GOAL, CLICK_GOAL = 1.0, 0.100
"""s, to the first paint, and from a click to its effect at p95."""
SHARE_GOAL, FRAMES_GOAL, GROWTH_GOAL = 0.4, 30.0, 1.05
"""Cores beyond those of `tumble record`, frames a second, and growth of memory over the hours."""
CHROMIUM = "/usr/bin/chromium"
CLICKS = 60
SPEED, SLOW_RATE = 50.0, 10.0
"""Simulated s in a second, and samples a second of each unit then, for the memory."""
SETTLED = 0.2
"""Share of the time after which memory is compared."""

_CLICK = """async () => {
  const button = document.querySelector(".arm-button");
  const before = button.getAttribute("aria-pressed");
  const began = performance.now();
  button.click();
  while (button.getAttribute("aria-pressed") === before) await new Promise((next) => setTimeout(next, 1));
  await new Promise((next) => requestAnimationFrame(next));
  return (performance.now() - began) / 1000;
}"""
_FRAMES = """(seconds) => new Promise((done) => {
  let count = 0;
  const began = performance.now();
  const frame = (now) => {
    count += 1;
    if (now - began < 1000 * seconds) requestAnimationFrame(frame);
    else done((1000 * count) / (now - began));
  };
  requestAnimationFrame(frame);
})"""


@contextmanager
def serving(folder: Path, *options: str) -> Iterator[tuple[str, int]]:
    """Serves a bench in a process of its own; gives its address, and the number of the process."""
    words = ["bench", "--folder", str(folder), "--port", "0", "--json", *options]
    process = subprocess.Popen([sys.executable, "-m", "tumble", *words], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["operator"], process.pid
    finally:
        process.terminate()
        process.wait()


@contextmanager
def browsing() -> Iterator[Page]:
    """Opens a page of the system's browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        options = ["--no-sandbox", "--enable-unsafe-swiftshader", "--enable-precise-memory-info"]
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=options)
        yield browser.new_page(viewport={"width": 1400, "height": 900})
        browser.close()


@contextmanager
def sending(units: int, rate: float, seconds: float) -> Iterator[tuple[list[str], subprocess.Popen[str]]]:
    """Starts senders, which begin at a line on their standard input."""
    asked = {"over": "udp", "units": units, "rate": rate, "seconds": seconds}
    sender = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.live_senders", json.dumps(asked)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent.parent,
    )
    assert sender.stdin is not None
    assert sender.stdout is not None
    try:
        yield json.loads(sender.stdout.readline()), sender
    finally:
        sender.stdin.close()
        sender.wait()


def begin(sender: subprocess.Popen[str]) -> None:
    """Lets senders begin."""
    assert sender.stdin is not None
    sender.stdin.write("go\n")
    sender.stdin.flush()


def processor_seconds(process: int) -> float:
    """Returns the processor time of a process so far, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(process: int) -> float:
    """Returns the memory of a process, MiB."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def names_of(units: int) -> list[str]:
    """Returns the names of units, the reference first."""
    return ["reference", *(f"target_{number}" for number in range(1, units))]


def recorded(folder: Path, units: int, rate: float, seconds: float) -> Content:
    """Records with `tumble record`: the peer."""
    with sending(units, rate, seconds) as (addresses, sender):
        words = [f"{name}={address}" for name, address in zip(names_of(units), addresses, strict=True)]
        command = [sys.executable, "-m", "tumble", "record", *words, "-o", str(folder), "--json"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        process.stdout.readline()
        begin(sender)
        share = share_while_sent(process.pid, seconds, process.stdout)
        process.terminate()
        process.communicate()
    return {"processor": share, **losses(folder, units, rate, seconds)}


def share_while_sent(process: int, seconds: float, output: Any = None) -> float:  # noqa: ANN401 - a pipe
    """Returns the share of a core that a process takes in the middle of the time of sending."""
    time.sleep(0.2 * seconds)
    before, began = processor_seconds(process), time.monotonic()
    while time.monotonic() - began < 0.6 * seconds:
        # A pipe that nobody reads would stop the process.
        if output is not None:
            output.readline()
        else:
            time.sleep(0.1)
    share = (processor_seconds(process) - before) / (time.monotonic() - began)
    time.sleep(0.2 * seconds + 1.0)
    return share


def losses(session: Path, units: int, rate: float, seconds: float) -> Content:
    """Compares what was recorded with what was sent."""
    sent = units * int(seconds * rate)
    stored = sum(unit.samples or 0 for unit in Session.load(session).units)
    return {"sent": sent, "lost": sent - stored}


def guided(folder: Path, units: int, rate: float, seconds: float) -> Content:
    """Guides a session of as many units in a browser, and looks at paint, clicks and frames meanwhile."""
    with sending(units, rate, seconds) as (addresses, sender):
        named = zip(names_of(units), addresses, strict=True)
        sources = [{"name": name, "address": address} for name, address in named]
        folder.mkdir(parents=True)
        (folder / "bench.json").write_text(
            json.dumps(
                {
                    "sources": sources,
                    "choice": {"word": "turntable", "table": {"address": "simulated:two-axis"}},
                }
            )
        )
        with serving(folder) as (address, process), browsing() as page:
            began = time.monotonic()
            page.goto(address)
            page.locator(".holder.mine").wait_for()
            ready = time.monotonic() - began
            paint = page.evaluate(
                "performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000"
            )
            page.get_by_role("link", name="Run").click()
            page.locator(".arm-button").wait_for()
            clicks = np.array([page.evaluate(_CLICK) for _ in range(CLICKS)])
            page.get_by_role("button", name="Start").click()
            page.locator(".tile").first.wait_for()
            begin(sender)
            page.wait_for_timeout(200.0 * seconds)
            before, since = processor_seconds(process), time.monotonic()
            frames = page.evaluate(_FRAMES, 0.6 * seconds)
            share = (processor_seconds(process) - before) / (time.monotonic() - since)
            page.wait_for_timeout(200.0 * seconds + 1000.0)
            page.get_by_role("button", name="Pause").click()
            page.locator(".instruction", has_text="Paused").wait_for()
            page.wait_for_timeout(1000.0)
    (run,) = folder.glob("*_turntable_1")
    return {
        "processor": share,
        "frames": frames,
        "first_paint": paint,
        "ready": ready,
        "click": {"p50": float(np.median(clicks)), "p95": float(np.quantile(clicks, 0.95)), "count": CLICKS},
        **losses(run / "session", units, rate, seconds),
    }


def aged(folder: Path, hours: float) -> Content:
    """Looks at units for so many hours of their time, and compares the memory of server and tab."""
    options = ("--simulated", "--speed", f"{SPEED:g}", "--rate", f"{SLOW_RATE:g}")
    server, tab = [], []
    with serving(folder, *options) as (address, process), browsing() as page:
        page.goto(address)
        page.locator(".source").first.wait_for()
        looks = 50
        for _ in range(looks):
            page.wait_for_timeout(1000.0 * 3600.0 * hours / SPEED / looks)
            server.append(resident(process))
            page.request_gc()
            tab.append(page.evaluate("performance.memory.usedJSHeapSize") / 2**20)
    settled = int(SETTLED * looks)
    return {
        "hours": hours,
        "times_real_time": SPEED,
        "server": server[-1],
        "tab": tab[-1],
        "server_growth": float(np.median(server[-5:]) / np.median(server[settled : settled + 5])),
        "tab_growth": float(np.median(tab[-5:]) / np.median(tab[settled : settled + 5])),
    }


def measure(units: int, rate: float, seconds: float, hours: float) -> Content:
    """Measures all of it; the peer runs just before."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        return {
            "units": units,
            "rate": rate,
            "seconds": seconds,
            "record": recorded(folder / "recorded", units, rate, seconds),
            "bench": guided(folder / "guided", units, rate, seconds),
            "memory": aged(folder / "aged", hours),
            "machine": machine(),
        }


def missed(content: Content) -> list[str]:
    """Names the goals that are missed."""
    bench, memory = content["bench"], content["memory"]
    beyond = bench["processor"] - content["record"]["processor"]
    checks = {
        "first paint": bench["first_paint"] <= PAINT_GOAL,
        "click": bench["click"]["p95"] <= CLICK_GOAL,
        "processor": beyond <= SHARE_GOAL,
        "frames": bench["frames"] >= FRAMES_GOAL,
        "samples": bench["lost"] == 0,
        "memory": max(memory["server_growth"], memory["tab_growth"]) <= GROWTH_GOAL,
    }
    return [name for name, holds in checks.items() if not holds]


def main() -> int:
    """Measures, prints and keeps the figures; 1 if a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--units", type=int, default=8)
    parser.add_argument("--rate", type=float, default=1000.0)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--no-save", action="store_true")
    options = parser.parse_args()
    content = measure(options.units, options.rate, options.seconds, options.hours)
    Console().print(content)
    if not options.no_save:
        save("bench_page", content)
    goals = missed(content)
    print(f"missed: {', '.join(goals)}" if goals else "all goals are met")
    return bool(goals)


if __name__ == "__main__":
    sys.exit(main())
