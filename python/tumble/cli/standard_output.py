"""Standard output that says in one line why it takes no more; what a screen cannot show is escaped."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

from tumble.errors import OutputError
from tumble.words import ESCAPED


class _Checked:
    """Passes text on; raises `OutputError` where it cannot be written, as on a full disk."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401 - whatever stands for standard output
        self._stream: Any = stream

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, or say why not."""
        with self._refused():
            written: int = self._stream.write(text)
            return written

    def flush(self) -> None:
        """Flush, or say why not."""
        with self._refused():
            self._stream.flush()

    @contextmanager
    def _refused(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            raise
        except OSError as error:
            # What is left is not to be tried again when the interpreter ends.
            if sys.__stdout__ is not None and self._stream is sys.__stdout__:
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.__stdout__.fileno())
            raise OutputError(f"standard output: cannot be written: {error.strerror or error}") from error


@contextmanager
def checked_standard_output() -> Iterator[None]:
    """Check what the block prints, to the last byte.

    Raises `OutputError` where it cannot be written. A reader that has closed a pipe wants no more: that is no
    mistake.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ESCAPED)
    checked = _Checked(sys.stdout)
    with redirect_stdout(checked):
        try:
            yield
        finally:
            checked.flush()
