"""Text over TCP, through a pipe, and from a file that grows."""

from __future__ import annotations

import io
import os
import socket
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest

from live_fixtures import HEADER, first_samples, piped, resting, text_lines
from mavlink_fixtures import highres
from ports import free_port
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live import open_source

pytestmark = pytest.mark.usefixtures("simulated_clock")

TABLE = resting(120)
COMMAND = [sys.executable, "-c", "from tumble.cli.main import main; main()"]


@contextmanager
def listening(*pieces):
    """A port of a device that sends these pieces to whoever connects, then hangs up."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            clock.readable(server.fileno())
            connection, _ = server.accept()
            with connection:
                for piece in pieces:
                    connection.sendall(piece)

        device = clock.thread(serve)
        device.start()
        yield server.getsockname()[1]
        clock.wait(device)


def test_samples_come_over_tcp():
    with listening(text_lines(TABLE)) as port, open_source(f"tcp://127.0.0.1:{port}") as source:
        assert source.name == f"tcp-{port}"
        assert np.array_equal(first_samples(source, len(TABLE)), TABLE)


def test_mavlink_comes_over_tcp():
    with listening(*highres(TABLE)) as port, open_source(f"mavlink:tcp:127.0.0.1:{port}") as source:
        assert np.allclose(first_samples(source, len(TABLE)), TABLE, rtol=0.0, atol=1e-5)


def test_a_connection_that_ends_is_lost_and_no_end_of_the_stream():
    with listening(text_lines(TABLE)) as port, open_source(f"tcp://127.0.0.1:{port}") as source:
        with pytest.raises(LogError, match="connection was lost: was the device switched off"):
            first_samples(source, 1000)
        assert source.line.lost


def test_a_port_at_which_nobody_listens_is_refused():
    with pytest.raises(LogError, match=r"cannot connect: .*; is the device on"):
        open_source(f"tcp://127.0.0.1:{free_port()}").__enter__()


@pytest.mark.parametrize("text", ["-", "stdin:"])
def test_samples_are_piped_in_until_whoever_writes_them_ends(monkeypatch, text):
    data = text_lines(TABLE)
    with piped(monkeypatch, data.rstrip()), open_source(text) as source:
        assert np.array_equal(first_samples(source, 1000), TABLE)


def test_one_of_several_units_that_are_piped_in_is_picked(monkeypatch):
    rows = [f"{name}: {','.join(map(repr, row))}\n" for row in TABLE.tolist() for name in ("a", "b")]
    with piped(monkeypatch, "".join(rows).encode()), open_source("-:b") as source:
        assert np.array_equal(first_samples(source, 1000), TABLE)


def test_a_file_may_stand_in_for_a_pipe(monkeypatch, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(text_lines(TABLE))
    with path.open() as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        with open_source("-") as source:
            assert source.fileno() is None
            assert np.array_equal(first_samples(source, 1000), TABLE)


def test_a_keyboard_is_no_pipe(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    with pytest.raises(LogError, match="nothing is piped in"):
        open_source("stdin:").__enter__()


def test_a_pipe_is_read_by_a_command_as_a_user_types_it(tmp_path):
    told = subprocess.run(
        [*COMMAND, "spin", "--live", "-", "-o", str(tmp_path / "out")],
        input=b"hello\n" * 60,
        capture_output=True,
        check=False,
    )
    assert told.returncode == 2
    assert b"-: 50 lines in a row hold no sample, such as 'hello'" in told.stderr


class Growing:
    """A log that is written while it is read."""

    def __init__(self, path, header=HEADER):
        self.path = path
        path.write_text(f"# a logger\n{header}\n" if header else "")

    def add(self, table):
        with self.path.open("ab") as file:
            file.write(text_lines(table, header=None))


def test_growing_file_is_read_from_its_end_with_its_first_names(tmp_path):
    log = Growing(tmp_path / "log.csv")
    log.add(TABLE[:40])
    with open_source(f"file:{log.path}") as source:
        assert source.name == "log"
        log.add(TABLE[40:])
        assert np.array_equal(first_samples(source, 80), TABLE[40:])
        assert len(first_samples(source, 1, silence=2)) == 0


def test_a_file_may_be_read_from_its_start(tmp_path):
    log = Growing(tmp_path / "log.csv")
    log.add(TABLE[:40])
    with open_source(f"file:{log.path}?from=start") as source:
        assert np.array_equal(first_samples(source, 40), TABLE[:40])
        log.add(TABLE[40:])
        assert np.array_equal(first_samples(source, 80), TABLE[40:])


def test_a_line_that_is_being_written_is_read_whole(tmp_path):
    log = Growing(tmp_path / "log.csv")
    begun, *lines = text_lines(TABLE, header=None).splitlines(keepends=True)
    with log.path.open("ab") as file:
        file.write(begun[:20])
    with open_source(f"file:{log.path}") as source:
        with log.path.open("ab") as file:
            file.write(begun[20:] + b"".join(lines))
        assert np.array_equal(first_samples(source, len(TABLE)), TABLE)


def test_a_file_that_is_cut_short_is_read_on_and_that_is_said(tmp_path):
    log = Growing(tmp_path / "log.csv")
    log.add(TABLE[:60])
    with open_source(f"file:{log.path}?from=start") as source:
        assert len(first_samples(source, 60)) == 60
        Growing(log.path).add(TABLE[60:])
        assert np.array_equal(first_samples(source, 60), TABLE[60:])
        assert "the file was cut short 1 time and read on from its start" in source.remarks


def test_a_file_that_is_rotated_is_followed_and_that_is_said(tmp_path):
    log = Growing(tmp_path / "log.csv")
    log.add(TABLE[:60])
    with open_source(f"file:{log.path}?from=start") as source:
        assert len(first_samples(source, 50)) >= 50
        log.path.rename(tmp_path / "log.csv.1")
        assert len(first_samples(source, 1, silence=2)) <= 10
        Growing(log.path).add(TABLE[60:])
        assert np.array_equal(first_samples(source, 60), TABLE[60:])
        assert "the file was replaced 1 time and the new one read" in source.remarks


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("file:/no/such/log.csv", "cannot be read: No such file or directory; start what writes it first"),
        ("file:/dev/null", "/dev/null is no file"),
        ("file:/dev/null?from=middle", "from=middle: give start or end"),
        ("tcp://127.0.0.1", "expected HOST:PORT"),
        ("tcp://127.0.0.1:80?baud=9600", "no setting 'baud' for tcp; known: none"),
    ],
)
def test_error_of_a_stream_is_reported(text, words):
    with pytest.raises(LogError) as caught:
        open_source(text).__enter__()
    assert words in str(caught.value)
    assert str(caught.value).startswith(text)


def test_a_pipe_in_the_place_of_a_growing_file_is_refused(tmp_path):
    file = Growing(tmp_path / "imu.csv")
    with open_source(f"file:{file.path}?from=start") as source:
        source.read()
        os.mkfifo(tmp_path / "pipe")
        (tmp_path / "pipe").replace(file.path)
        with pytest.raises(LogError, match="is no file; give the file that grows"):
            source.read()
