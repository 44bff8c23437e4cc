"""Warnings of libraries, of which no user can make anything, kept from standard error."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from tumble.foundation.debugging import debug


@contextmanager
def without_library_chatter() -> Iterator[None]:
    """Passes warnings of the block to the debug log.

    A `RuntimeWarning` of numpy means a number that is infinite or missing, which procedures report
    themselves.
    """
    with warnings.catch_warnings():
        warnings.showwarning = _to_debug_log
        yield


def _to_debug_log(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    debug(__name__, "%s at %s:%s: %s", category.__name__, filename, lineno, message)
