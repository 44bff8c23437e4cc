"""Control-C while libraries are imported and threads are started: no traceback, and none that is lost.

An exception in the midst of an import is shown by the interpreter, or lost in a callback or in a library
that expects others. One in the midst of the start of a worker leaves a thread that the end of the process
waits for, without end. One where the native module first asks numpy for its version ends the process as a
fault of that module.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found] # `signal` imports enum, which takes longer than all else here
import _thread
import os

from tumble.cli.exit_code import ExitCode

_IMPORTING = "<frozen importlib"
"""Begins the name of the file that the interpreter's own import is in."""
_STARTING = ("submit", os.sep + "thread.py")
"""Function, and end of its file, in which an executor starts threads and then notes which."""
_ASKING_VERSION = "/numpy/lib/_version.py".replace("/", os.sep)
"""Ends the name of the file of numpy that the native module runs once, and where it takes no exception."""
_AGAIN = 0.02
"""s until Control-C is tried again."""


def end_at_control_c() -> object:
    """Ends the process at Control-C at once, and returns what was done before; None outside the main thread.

    It is for as long as nothing is open that had to be closed.
    """
    return _handle(lambda *_: os._exit(ExitCode.INTERRUPTED))


def heed_control_c_between_steps() -> object:
    """Raises `KeyboardInterrupt` at Control-C, but never in the midst of a step that could not take it.

    Such are an import, a start of threads, and the first use of numpy by the native module. The rest is as
    above.
    """
    return _handle(_between_steps)


def end_by_signal(number: int) -> None:
    """Ends the process by a signal that it has handled, for the status of that signal; 0 for none."""
    if number:
        import contextlib
        import sys

        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        _signal.signal(number, _signal.SIG_DFL)
        os.kill(os.getpid(), number)


def restore(handler: object) -> None:
    """Restores the earlier handling of Control-C."""
    if handler is not None:
        _signal.signal(_signal.SIGINT, handler)


def _handle(handler: object) -> object:
    try:
        return _signal.signal(_signal.SIGINT, handler)
    except ValueError:
        return None


def _between_steps(number: int, frame: object) -> None:
    if not _is_in_a_step(frame):
        _signal.default_int_handler(number, frame)
    _thread.start_new_thread(_again, (_thread.get_ident(),))


def _is_in_a_step(frame: object) -> bool:
    function, file = _STARTING
    while frame is not None:
        code = frame.f_code  # type: ignore[attr-defined]
        if code.co_filename.startswith(_IMPORTING) or code.co_filename.endswith(_ASKING_VERSION):
            return True
        if code.co_name == function and code.co_filename.endswith(file):
            return True
        frame = frame.f_back  # type: ignore[attr-defined]
    return False


def _again(main_thread: int) -> None:
    from tumble.foundation import clock

    clock.sleep(_AGAIN)
    # A signal ends a wait of the main thread, as `interrupt_main` does not.
    _signal.pthread_kill(main_thread, _signal.SIGINT)
