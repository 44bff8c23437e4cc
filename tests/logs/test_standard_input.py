"""`-` reads the log that is piped in, and messages name it as it was typed."""

from __future__ import annotations

import io
import subprocess
import sys

import pytest

from log_fixtures import made_up, write_text
from patience import PATIENCE
from turntable_sessions import one_line, typed


@pytest.fixture
def content(tmp_path):
    return write_text(tmp_path / "log.csv", made_up(300, temperature=False)).read_bytes()


def pipe(monkeypatch, content):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


def test_a_log_is_read_from_standard_input(content, monkeypatch):
    pipe(monkeypatch, content)
    done = typed("inspect", "-")
    assert done.code == 0, done.err
    assert "300 samples" in done.out
    assert done.out.startswith("-\n")
    assert "tumble-" not in done.out


def test_a_process_reads_what_is_piped_into_it(content):
    code = "from tumble.cli.main import main; main()"
    command = [sys.executable, "-c", code, "inspect", "-"]
    done = subprocess.run(command, input=content, capture_output=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert b"300 samples" in done.stdout
    assert done.stderr == b""


def test_error_in_a_piped_log_names_standard_input(content, monkeypatch):
    rows = content.split(b"\n")
    rows[100] = b"torn"
    pipe(monkeypatch, b"\n".join(rows))
    assert one_line(typed("inspect", "-").err).startswith("-: line 101 has 1 field ")


def test_empty_pipe_is_reported(monkeypatch):
    pipe(monkeypatch, b"")
    assert one_line(typed("inspect", "-").err).startswith("-: is empty")


def test_a_terminal_is_no_log(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr(sys, "stdin", Terminal())
    assert "nothing is piped in" in one_line(typed("inspect", "-").err)
