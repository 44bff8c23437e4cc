"""Standard output and error as commands have them.

A failure of standard output is reported in one line. Characters that a screen cannot show, or would obey, are
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

from tumble.foundation.errors import OutputError
from tumble.foundation.secrets import without_secrets
from tumble.foundation.words import ESCAPED, printable


class _Checked:
    """Passes text on; raises `OutputError` where it cannot be written, as on a full disk."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401 - whatever stands for standard output
        self._stream: Any = stream

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._stream, name)

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
        except BrokenPipeError:
            raise
        except OSError as error:
            # The interpreter must not retry the rest of the output when it ends.
            if sys.__stdout__ is not None and self._stream is sys.__stdout__:
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.__stdout__.fileno())
            raise OutputError(f"standard output: cannot be written: {error.strerror or error}") from error


class _Escaped:
    """Passes text on with all that a terminal would obey escaped."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401 - whatever stands for standard output
        self.drawn: Any = stream
        """Takes text as it is."""

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self.drawn, name)

    def write(self, text: str) -> int:
        """Writes, escaped."""
        self.drawn.write(printable(without_secrets(text)))
        return len(text)


@contextmanager
def checked_output() -> Iterator[None]:
    """Checks what the block prints, to the last byte, and escapes what a terminal would obey.

    Raises `OutputError` where standard output cannot be written. A reader that has closed a pipe wants no
    more: that is no mistake.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ESCAPED)
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
