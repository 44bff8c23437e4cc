"""Commands on a terminal of their own that get Ctrl-C, at a chosen call of Python or at a chosen time."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from patience import PATIENCE
from tumble.foundation import clock

COMMAND = Path(sys.executable).with_name("tumble")
"""Script that pip has written."""
CONTROL_C = b"\x03"
HIDDEN, SHOWN = b"\x1b[?25l", b"\x1b[?25h"
SHOWN_OF_TRACE = 3000
"""Bytes of the output of a command, from its trace on, that a failure shows."""
TRACES = (b"Traceback", b"Exception ignored", b"panicked", b"Fatal Python error", b"KeyboardInterrupt")
LEADER = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.argv[1], sys.argv[1:])
"""
"""Takes a terminal as its own, and then is the command."""
AT_A_CALL = """
import os, signal, sys, types

from tumble.cli.control_c import end_at_control_c

end_at_control_c()
point, within, counted = int(sys.argv[1]), sys.argv[2], sys.argv[3]
sys.argv[1:4] = []
count = 0

def tell():
    os.killpg(0, signal.SIGINT)

def called(frame, event, _given):
    global count
    if event == "call" and within in frame.f_code.co_filename:
        count += 1
        if count == point:
            # Ctrl-C comes within the code that is called.
            code = tell.__code__.replace(co_filename=frame.f_code.co_filename)
            types.FunctionType(code, globals())()

sys.setprofile(called)
try:
    from tumble.cli.console import main
    main()
finally:
    sys.setprofile(None)
    with open(counted, "w") as file:
        file.write(str(count))
"""
"""Runs a command, and sends Ctrl-C to all its processes at a call of some files; counts these calls."""


@dataclass(frozen=True)
class Ended:
    """A command that was interrupted, and how it ended."""

    code: int
    output: bytes

    @property
    def trouble(self) -> str:
        """Reason why it did not end as it should; empty where it did."""
        if traces := [each.decode() for each in TRACES if each in self.output]:
            begin = self.output.find(traces[0].encode())
            return self.output[begin : begin + SHOWN_OF_TRACE].decode(errors="replace")
        if self.output.rfind(HIDDEN) > self.output.rfind(SHOWN):
            return "the cursor stays hidden"
        # A shell shows 130 for an end by the signal itself, too; a command that was done has its own code.
        return "" if self.code in (130, -signal.SIGINT, 0, 3) else f"exit code {self.code}"


class Terminal:
    """A command on a terminal of its own, until it ends."""

    def __init__(self, begun, **options) -> None:
        self._ours, theirs = pty.openpty()
        options = {"stdin": theirs, "stdout": theirs, "stderr": theirs, "start_new_session": True} | options
        words = [sys.executable, "-S", "-E", "-c", LEADER, *map(str, begun)]
        self.process = subprocess.Popen(words, **options)
        os.close(theirs)
        self.output = b""
        self._is_open = True

    def await_command(self):
        """Waits until the command itself has begun."""
        while self.process.poll() is None:
            words = Path(f"/proc/{self.process.pid}/cmdline").read_bytes().split(b"\0")
            if words[1:2] == [str(COMMAND).encode()]:
                return

    def read(self, seconds):
        """Reads for so many s, or to the end."""
        until = clock.now() + seconds
        while self._is_open and (left := until - clock.now()) > 0.0:
            try:
                if clock.readable(self._ours, left):
                    self._take(os.read(self._ours, 1 << 16))
            except OSError:  # the last one that had it open has ended
                self._is_open = False

    def _take(self, piece):
        self.output += piece
        self._is_open = bool(piece)

    def type(self, keys):
        """Types keys."""
        if self._is_open:
            os.write(self._ours, keys)

    def ended(self) -> Ended:
        """Waits until the command has ended; one that hangs fails the test."""
        self.read(PATIENCE)
        os.close(self._ours)
        if self._is_open:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"hangs after {self.output[-500:]}")
        return Ended(self.process.wait(), self.output)


def interrupted_at_call(words, point, counted, *, within="", cwd=None):
    """Runs a command that gets Ctrl-C at its call of that number, 0 for none; `counted` gets their number."""
    given = [sys.executable, "-c", AT_A_CALL, str(point), within, counted, *words]
    return Terminal(given, cwd=cwd).ended()


def interrupted_after(words, seconds, *, cwd=None):
    """Runs a command, and types Ctrl-C so many s after its start."""
    terminal = Terminal([COMMAND, *words], cwd=cwd)
    terminal.await_command()
    terminal.read(seconds)
    terminal.type(CONTROL_C)
    return terminal.ended()
