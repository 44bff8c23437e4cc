"""Every end of a program stops its table: each signal, whichever thread holds it."""

from __future__ import annotations

import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import textwrap
from contextlib import contextmanager

import pytest

from bench_client import BenchClient
from bench_pages import BenchProcess
from crowded_folder import TUMBLE, crowd
from cut_line import cut_line
from live_benches import QUICK_BENCH, words_of
from patience import PATIENCE
from repetitions import SOAK, drawn_seed, few
from table_fixtures import ObservedTable, served
from tumble.foundation.ending import ENDING
from tumble.tools.simulate import LiveSimulation
from tumble.tools.table.profile import profile_text

NAMED = ("INT", "TERM", "HUP", "QUIT", "USR1", "USR2", "ALRM", "ABRT", "XCPU")
SIGNALS = tuple(getattr(signal, f"SIG{name}") for name in NAMED)
"""Signals whose default ends a program; `make test` takes a few, `make soak` all that the system has."""
TURNING = ("table", "rate", "0,5", "--for", "3600", "--armed", "--table")
GOING = ("table", "goto", "170,0", "--speed", "0.1,0.1", "--armed", "--table")
IN_A_THREAD = """
    import hashlib, sys, threading
    import numpy as np
    from tumble.foundation.ending import watched
    from tumble.tools.table import GuardedTable, open_table

    def turn():
        with GuardedTable(open_table(sys.argv[1]), armed=True) as table:
            table.rate(np.radians([0.0, 5.0]))
            threading.Event().wait()

    with watched():
        threading.Thread(target=turn, daemon=True).start()
        {main}
"""
TO_ANOTHER_THREAD = """
    import signal, threading
    from pathlib import Path
    from tumble.foundation import clock
    from tumble.foundation.ending import watched

    WAITS_IN = Path(f"/proc/self/task/{threading.main_thread().native_id}/wchan")

    def give():
        while "nanosleep" not in WAITS_IN.read_text():
            pass
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)

    with watched():
        threading.Thread(target=give, daemon=True).start()
        clock.sleep(3600.0)
"""
NATIVE = 'hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)'
"""Keeps the main thread for minutes, and takes no signal meanwhile."""


def drawn(signals):
    """Draws a signal; in `make soak` it gives all."""
    return signals if SOAK else random.Random(drawn_seed()).sample(signals, 1)


@contextmanager
def running(*words, **options):
    """Runs a command of Python until the block ends."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    process = subprocess.Popen([sys.executable, *map(str, words)], **options)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def moving(*words, **options):
    """Runs a command whose last word is a table, and waits until it moves."""
    with served("scpi") as (address, table):
        observed = ObservedTable(table)
        with running(*words, address, **options) as process:
            observed.wait_until_it_moves()
            yield process, observed


def assert_ends(process, number):
    """Asserts that a process ends by a signal, without a traceback."""
    err = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == (130 if number == signal.SIGINT else -number)
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "number", sorted(ENDING - {signal.SIGPIPE, signal.SIGXFSZ}) if SOAK else few(SIGNALS, 3)
)
def test_each_signal_stops_the_table_and_ends_the_command(number):
    with moving("-m", "tumble", *TURNING) as (process, table):
        process.send_signal(number)
        assert_ends(process, number)
        table.wait_until_it_is_stopped()


def test_a_table_on_its_way_is_stopped_as_well():
    for number in drawn(SIGNALS):
        with moving("-m", "tumble", *GOING) as (process, table):
            process.send_signal(number)
            assert_ends(process, number)
            table.wait_until_it_is_stopped()


def test_a_table_in_a_thread_is_stopped_while_the_main_one_is_busy():
    program = textwrap.dedent(IN_A_THREAD.format(main=NATIVE))
    for number in drawn(SIGNALS):
        with moving("-c", program) as (process, table):
            process.send_signal(number)
            table.wait_until_it_is_stopped()


def test_signal_that_another_thread_took_ends_the_main_wait():
    with running("-c", textwrap.dedent(TO_ANOTHER_THREAD)) as process:
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 128 + signal.SIGTERM


def test_a_thread_that_holds_a_table_ends_with_the_program():
    program = textwrap.dedent(IN_A_THREAD.format(main="sys.stdin.readline()"))
    with moving("-c", program, stdin=subprocess.PIPE) as (process, table):
        process.communicate("\n", timeout=PATIENCE)
        assert process.returncode == 0
        table.wait_until_it_is_stopped()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_a_killed_program_leaves_its_table_to_a_survivor(number):
    with moving("-m", "tumble", *TURNING) as (process, table):
        process.send_signal(number)
        table.wait_until_it_is_stopped()
        assert "its program died, and the table was stopped" in process.communicate(timeout=PATIENCE)[1]


@pytest.mark.parametrize("number", few([None, signal.SIGINT, signal.SIGTERM], 2))
def test_a_stop_that_is_not_answered_is_tried_after_the_end(number):
    with served("scpi") as (address, table), cut_line(address) as (led, line):
        observed = ObservedTable(table)
        with running("-m", "tumble", *TURNING, led) as process:
            observed.wait_until_it_moves()
            # More than the program tries itself.
            line.cut(refused=6)
            if number is not None:
                process.send_signal(number)
            err = process.communicate(timeout=PATIENCE)[1]
        observed.wait_until_it_is_stopped()
    assert "its program had no answer, and the table was stopped" in err
    assert "Traceback" not in err


def test_a_survivor_imports_nothing_from_the_working_folder(tmp_path):
    with moving(TUMBLE, *TURNING, cwd=crowd(tmp_path)) as (process, table):
        process.kill()
        table.wait_until_it_is_stopped()


LOST = {
    "deleted": lambda profile: profile.unlink(),
    "half written": lambda profile: profile.write_text(profile.read_text()[:300]),
    "in a folder that is gone": lambda profile: shutil.rmtree(profile.parent),
}


@pytest.mark.parametrize("what", LOST)
def test_a_survivor_needs_no_file_after_the_death(tmp_path, what):
    folder = tmp_path / "work"
    folder.mkdir()
    profile = folder / "ours.yaml"
    profile.write_text(profile_text("scpi"))
    with served("scpi") as (address, table):
        observed = ObservedTable(table)
        ours = address.replace("profile=scpi", "profile=ours.yaml")
        with running("-m", "tumble", *TURNING, ours, cwd=folder) as process:
            observed.wait_until_it_moves()
            LOST[what](profile)
            process.kill()
            observed.wait_until_it_is_stopped()


IMPORTED_LATE = """
    import io, json, os, sys
    from tumble.tools.table import survivor
    ready = io.BytesIO()
    class Lines:
        def readline(self):
            return json.dumps([sys.argv[1], {"profile": sys.argv[2]}]).encode() + b"\\n"
        def read(self):
            self.known = set(sys.modules)
            sys.addaudithook(lambda name, _: name == "open" and opened.append(name))
            return b""
    opened, lines = [], Lines()
    lines.buffer = lines
    sys.stdin = lines
    survivor.stand_by()
    print(sorted(set(sys.modules) - lines.known), opened)
"""


def test_a_survivor_imports_and_opens_nothing_after_the_death():
    with served("scpi") as (address, table):
        observed = ObservedTable(table)
        program = textwrap.dedent(IMPORTED_LATE)
        with running("-c", program, address, profile_text("scpi")) as process:
            out, err = process.communicate(timeout=PATIENCE)
            observed.wait_until_it_is_stopped()
    assert out.splitlines() == ["ready", "[] []"], out + err


def test_a_crash_in_native_code_leaves_the_table_to_a_survivor():
    program = textwrap.dedent(IN_A_THREAD.format(main="import os; sys.stdin.readline(); os.abort()"))
    with moving("-c", program, stdin=subprocess.PIPE) as (process, table):
        process.communicate("\n", timeout=PATIENCE)
        assert process.returncode == -signal.SIGABRT
        table.wait_until_it_is_stopped()


def test_a_suspended_program_leaves_its_table_at_rest():
    with moving("-m", "tumble", *TURNING) as (process, table):
        process.send_signal(signal.SIGTSTP)
        table.wait_until_it_is_stopped()
        assert os.WIFSTOPPED(os.waitpid(process.pid, os.WUNTRACED)[1])


def test_a_broken_pipe_ends_no_command_that_holds_a_table():
    with moving("-m", "tumble", *TURNING) as (process, table):
        process.send_signal(signal.SIGPIPE)
        process.send_signal(signal.SIGTERM)
        assert_ends(process, signal.SIGTERM)
        table.wait_until_it_is_stopped()


def test_a_terminal_that_closes_stops_the_table():
    ours, theirs = pty.openpty()
    options = {"stdin": theirs, "stdout": theirs, "stderr": theirs, "start_new_session": True}
    own_terminal = "import fcntl, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    program = own_terminal + "from tumble.cli.main import main; main()"
    with moving("-c", program, *TURNING, **options) as (process, table):
        os.close(theirs)
        os.close(ours)
        table.wait_until_it_is_stopped()
        assert process.wait(60) == -signal.SIGHUP


def test_no_table_is_armed_in_a_thread_that_no_signal_would_reach():
    program = textwrap.dedent(IN_A_THREAD.replace("with watched():", "if True:").format(main="pass"))
    program = program.replace(".start()", ".run()").replace(
        "threading.Thread(target=turn, daemon=True)", "Alone()"
    )
    alone = (
        "class Alone:\n    def run(self):\n        t = threading.Thread(target=turn); t.start(); t.join()\n"
    )
    program = program.replace("if True:", alone + "if True:")
    with running("-c", program, "simulated:two-axis") as process:
        assert (
            "is not armed in a thread where signals are not heeded"
            in process.communicate(timeout=PATIENCE)[1]
        )


@contextmanager
def simulated_units():
    """Serves units on a table, and that table, for programs in their own processes."""
    with LiveSimulation(**QUICK_BENCH) as simulation:
        yield simulation, ObservedTable(simulation.table)


def test_a_live_session_stops_its_table_at_each_signal(tmp_path):
    for number in drawn((*SIGNALS, signal.SIGKILL)):
        with simulated_units() as (simulation, table):
            words = ["--live", *words_of(simulation), "--pose-seconds", "2s", "--armed"]
            folder = tmp_path / signal.Signals(number).name
            words += ["--table", simulation.table_address, "-o", folder]
            with running("-m", "tumble", "turntable", *words) as process:
                table.wait_until_it_moves()
                process.send_signal(number)
                assert_ends(process, number)
                table.wait_until_it_is_stopped()
                assert (folder / "session" / "session.yaml").is_file()


def test_a_bench_stops_its_table_at_each_signal(tmp_path):
    for number in drawn((*SIGNALS, signal.SIGKILL)):
        with simulated_units() as (simulation, table):
            bench = BenchProcess(tmp_path / signal.Signals(number).name, "--port", "0")
            try:
                with BenchClient(bench.address) as page, page.beating():
                    page.wait(lambda page=page: page.shows("You hold the bench"))
                    start(page, simulation)
                    table.wait_until_it_moves()
                    bench.process.send_signal(number)
                    table.wait_until_it_is_stopped()
                assert_ends(bench.process, number)
            finally:
                bench.kill()


def start(page, simulation):
    """Begins a session on the armed table."""
    for name, address in simulation.addresses.items():
        page.fill("Name", name)
        page.fill("Address", address)
        page.click("Add")
        page.wait(lambda name=name: page.shows(name))
    page.click("Run")
    page.fill("Table", simulation.table_address)
    page.fill("Time at each pose (s)", "2")
    page.click("Arm the table")
    page.click("Start")


def test_a_bench_that_was_killed_goes_on_armed_by_nobody(tmp_path):
    with simulated_units() as (simulation, table):
        killed = BenchProcess(tmp_path, "--port", "0")
        with BenchClient(killed.address) as page, page.beating():
            page.wait(lambda: page.shows("You hold the bench"))
            start(page, simulation)
            table.wait_until_it_moves()
            page.wait(lambda: any(tmp_path.glob("*/session/session.yaml")))
            killed.kill()
        table.wait_until_it_is_stopped()
        again = BenchProcess(tmp_path, "--port", "0")
        try:
            with BenchClient(again.address, "/run") as page, page.beating():
                page.wait(lambda: page.shows("You hold the bench"))
                page.wait(lambda: page.shows("was not finished"))
                page.click("Go on")
                page.wait(lambda: page.shows(f"Table: {simulation.table_address}"))
                assert table.told[-1] == "stop"
                page.click("Arm the table and go on")
                table.wait_until_it_moves()
                page.click("Stop")
                table.wait_until_it_is_stopped()
        finally:
            again.end()
