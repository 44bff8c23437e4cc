"""Whoever only looks changes nothing that pages share, whatever is sent by whichever way."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bench_client import BenchClient
from bench_pages import BenchProcess
from made_up_fleets import write_fleets
from repetitions import SOAK, drawn_seed
from tumble.bench.log.bounds import MOST_KEPT
from tumble.bench.page.frame import MOST_UNOPENED
from turntable_sessions import typed

SUPPORT = Path(__file__).parents[1] / "support"
ORDER = {"sources": {}, "reading": {}, "table": {"address": "simulated:two-axis"}}
UNIT = {"name": "a", "serial": "1", "verdict": "passed", "word": "pass", "reasons": [], "furthest": []}


def write_run(folder, name, outcome=None):
    """Writes the folder of a run that was recorded, with an outcome where it was calibrated."""
    run = folder / name
    (run / "session").mkdir(parents=True)
    (run / "session" / "session.yaml").write_text("")
    (run / "order.json").write_text(json.dumps({"word": "turntable", "order": ORDER}))
    if outcome is not None:
        (run / "outcome.json").write_text(json.dumps({"decision": "", "outcome": outcome}))
    return run


@pytest.fixture
def folder(tmp_path):
    """A folder with all that a page can act on: jobs, a registry with a unit, runs."""
    folder = tmp_path / "bench"
    folder.mkdir()
    write_fleets(folder)
    typed("registry", "init", folder / "lab.db", "--laboratory", "Inertial laboratory")
    assert typed("simulate", "spin", "--turns", "2", "--seed", "7", "-o", tmp_path).code == 0
    made = typed("spin", tmp_path / "spin.csv", "-o", tmp_path / "r", "--registry", folder / "lab.db")
    assert made.code in (0, 3), made.err
    unit = {**UNIT, "calibration": None, "page": None}
    outcome = {"verdict": "passed", "units": [unit], "files": {}, "reasons": [], "complete": True}
    os.utime(write_run(folder, "2026-01-01_turntable_1", outcome) / "order.json", (1.0, 1.0))
    write_run(folder, "2026-01-02_turntable_1")
    return folder


def test_no_message_of_a_viewer_changes_anything(folder):
    done = subprocess.run(
        [
            sys.executable,
            str(SUPPORT / "viewer_attack.py"),
            str(folder),
            str(drawn_seed()),
            "16" if SOAK else "1",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["changes"] == []
    # The same messages from the operator change state, so that this law is not empty.
    changed = {part for _, parts in found["control"] for part in parts}
    assert {"choice", "armed", "sources", "files"} <= changed
    assert found["sent"] > 500
    assert found["unopened"] == MOST_UNOPENED
    assert "Traceback" not in done.stderr


def test_a_page_keeps_few_curves_however_often_they_are_asked_for(folder):
    run = write_run(folder, "2026-01-03_turntable_1")
    (run / "session" / "session.yaml").unlink()
    made = typed("record", f"robot=replay:{folder.parent / 'spin.csv'}?speed=max", "-o", run / "session")
    assert made.code == 0, made.err
    bench = BenchProcess(folder, "--port", "0", "--host", "127.0.0.2")
    try:
        with BenchClient(bench.served["viewer"], "/log") as page:
            page.click(run.name)
            seen = set()
            for _ in range(2 * MOST_KEPT):
                page.emit(page.wait(lambda: labelled(page, "Spectrum")), "click")
                seen |= page.wait(lambda before=frozenset(seen): curves(page) - before)
            page.wait(lambda: len(curves(page)) == MOST_KEPT)
    finally:
        bench.end()


def labelled(page, label):
    """Returns the number of the button with a label of Quasar; None where there is none yet."""
    labels = {each.get("props", {}).get("label"): number for number, each in tuple(page.elements.items())}
    return labels.get(label)


def curves(page):
    """Returns the numbers of the headings of curves."""
    return {
        number
        for number, each in tuple(page.elements.items())
        if (each.get("text") or "").startswith("Amplitude spectral density")
    }
