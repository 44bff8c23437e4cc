"""Commands as they are typed, in this process."""

from __future__ import annotations

import contextlib
import io
import sys
from dataclasses import dataclass

from simulated_clock import simulated_if_live
from tumble.cli import main as command_line


@dataclass(frozen=True)
class Done:
    """Exit of a command."""

    code: int
    out: str
    err: str

    @property
    def text(self):
        """Printed text, on one line."""
        return " ".join(self.out.split())


def typed(*arguments):
    """Runs `tumble ...` as typed, in this process; a bug of ours comes out as the exception it is."""
    out, err = io.StringIO(), io.StringIO()
    before = sys.argv
    sys.argv = ["tumble", *map(str, arguments)]
    code = 0
    try:
        with (
            simulated_if_live(sys.argv[1:]),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            command_line.main()
    except SystemExit as end:
        code = end.code or 0
    finally:
        sys.argv = before
    return Done(code, out.getvalue(), err.getvalue())


def commands_below(command, name=""):
    """Gives every command with its name, those of commands of commands too."""
    below = getattr(command, "commands", {})
    if not below:
        yield name, command
    for word, each in below.items():
        yield from commands_below(each, f"{name} {word}".strip())
