"""Whoever only looks changes nothing that pages share, whatever is sent by whichever way."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from made_up_fleets import write_fleets
from repetitions import SOAK, drawn_seed
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
    # Screens ask registries and open recordings beside the event loop, which has a stop to heed.
    assert found["in_loop"] == []
    assert {"units", "results", "history_page", "jobs", "summary", "open_viewing"} <= set(found["beside"])
    # To look for garbage through all that a server has as it begins would take 70 ms.
    assert found["kept"] > 50_000
    assert "Traceback" not in done.stderr
