"""Messages that Ray prints among the output of a program: of nodes that went, for one."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

LISTENER = "ray_listen_error_messages"
"""Thread of Ray that prints them to standard output, whatever `log_to_driver` is; that would corrupt JSON."""


class RayMessages:
    """Keeps messages of Ray out of standard output until closed; a fleet reports lost workers itself."""

    def __init__(self) -> None:
        self._before = sys.stdout
        self._output: Any = _OutputOfOthers(sys.stdout)
        sys.stdout = self._output

    @contextmanager
    def dropped_here(self) -> Iterator[None]:
        """Drops what this thread prints while the block runs: Ray prints its last messages as it ends."""
        self._output.dropped.add(threading.get_ident())
        try:
            yield
        finally:
            self._output.dropped.discard(threading.get_ident())

    def close(self) -> None:
        """Gives standard output back, unless it was replaced in the meantime."""
        if sys.stdout is self._output:
            sys.stdout = self._before


class _OutputOfOthers:
    """Standard output but for what the listener and threads in `dropped` print."""

    def __init__(self, output: TextIO) -> None:
        self._output = output
        self.dropped: set[int] = set()

    def write(self, text: str) -> int:
        """Writes what any other thread prints; returns the number of letters."""
        thread = threading.current_thread()
        is_dropped = thread.name == LISTENER or thread.ident in self.dropped
        return len(text) if is_dropped else self._output.write(text)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - that of the stream
        return getattr(self._output, name)
