"""Ctrl-C on a terminal, at any call of Python: exit code 130, no traceback, the cursor shown."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
from textwrap import indent

import pytest

from interrupted import COMMAND, Terminal, interrupted_after, interrupted_at_call
from ports import free_port
from repetitions import SOAK, drawn_seed, only_soak
from tumble.foundation import clock
from turntable_sessions import typed

JOB = "procedure: spin\ninputs: [in/*.csv]\nresults: results-{number}\n"
COMMANDS = ("inspect", "spin", "fleet run", "record")
FEW = 1
"""Points of each command in `make test`: each is a process, and so is the one that counts its calls."""
MANY = 150
"""In `make soak`, as many at calls, and as many at times."""
OF_THE_INTERPRETER = 0.1
"""s after its start in which Python, on a busy computer, has not read the first line of any program."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interrupted")
    assert typed("simulate", "spin", "--turns", "2", "--seed", "7", "-o", folder).code == 0
    (folder / "in").mkdir()
    for number in range(4):
        shutil.copy(folder / "spin.csv", folder / "in" / f"unit_{number}.csv")
    return folder


def words_of(command, folder, number):
    """Returns the words of a command that writes to a place of its own."""
    if command == "inspect":
        return ["inspect", "spin.csv"]
    if command == "spin":
        return ["spin", "spin.csv", "-o", f"spin-{number}"]
    if command == "record":
        return ["record", f"a=udp://:{free_port()}", "-o", f"record-{number}", "--duration", "0.5s"]
    job = folder / f"job-{number}.yaml"
    job.write_text(JOB.format(number=number))
    return ["fleet", "run", job.name, "--workers", "2"]


def chance():
    return random.Random(drawn_seed())


def counted(words, folder, within=""):
    """Returns the number of calls of a command that is not interrupted."""
    path = folder / "calls"
    path.unlink(missing_ok=True)
    done = interrupted_at_call(words, 0, path, within=within, cwd=folder)
    assert done.trouble == ""
    return int(path.read_text())


@pytest.mark.parametrize("command", COMMANDS)
def test_control_c_at_any_call_ends_without_a_trace(command, folder):
    draw, calls = chance(), counted(words_of(command, folder, "whole"), folder)
    for number in range(MANY if SOAK else FEW):
        point = draw.randint(1, calls)
        words = words_of(command, folder, f"at-{number}")
        assert interrupted_at_call(words, point, folder / "calls", cwd=folder).trouble == "", point


@pytest.mark.parametrize(
    "library", ["pydantic", "rich", "yaml", "multiprocessing"] if SOAK else ["pydantic", "multiprocessing"]
)
def test_control_c_within_a_library_ends_without_a_trace(library, folder):
    within, draw = f"/{library}/", chance()
    calls = counted(words_of("fleet run", folder, f"whole-{library}"), folder, within)
    for number in range(MANY // 4 if SOAK else FEW):
        point = draw.randint(1, calls)
        words = words_of("fleet run", folder, f"{library}-{number}")
        done = interrupted_at_call(words, point, folder / "calls", within=within, cwd=folder)
        assert done.trouble == "", point


def test_control_c_is_raised_in_no_library_that_could_lose_it(tmp_path):
    """Classes of Python 3.11 turn an error of `__set_name__` into another one; native code may panic."""
    library = tmp_path / "site-packages" / "lossy.py"
    library.parent.mkdir()
    library.write_text(
        "import os\n"
        "class Set:\n"
        "    def __set_name__(self, owner, name):\n"
        f"        os.kill(os.getpid(), {signal.SIGINT})\n"
        "        sum(range(1000))\n"
        "def work(): type('Owner', (), {'set': Set()})\n"
    )
    code = "import signal, sys, lossy\nfrom tumble.cli import control_c\n"
    code += "control_c.heed_control_c_between_steps()\n"
    code += "try:\n    lossy.work()\n    signal.pause()\nexcept KeyboardInterrupt: sys.exit(130)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(library.parent), *sys.path])}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize(
    "callback",
    [
        "class Object:\n    def __del__(self): interrupt()\nObject()",
        "import weakref\nclass Object: pass\nweakref.ref(Object(), lambda _: interrupt())",
        "def rows():\n    try: yield\n    finally: interrupt()\nnext(rows())",
        "import gc\ngc.callbacks.append(lambda *_: gc.callbacks.clear() or interrupt())\ngc.collect()",
    ],
    ids=["finalizer", "weak reference", "generator", "collector"],
)
def test_control_c_in_a_callback_that_drops_errors_is_not_lost(callback):
    code = "import os, signal, sys\nfrom tumble.cli import control_c\n"
    code += f"def interrupt(): os.kill(os.getpid(), {signal.SIGINT}); sum(range(1000))\n"
    code += "control_c.heed_control_c_between_steps()\n"
    code += f"def work():\n{indent(callback, '    ')}\n"
    code += "with control_c.DroppedTriedAgain():\n    try:\n        work()\n        signal.pause()\n"
    code += "    except KeyboardInterrupt: sys.exit(130)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@only_soak("waits for times")
@pytest.mark.parametrize("command", COMMANDS)
def test_control_c_at_any_time_ends_without_a_trace(command, folder):
    began = clock.now()
    assert Terminal([COMMAND, *words_of(command, folder, "timed")], cwd=folder).ended().trouble == ""
    lasts, draw = clock.now() - began, chance()
    for number in range(MANY):
        seconds = draw.uniform(OF_THE_INTERPRETER, lasts)
        words = words_of(command, folder, f"after-{number}")
        assert interrupted_after(words, seconds, cwd=folder).trouble == "", seconds
