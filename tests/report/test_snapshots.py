"""Text of pages and messages as it was looked at last; `pytest --snapshot-update` accepts what it is now."""

from __future__ import annotations

from dataclasses import replace

import pytest

import report_fixtures as sessions
import report_redundancy_cases as missions
import report_spin_cases as spins
from report_reader import Page
from tumble.foundation.provenance import UNKNOWN
from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT
from tumble.procedures.spin.report.page import SPIN_REPORT
from tumble.procedures.turntable.report.pages import records_of, render_batch, render_target
from turntable_sessions import typed


def lines(page):
    """Text of a page, a line for each piece of it."""
    words = (" ".join(text.split()) for text in Page(page).text)
    return "\n".join(word for word in words if word)


def target(batch):
    return render_target(batch, batch.targets[0])


PAGES = {
    "target": lambda: target(sessions.batch()),
    "batch": lambda: render_batch(sessions.batch(), records_of(sessions.batch())),
    "spin": lambda: SPIN_REPORT.render(replace(spins.several(), provenance=UNKNOWN)),
    "spin not observable": lambda: SPIN_REPORT.render(replace(spins.unobserved(), provenance=UNKNOWN)),
    "redundancy": lambda: REDUNDANCY_REPORT.render(replace(missions.mission(), provenance=UNKNOWN)),
    "redundancy disputed": lambda: REDUNDANCY_REPORT.render(replace(missions.disputed(), provenance=UNKNOWN)),
}

MISTAKES = {
    "no such log": "spin nothing.csv",
    "no sample": "spin empty.csv",
    "no columns": "noise words.csv",
    "unknown option": "multipose --wrong",
    "unknown command": "multipos words.csv",
    "gravity of no place": "spin spin.csv --gravity 12",
    "no reference": "turntable words.csv",
    "a calibration that is none": "apply words.csv spin.csv -o out.csv",
    "a limit of no parameter": "turntable a.csv b.csv --limits limits.yaml",
    "a unit that is none": "inspect spin.csv --accelerometer-unit furlong",
}


@pytest.mark.parametrize("name", PAGES)
def test_the_text_of_a_page_is_as_it_was_looked_at(name, snapshot):
    assert lines(PAGES[name]()) == snapshot


@pytest.mark.parametrize("name", MISTAKES)
def test_a_message_is_as_it_was_looked_at(name, snapshot, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    header = "time,ax,ay,az,gx,gy,gz\n"
    for log in ("spin.csv", "a.csv", "b.csv"):
        (tmp_path / log).write_text(header + "".join(f"{k / 100},0,0,9.8,0,0,0\n" for k in range(500)))
    (tmp_path / "empty.csv").write_text(header)
    (tmp_path / "words.csv").write_text("some words,and others\n1,2\n3,4\n")
    (tmp_path / "limits.yaml").write_text("accelerometer:\n  biass: 0.5\n")
    done = typed(*MISTAKES[name].split())
    assert done.code == 2
    assert done.err == snapshot
