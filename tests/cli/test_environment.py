"""Environment of a command: full disks, odd names, pipes, and Control-C at any time."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import tumble
from log_fixtures import made_up, write
from patience import PATIENCE
from repetitions import by_turns
from tumble.cli.exit_code import ExitCode
from turntable_sessions import one_line, typed

COMMAND = [sys.executable, "-c", "from tumble.cli.main import main; main()"]


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "log.csv", made_up(300))


@pytest.mark.parametrize(
    "words", [("inspect",), ("inspect", "--json"), ("--help",), ("schema", "calibration")]
)
def test_a_full_disk_below_standard_output_is_one_line(log, words):
    words = [*words, log] if words[0] == "inspect" else words
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run([*COMMAND, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert one_line(done.stderr) == "standard output: cannot be written: No space left on device"


def test_a_reader_that_has_enough_is_no_mistake(log):
    process = subprocess.Popen(
        [*COMMAND, "inspect", *[log] * 40], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait() == ExitCode.READER_GONE
    process.stderr.close()


STREAMS = {
    "nobody reads standard output": ("| true", ExitCode.READER_GONE),
    "standard output is closed": (">&-", None),
    "standard error is closed": ("2>&-", None),
    "standard error is full": ("2>/dev/full", None),
    "all are closed": ("<&- >&- 2>&-", None),
}
"""Standard streams as a shell gives them, and the exit code; None for that of the command."""
COMMANDS_OF_STREAMS = {
    "inspect {log}": ExitCode.DONE,
    "inspect --json {log}": ExitCode.DONE,
    "inspect --json missing.csv": ExitCode.USER_ERROR,
    "--nonsense": ExitCode.USER_ERROR,
    "--help": ExitCode.DONE,
    "noise {log} -o results": ExitCode.NOT_ALL_WELL,
}
"""Commands that draw, print a document, refuse and write, with their exit codes."""


@pytest.mark.parametrize("streams", STREAMS)
def test_a_stream_that_nobody_reads_keeps_the_exit_code(tmp_path, log, streams):
    redirected, expected = STREAMS[streams]
    still = made_up(600)
    still.gyroscope[300:, 2] -= 1.0
    write(log, still)
    program = shlex.join(COMMAND)
    # Each takes every other command, a process each: what draws, prints, refuses and writes by turns.
    for words, code in by_turns(list(COMMANDS_OF_STREAMS.items()), list(STREAMS).index(streams), 2):
        line = f"{program} {words.format(log=shlex.quote(str(log)))} {redirected}; exit ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False, cwd=tmp_path)
        prints = code != ExitCode.USER_ERROR or "--json" in words
        assert done.returncode == (expected if expected and prints else code), (words, done.stderr)
        assert "Traceback" not in done.stdout + done.stderr
        if "noise" in words and not expected:
            assert (tmp_path / "results" / "log.noise.yaml").exists()


def test_control_c_while_libraries_are_imported_leaves_no_trace(tmp_path):
    (tmp_path / "typer.py").write_text(f"import os\nos.kill(os.getpid(), {signal.SIGINT})\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    done = subprocess.run([*COMMAND, "--help"], capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_a_name_that_is_no_text_is_read_shown_and_written(tmp_path, log):
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    assert typed("simulate", "spin", "--turns", "2", "--seed", "7", "-o", folder).code == 0
    odd = (folder / "spin.csv").rename(folder / os.fsdecode(b"rob\xe9t.csv"))
    assert typed("inspect", odd).code == 0
    assert typed("spin", odd, "-o", folder).code == 0
    (path,) = folder.glob("*.spin.yaml")
    assert tumble.Calibration.load(path).name == "rob\\xe9t"
    done = subprocess.run([*COMMAND, "inspect", odd], capture_output=True, text=True, check=False)
    assert "rob\\xe9t.csv" in done.stdout
    assert typed("apply", path, odd, "-o", folder / os.fsdecode(b"out\xe9.csv")).code == 0


def test_a_name_of_5000_characters_is_one_short_line():
    name = "n" * 5000
    for words in (("inspect", name), ("apply", name, name), ("spin", name)):
        done = typed(*words)
        assert done.code == 2
        assert len(one_line(done.err)) < 200


@pytest.mark.parametrize("command", ["inspect", "spin"])
def test_a_pipe_or_a_device_as_a_log_is_refused_unread(tmp_path, command):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero"):
        assert "is a device or a pipe, not a log" in one_line(typed(command, path).err)


def test_a_place_that_holds_something_else_is_refused_before_any_work(tmp_path, log):
    for name, words in (
        ("log.spin.yaml", ("spin", log)),
        ("events.jsonl", ("redundancy", "--primary", log, "--secondary", log)),
        ("align.yaml", ("align", "--primary", log, "--secondary", log)),
    ):
        folder = tmp_path / name.partition(".")[0]
        folder.mkdir()
        (folder / name).write_text("my notes\n")
        assert "and is kept" in one_line(typed(*words, "-o", folder).err)
        assert [path.name for path in folder.iterdir()] == [name]


def test_control_c_between_import_and_call_leaves_no_traceback():
    """Scripts that pip writes compile a regular expression there."""
    code = "from tumble.cli.console import main\nimport os, signal\n"
    code += f"os.kill(os.getpid(), {signal.SIGINT})\nsignal.pause()\nmain()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_the_installed_command_heeds_control_c_first():
    pyproject = (Path(__file__).parents[2] / "pyproject.toml").read_text()
    assert '\ntumble = "tumble.cli.console:main"\n' in pyproject
    code = """
import _signal, sys
before, heed = set(sys.modules), _signal.signal
def noted(number, handler):
    print(*sorted(set(sys.modules) - before))
    _signal.signal = heed
    return heed(number, handler)
_signal.signal = noted
import tumble.cli.console
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    imported = set(done.stdout.split()) - {"__future__"}
    assert imported == {"tumble", "tumble.cli", "tumble.cli.console", "tumble.cli.control_c"}, done


def test_control_c_in_the_midst_of_a_late_import_is_not_lost(tmp_path):
    (tmp_path / "pyarrow.py").write_text(
        "import os\n"
        "class Last:\n"
        f"    def __del__(self): os.kill(os.getpid(), {signal.SIGINT}); sum(range(1000))\n"
        "Last()\n"
        "import signal; signal.pause()\n"
    )
    code = "from tumble.cli import control_c; control_c.heed_control_c_between_steps()\n"
    code += "import signal, sys\ntry:\n    import pyarrow\n    signal.pause()\n"
    code += "except KeyboardInterrupt: sys.exit(130)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment
    )
    assert (done.returncode, done.stderr) == (130, "")


def test_control_c_while_a_thread_starts_ends_the_process():
    """A worker that no executor knows of waits for work for ever, and the process for the worker."""
    code = "from tumble.cli import control_c; control_c.heed_control_c_between_steps()\n"
    code += "import os, signal, sys, threading\nfrom concurrent.futures import ThreadPoolExecutor\n"
    code += "wait = threading.Event.wait\n"
    code += f"threading.Event.wait = lambda self: wait(self) and os.kill(os.getpid(), {signal.SIGINT})\n"
    code += "workers = ThreadPoolExecutor()\n"
    code += "try:\n    workers.submit(int)\n    signal.pause()\nexcept KeyboardInterrupt: sys.exit(130)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_control_c_as_the_core_first_uses_numpy_is_no_panic():
    code = """
import os, signal, sys
import numpy as np
from numpy.lib import NumpyVersion
from tumble import _core
from tumble.cli import control_c

control_c.heed_control_c_between_steps()
asked = NumpyVersion.__init__
def interrupted(self, version):
    os.kill(os.getpid(), 2)
    asked(self, version)
interrupted.__code__ = interrupted.__code__.replace(co_filename=asked.__code__.co_filename)
NumpyVersion.__init__ = interrupted
try:
    _core.rotation_matrix(np.zeros(3))
    signal.pause()
except KeyboardInterrupt:
    sys.exit(130)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize("columns", ["0", "1", "1001", "1000000000", "9" * 20, "9" * 5000, "x", ""])
@pytest.mark.parametrize("words", [("noise", "--help"), ("formats",)])
def test_a_stated_width_of_any_size_is_drawn_in_bounds(monkeypatch, columns, words):
    monkeypatch.setenv("COLUMNS", columns)
    done = typed(*words)
    assert done.code == 0, done.err
    assert max(map(len, done.out.splitlines()), default=0) <= 1000
