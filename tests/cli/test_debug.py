"""`--debug` and `TUMBLE_DEBUG`: what was read and rejected, and when; nothing where nobody asks."""

from __future__ import annotations

import logging
import re
import subprocess
import sys

import pytest

import tumble
from turntable_sessions import typed

LINE = re.compile(r"^tumble: +\d+ ms (tumble\.[\w.]+): (.+)$", re.MULTILINE)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spin")
    assert typed("simulate", "spin", "-o", folder).code == 0
    return folder / "spin.csv"


def said(text):
    return LINE.findall(text)


@pytest.mark.parametrize(
    ("words", "variables"),
    [(("--debug", "spin"), {}), (("spin", "--debug"), {}), (("spin",), {"TUMBLE_DEBUG": "1"})],
)
def test_a_run_says_what_it_reads_finds_and_writes(log, tmp_path, monkeypatch, words, variables):
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    done = typed(*words, log, "-o", tmp_path)
    assert done.code == 0
    told = dict(said(done.err))
    assert "csv, accelerometer and gyroscope in m/s^2" in told["tumble.logs.reading"]
    assert re.search(r"rests, \d+ turns", told["tumble.acquisition.acquire"])
    assert told["tumble.foundation.files"] == f"wrote {tmp_path / 'spin.yaml'}"
    assert told["tumble.cli"] == "done"


def test_what_was_rejected_is_said_with_why(log, tmp_path):
    assert typed("simulate", "spin", "--slow-turn", "0.1", "-o", tmp_path).code == 0
    told = said(typed("multipose", tmp_path / "spin.csv", "--debug", "-o", tmp_path / "out").err)
    line = "spin: 0.100 to 4.000 s is no rest: gravity drifts: a slow turn"
    assert ("tumble.acquisition.acquire", line) in told


def test_a_mistake_has_its_traceback_before_its_line(log, tmp_path):
    done = typed("multipose", log, "--debug", "-o", tmp_path)
    assert done.code == 2
    traceback, _, line = done.err.partition("tumble: error: ")
    assert "Traceback (most recent call last)" in traceback
    assert line.count("\n") == 1


@pytest.mark.parametrize("value", ["", "0"])
def test_nothing_is_said_where_nobody_asks(log, tmp_path, monkeypatch, value):
    monkeypatch.setenv("TUMBLE_DEBUG", value)
    assert typed("spin", log, "-o", tmp_path).err == ""


def test_logging_is_not_imported_for_it():
    code = "import sys; sys.argv = ['tumble', '--version']\n"
    code += "from tumble.cli.main import main\ntry: main()\n"
    code += "except SystemExit: print('tumble.cli.debug_output' in sys.modules, 'logging' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "True False"


def test_python_has_it_by_logging(log, caplog):
    with caplog.at_level(logging.DEBUG, logger="tumble"):
        tumble.spin(log)
    assert "tumble.acquisition.acquire" in {record.name for record in caplog.records}
    assert not logging.getLogger("tumble").handlers


def test_two_dashes_end_options():
    assert "--debug: no such file" in typed("inspect", "--", "--debug").err
