"""Folders of results: one run at a time writes into each, and a failed run leaves none that is empty."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from log_fixtures import made_up, write
from patience import PATIENCE
from tumble.foundation.errors import OutputError
from tumble.foundation.files import files_of_command, prepare_folder
from tumble.foundation.folder_lock import LOCK_FILE
from tumble.live import LiveChunk, open_source
from tumble.tools.record.writer import RecordedUnit, SessionWriter
from turntable_sessions import one_line, typed

HOLD = (
    "import sys\n"
    "from tumble.foundation.files import files_of_command, prepare_folder\n"
    "with files_of_command():\n"
    "    prepare_folder(sys.argv[1])\n"
    "    print('held', flush=True)\n"
    "    sys.stdin.read()\n"
)


@pytest.fixture
def holder(tmp_path):
    """Another process that writes into `out`."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "out")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "log.csv", made_up(3000))


def test_a_second_run_into_a_folder_ends_in_one_line(tmp_path, log, holder):
    done = typed("noise", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert f"another run (process {holder.pid}) writes into this folder" in one_line(done.err)
    assert [path.name for path in (tmp_path / "out").iterdir()] == [LOCK_FILE]


def units():
    """One unit, to be recorded."""
    return {"imu": RecordedUnit(open_source("udp://127.0.0.1:9"), "udp://127.0.0.1:9")}


def test_a_recorder_and_a_run_keep_each_other_out(tmp_path, log, holder):
    folder = tmp_path / "out"
    with pytest.raises(OutputError, match=rf"another run \(process {holder.pid}\) writes into this folder"):
        SessionWriter(folder, units(), "host")
    holder.kill()
    holder.wait()
    with SessionWriter(folder, units(), "host"):
        run = subprocess.run(
            [sys.executable, "-c", HOLD, str(folder)],
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE,
        )
        assert f"another run (process {os.getpid()}) writes into this folder" in run.stderr
        with pytest.raises(OutputError, match="another run"):
            SessionWriter(folder, units(), "host", resume=True)
    assert not (folder / LOCK_FILE).exists()


def test_a_command_records_into_a_folder_that_it_holds(tmp_path):
    folder = tmp_path / "out"
    with files_of_command():
        prepare_folder(folder)
        with SessionWriter(folder, units(), "host") as writer:
            writer.take("imu", LiveChunk(np.arange(3.0), np.ones((3, 3)), np.ones((3, 3))))
            writer.finish("done")
        assert (folder / LOCK_FILE).exists(), "the command holds it to its own end"
    assert not (folder / LOCK_FILE).exists()


@pytest.mark.parametrize("which", [signal.SIGKILL, signal.SIGTERM])
def test_files_of_a_killed_run_stop_nobody(tmp_path, log, holder, which):
    holder.send_signal(which)
    holder.wait()
    assert (tmp_path / "out" / LOCK_FILE).exists()
    assert typed("noise", log, "-o", tmp_path / "out").code in (0, 3)
    assert not (tmp_path / "out" / LOCK_FILE).exists()


def test_one_of_many_concurrent_runs_writes(tmp_path):
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", HOLD, str(tmp_path / "out")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        for _ in range(6)
    ]
    # The one that writes does so until all others have ended.
    said = [run.stdout.readline() for run in runs]
    assert sorted(said) == [b""] * 5 + [b"held\n"]
    for run in runs:
        run.communicate()


@pytest.mark.parametrize(
    "words",
    [
        ("turntable", "LOG", "LOG"),
        ("noise", "LOG"),
        ("thermal", "LOG"),
        ("spin", "LOG"),
        ("multipose", "LOG"),
        ("magnetometer", "LOG"),
        ("align", "LOG", "LOG"),
        ("compare", "LOG", "LOG"),
        ("import", "LOG"),
        ("redundancy", "--primary", "LOG", "--secondary", "LOG"),
        ("simulate", "multipose", "--orientations", "0"),
    ],
    ids=lambda words: words[0],
)
def test_a_failed_run_leaves_no_empty_folder(tmp_path, words):
    log = write(tmp_path / "log.csv", made_up(50))
    out = tmp_path / "not" / "there"
    done = typed(*(log if word == "LOG" else word for word in words), "-o", out)
    assert done.code == 2, done.out
    assert not (tmp_path / "not").exists()


def test_a_million_orientations_are_refused(tmp_path):
    done = typed("simulate", "multipose", "--orientations", "1000000", "-o", tmp_path / "out")
    assert done.code == 2
    assert "give 1 to 1000" in one_line(done.err)
    assert not (tmp_path / "out").exists()
