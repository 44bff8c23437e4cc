"""Run commands of Tumble and programs of Python, each in a fork of a process that has imported the package.

A start of Python with Tumble's libraries costs half a second of processor, more than most commands of the
pages take after it. Requests and answers are lines of JSON, one at a time, on standard input and output.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any


@dataclass(frozen=True, slots=True)
class Done:
    """Outcome of a command."""

    code: int
    out: str
    err: str


class ForkingProcess:
    """A process that runs one command after the other; it ends with this one."""

    def __init__(self, environment: dict[str, str]) -> None:
        """Starts it with environment variables, which all commands get."""
        command = [sys.executable, __file__]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment)

    def run(self, folder: Path, *, words: list[str] | None = None, program: str = "") -> Done:
        """Runs `tumble` with words, or a program of Python, in a folder."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        request = {"folder": str(folder), "words": words, "program": program}
        print(json.dumps(request), file=self._process.stdin, flush=True)
        return Done(**json.loads(self._process.stdout.readline()))

    def close(self) -> None:
        """Ends it, and waits until it has ended."""
        self._process.communicate()


def serve(requests: IO[str], answers: IO[str]) -> None:
    """Answers requests until there are no more; a fork for each comes back from here with its outcome."""
    for line in requests:
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            child = os.fork()
            if child == 0:
                os.dup2(out.fileno(), 1)
                os.dup2(err.fileno(), 2)
                return _run(json.loads(line))
            _, status = os.waitpid(child, 0)
            answer = {"code": os.waitstatus_to_exitcode(status), "out": _text(out), "err": _text(err)}
        print(json.dumps(answer), file=answers, flush=True)
    return None


def _run(request: dict[str, Any]) -> None:
    """Runs a request as the main program of this process, whose end it may be."""
    os.chdir(request["folder"])
    sys.stdin = open(os.devnull)  # noqa: SIM115, PTH123 - it is closed with the process
    if request["words"] is None:
        sys.argv = ["-c"]
        exec(compile(request["program"], "<string>", "exec"), {"__name__": "__main__"})
    else:
        sys.argv = ["tumble", *request["words"]]
        importlib.import_module("tumble.cli.main").main()


def _text(written: IO[str]) -> str:
    written.seek(0)
    return written.read()


def preload() -> None:
    """Imports the modules that most commands need."""
    procedures = importlib.import_module("tumble.foundation.procedures").PROCEDURES
    words = [
        f"tumble.procedures.{each.word}.{part}" for each in procedures for part in ("command", "procedure")
    ]
    for module in (
        "tumble.cli.commands",
        "tumble.tools.simulate",
        "pyarrow.csv",
        "jinja2",
        "rich.table",
        *words,
    ):
        importlib.import_module(module)


if __name__ == "__main__":
    preload()
    # The first descriptors of a fork are its own; requests and answers keep theirs.
    serve(os.fdopen(os.dup(0), "r"), os.fdopen(os.dup(1), "w"))
