"""Standard output and error as commands have them.

A failure of standard output is reported in one line, one of standard error nowhere: the exit code reports.
A closed stream is as one that nobody reads. Characters that a screen cannot show, or would obey, are
escaped on both: names of columns, units and topics are text from outside. Drawings pass unchanged by
`drawing`, and `Screen` of `cli/screen.py` escapes its text instead.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any

from tumble.foundation.errors import OutputError, ReaderGoneError
from tumble.foundation.numbers import whole_number
from tumble.foundation.secrets import without_secrets
from tumble.foundation.words import ESCAPED, printable

_WIDEST = 1000
"""Columns of the widest terminal."""


class _Passing:
    """Stands for a stream, but for what it does with text."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401 - whatever stands for a standard stream
        self._stream: Any = stream

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._stream, name)


class _Checked(_Passing):
    """Passes text on.

    Raises `OutputError` where it cannot be written, as on a full disk, `ReaderGoneError` where nobody reads.
    """

    def write(self, text: str) -> int:
        """Writes, or reports why not."""
        with self._refused():
            written: int = self._stream.write(text)
            return written

    def flush(self) -> None:
        """Flushes, or reports why not."""
        with self._refused():
            self._stream.flush()

    @contextmanager
    def _refused(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError as error:
            _discard(self._stream, sys.__stdout__)
            raise ReaderGoneError("the reader of standard output closed it") from error
        except OSError as error:
            _discard(self._stream, sys.__stdout__)
            raise OutputError(f"standard output: cannot be written: {error.strerror or error}") from error


class _Lasting(_Passing):
    """Passes text on, and drops it where standard error cannot be written."""

    def write(self, text: str) -> int:
        """Writes what can be written."""
        with self._dropped():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flushes what can be written."""
        with self._dropped():
            self._stream.flush()

    @contextmanager
    def _dropped(self) -> Iterator[None]:
        try:
            yield
        except OSError:
            _discard(self._stream, sys.__stderr__)


def _discard(stream: Any, of_process: Any) -> None:  # noqa: ANN401 - whatever stands for a stream
    """Has a stream of the process lead nowhere: the interpreter must not retry the rest when it ends."""
    if of_process is not None and stream is of_process:
        os.dup2(os.open(os.devnull, os.O_WRONLY), of_process.fileno())


def bound_width() -> None:
    """Bounds the width that COLUMNS states, by which libraries draw lines of any length."""
    width = whole_number(os.environ.get("COLUMNS", ""))
    if width is None:
        os.environ.pop("COLUMNS", None)
    elif width > _WIDEST:
        os.environ["COLUMNS"] = str(_WIDEST)


def open_closed_streams() -> None:
    """Opens each closed standard stream on what nobody reads, so that no file gets its number.

    Standard input keeps its number alone, as nothing is piped in.
    """
    if sys.stdin is None:
        os.open(os.devnull, os.O_RDONLY)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
            setattr(sys, name, nowhere)


@contextmanager
def lasting_error() -> Iterator[None]:
    """Keeps the exit code of the block where standard error cannot be written, as on a full disk."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr.reconfigure(errors=ESCAPED)
    with redirect_stderr(_Lasting(sys.stderr)):
        yield


class _Escaped(_Passing):
    """Passes text on with all that a terminal would obey escaped."""

    @property
    def drawn(self) -> Any:  # noqa: ANN401
        """Takes text as it is."""
        return self._stream

    def write(self, text: str) -> int:
        """Writes, escaped."""
        self._stream.write(printable(without_secrets(text)))
        return len(text)


@contextmanager
def checked_output() -> Iterator[None]:
    """Checks what the block prints, to the last byte, and escapes what a terminal would obey.

    Raises `OutputError` where standard output cannot be written, `ReaderGoneError` where its reader has
    closed it.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors=ESCAPED)
    checked = _Checked(sys.stdout)
    with redirect_stdout(_Escaped(checked)), redirect_stderr(_Escaped(sys.stderr)):
        try:
            yield
        finally:
            checked.flush()


def drawn(stream: Any) -> Any:  # noqa: ANN401 - whatever stands for standard output or error
    """Returns what takes escape sequences of our own, for text in which there are none of others."""
    return getattr(stream, "drawn", stream)


@contextmanager
def drawing() -> Iterator[None]:
    """Passes drawings of the block through standard output and error unchanged."""
    with redirect_stdout(drawn(sys.stdout)), redirect_stderr(drawn(sys.stderr)):
        yield
