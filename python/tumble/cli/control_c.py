"""Control-C while libraries are imported: no traceback, and none that is lost.

An exception in the midst of an import is shown by the interpreter, or lost in a callback or in a library
that expects others.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found] # `signal` imports enum, which takes longer than all else here
import _thread
import os

from tumble.cli.exit_code import ExitCode

_IMPORTING = "<frozen importlib"
"""Begins the name of the file that the interpreter's own import is in."""
_AGAIN = 0.02
"""s until Control-C is tried again."""


def end_at_control_c() -> object:
    """End the process at Control-C at once, and give what was done before; None outside the main thread.

    It is for as long as nothing is open that had to be closed.
    """
    return _handle(lambda *_: os._exit(ExitCode.INTERRUPTED))


def heed_control_c_after_imports() -> object:
    """Raise `KeyboardInterrupt` at Control-C, but never in the midst of an import; the rest is as above."""
    return _handle(_after_imports)


def restore(handler: object) -> None:
    """Do at Control-C what was done before."""
    if handler is not None:
        _signal.signal(_signal.SIGINT, handler)


def _handle(handler: object) -> object:
    try:
        return _signal.signal(_signal.SIGINT, handler)
    except ValueError:
        return None


def _after_imports(number: int, frame: object) -> None:
    if not _is_importing(frame):
        _signal.default_int_handler(number, frame)
    _thread.start_new_thread(_again, ())


def _is_importing(frame: object) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTING):  # type: ignore[attr-defined]
            return True
        frame = frame.f_back  # type: ignore[attr-defined]
    return False


def _again() -> None:
    import time

    time.sleep(_AGAIN)
    _thread.interrupt_main()
