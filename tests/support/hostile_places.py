"""Places that no file is at, or that cannot be read, for every option of every command that takes a place."""

from __future__ import annotations

import ctypes
import os
import re
import resource
import signal
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from patience import PATIENCE
from tumble.cli.commands import COMMANDS, command_line

_PLACE = re.compile(
    r"FILE|DIR|LOG|FOLDER|JOB|RESULT|SOURCE|REFERENCE|TARGET|PRIMARY|URL|\bTO\b|SESSION|DRIVER"
)
"""Words for places in what help shows of a parameter."""


SERVING = (("bench",), ("view",), ("record",), ("simulate", "live"))
"""Commands that go on until somebody ends them."""


class HangError(BaseException):
    """A command takes so long that it hangs; no handler of errors may take it for one of its own."""


@dataclass(frozen=True)
class Place:
    """Parameter of a command that takes a place."""

    words: tuple[str, ...]
    """Command."""
    option: str
    """`--limits`; empty for an argument."""
    metavar: str
    needed: tuple[str, ...]
    """Other arguments that the command needs, as help shows them."""

    def __str__(self) -> str:
        return " ".join((*self.words, self.option or self.metavar))


def usual(metavar):
    """A usable value for an argument."""
    known = {"LOG": "session/multipose.csv", "REFERENCE": "session/multipose.csv", "FOLDER": "results"}
    return next((value for word, value in known.items() if word in metavar), "results/result_0.yaml")


def places() -> list[Place]:
    """Every parameter of every command that takes a place, found in the command line itself."""
    return list(_places())


def _places() -> Iterator[Place]:
    for words, command in commands():
        arguments = [each for each in command.params if each.param_type_name == "argument"]
        for each in command.params:
            shown = str(each.metavar or each.name)
            if getattr(each, "is_flag", False) or not _PLACE.search(shown):
                continue
            needed = [other.metavar for other in arguments if other.required and other is not each]
            is_option = each.param_type_name == "option"
            yield Place(words, each.opts[0] if is_option else "", shown, tuple(needed))


def commands() -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command with its words."""
    for name in COMMANDS:
        app = typer.main.get_command(command_line([name]))
        yield from _within((name,), app.commands[name])


def _within(words: tuple[str, ...], command: Any) -> Iterator[tuple[tuple[str, ...], Any]]:
    inner = getattr(command, "commands", {})
    if not inner:
        yield words, command
    for name, each in inner.items():
        yield from _within((*words, name), each)


def hostile_files(folder: Path) -> Mapping[str, str]:
    """Makes places in a folder that no command can use, and gives their paths by what is wrong."""
    locked = folder / "locked"
    locked.mkdir()
    (locked / "log.csv").write_text("time,ax,ay,az\n")
    locked.chmod(0)
    os.mkfifo(folder / "pipe")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(os.path.relpath(folder / "socket"))
    (folder / "loop").symlink_to("loop")
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "digits.json").write_text(f'{{"schema": {"9" * 5000}}}')
    return {
        "a name too long": str(folder / ("x" * 300)),
        "a path too long": str(folder / "/".join(["d" * 100] * 50)),
        "in a locked folder": str(locked / "log.csv"),
        "a locked folder": str(locked),
        "a pipe": str(folder / "pipe"),
        "a socket": str(folder / "socket"),
        "a full device": "/dev/full",
        "an endless device": "/dev/zero",
        "a link around": str(folder / "loop"),
        "a missing name that is no UTF-8": os.fsdecode(os.fsencode(folder) + b"/rob\xe9t.csv"),
        "deep JSON": str(folder / "deep.json"),
        "a number of 5000 digits": str(folder / "digits.json"),
        "a file as a folder": str(folder / "deep.json" / "log.csv"),
    }


class _Header(ctypes.Structure):
    _fields_ = [("version", ctypes.c_uint32), ("pid", ctypes.c_int)]


@contextmanager
def without_rights_of_root() -> Iterator[None]:
    """Heeds permissions of files as for any user: root may read all, and tests often run as root."""
    if os.geteuid() != 0:
        yield
        return
    libc = ctypes.CDLL(None, use_errno=True)
    header, before = _Header(0x20080522, 0), (ctypes.c_uint32 * 6)()
    assert libc.capget(ctypes.byref(header), before) == 0
    less = (ctypes.c_uint32 * 6)(*before)
    less[0] &= ~0b110  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH, of what is in force
    assert libc.capset(ctypes.byref(header), less) == 0
    try:
        yield
    finally:
        assert libc.capset(ctypes.byref(header), before) == 0


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Lets files grow to so many bytes and no further, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@contextmanager
def patient() -> Iterator[None]:
    """Raises where the block takes so long that a command hangs."""

    def give_up(*_: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
