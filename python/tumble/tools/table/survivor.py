"""Stop of a table whose program died, or ended without an answer to it: a process beside it sends it.

The process has all that it needs before the table moves: it was given the address and the texts of the files
that the address names, has imported what stops the table, and waits for the end of a pipe that the program
holds open. After the death of the program it reads no file, imports nothing and needs no working folder.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import IO

from tumble.foundation import clock
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.errors import TableError, TumbleError
from tumble.tools.table.rate_table import RateTable
from tumble.tools.table.registry import open_table

TRIES, BETWEEN = 40, 0.25
"""Times that the stop is tried, and s between two: a table may serve one program at a time, or start anew."""
OVER, WANTED = b"over", b"wanted"
"""Given to the process where the table needs no stop any more, and where a stop had no answer."""
READY = b"ready\n"
"""Given by the process once it needs nothing more."""
_PROGRAM = """
import sys
sys.path[:] = sys.argv[1:]
from tumble.tools.table.survivor import stand_by
stand_by()
"""


class Survivor:
    """The process beside the program."""

    def __init__(self, address: str, process: subprocess.Popen[bytes]) -> None:
        self._address = address
        self._process = process
        self.is_answered = True
        """Indicates whether the latest stop was answered; else the process goes on with it at the end."""

    def wait_until_ready(self) -> None:
        """Waits until the process can stop the table; raises `TableError` where it never can."""
        answers = self._process.stdout
        assert answers is not None, "its answers come by a pipe"
        if not answers.closed and answers.readline() != READY:
            raise TableError(
                f"{self._address}: nothing moves, as the process that stops the table should this program "
                "die has ended itself; see the lines above"
            )
        answers.close()


@contextmanager
def survivor(address: str, documents: Mapping[str, str]) -> Iterator[Survivor]:
    """Has the table at an address stopped should this program die while the block runs, or have no answer.

    The line of this program is closed by then, as a table may serve one at a time. `documents` are those of
    the table. Raises `TableError` where no process can be started.
    """
    try:
        beside = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, *sys.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # neither Ctrl-C nor a closed terminal ends it
        )
    except OSError as error:
        raise TableError(
            f"{address}: nothing moves, as no process can be started that stops the table should this "
            f"program die: {error.strerror or error}; end other programs, or raise the limits of this one"
        ) from error
    found = Survivor(address, beside)
    try:
        _write(beside.stdin, json.dumps([address, dict(documents)]).encode() + b"\n")
        yield found
    finally:
        _write(beside.stdin, OVER if found.is_answered else WANTED)
        beside.communicate()


def _write(line: IO[bytes] | None, data: bytes) -> None:
    """Gives the process some bytes; one that has ended takes none."""
    assert line is not None, "it listens on a pipe"
    with suppress(BrokenPipeError):
        line.write(data)
        line.flush()


def stand_by() -> None:
    """Waits for the end of the program, as the process beside it."""
    lines = sys.stdin.buffer
    given = lines.readline()
    if not given.endswith(b"\n"):
        return  # The program ended before it could move anything.
    address, documents = parse_json(given)
    table = open_table(address, documents)
    # A driver of another package may have nothing to prepare.
    getattr(table, "prepare", lambda: None)()
    # A program that has died meanwhile reads it no more.
    with suppress(BrokenPipeError):
        sys.stdout.buffer.write(READY)
        sys.stdout.buffer.flush()
    if (last := lines.read()) != OVER:
        stop(address, table, "its program had no answer" if last == WANTED else "its program died")


def stop(address: str, table: RateTable, why: str) -> None:
    """Opens a table and stops it; reports on standard error why, and where that is not answered."""
    failure: TumbleError | None = None
    for _ in range(TRIES):
        try:
            with table:
                table.stop()
        except TumbleError as error:
            failure = error
            clock.sleep(BETWEEN)
        else:
            print(f"tumble: {address}: {why}, and the table was stopped", file=sys.stderr)
            return
    print(f"tumble: {address}: {why}: USE THE EMERGENCY STOP ({failure})", file=sys.stderr)
