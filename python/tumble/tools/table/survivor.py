"""Stop of a table whose program was killed or crashed: a process beside it, which outlives it, sends it.

The process waits for the end of a pipe that the program holds open, and imports nothing before that. Then it
imports what the program would have, and nothing from the working folder, where anybody may have put files.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.tools.table.registry import open_table

TRIES, BETWEEN = 20, 0.25
"""Times that the stop is tried, and s between two: a table may serve one program at a time."""
OVER = b"over"
"""Given to the process where the table needs no stop any more."""
_PROGRAM = f"""
import sys
address, *sys.path[:] = sys.argv[1:]
if sys.stdin.buffer.read() != {OVER!r}:
    from tumble.tools.table.survivor import stop
    stop(address)
"""


@contextmanager
def survivor(address: str) -> Iterator[None]:
    """Has the table at an address stopped should this program die while the block runs."""
    beside = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, address, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        start_new_session=True,  # neither Ctrl-C nor a closed terminal ends it
    )
    try:
        yield
    finally:
        beside.communicate(OVER)


def stop(address: str) -> None:
    """Opens a table and stops it; reports on standard error where that is not answered."""
    failure: TumbleError | None = None
    for _ in range(TRIES):
        try:
            with open_table(address) as table:
                table.stop()
        except TumbleError as error:
            failure = error
            clock.sleep(BETWEEN)
        else:
            print(f"tumble: {address}: its program died, and the table was stopped", file=sys.stderr)
            return
    print(f"tumble: {address}: its program died: USE THE EMERGENCY STOP ({failure})", file=sys.stderr)
