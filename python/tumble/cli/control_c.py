"""Control-C in the midst of a library, an import or the start of a thread: no traceback, and none is lost.

An exception in the midst of an import is shown by the interpreter, or lost in a callback or in a library
that expects others. One in the midst of the start of a worker leaves a thread that the end of the process
waits for, without end. One where the native module first asks numpy for its version ends the process as a
fault of that module; others that call Python from native code do the same. So it is raised in code of ours,
in that of whoever calls it, and where Python waits, and tried again shortly afterwards elsewhere. Where the
interpreter runs code of ours but drops its exceptions, as at the end of an object, it is tried again too.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found] # `signal` imports enum, which takes longer than all else here
import _thread
import os

TYPE_CHECKING = False  # typing takes longer to import, as above
if TYPE_CHECKING:
    import sys

_IMPORTING = "<frozen importlib"
"""Begins the name of the file that the interpreter's own import is in."""
_STARTING = (("submit", os.sep + "thread.py"), ("start", os.sep + "threading.py"))
"""Functions, and ends of their files, in which threads are started and then noted."""
_ASKING_VERSION = "/numpy/lib/_version.py".replace("/", os.sep)
"""Ends the name of the file of numpy that the native module runs once, and where it takes no exception."""
_OURS = __file__.rpartition(os.sep + "cli" + os.sep)[0] + os.sep
"""Begins the names of files of Tumble."""
_LIBRARIES = (os.__file__.rpartition(os.sep)[0] + os.sep, "<frozen ")
"""Begin the names of files of Python itself."""
_PACKAGES = (f"{os.sep}site-packages{os.sep}", f"{os.sep}dist-packages{os.sep}")
"""Stand in the names of files of packages that are installed."""
_WAITING = tuple(
    os.sep + name
    for name in (
        "threading.py",
        "queue.py",
        "selectors.py",
        "socket.py",
        "subprocess.py",
        "connection.py",
        "popen_fork.py",
        "_base.py",
    )
)
"""Ends of the names of files of Python in which it waits for others."""
_AGAIN = 0.02
"""s until Control-C is tried again."""
_MOST_TRIES = 100
"""Tries after which a library is interrupted all the same, as it may wait without end."""
_SHOW_CURSOR = b"\x1b[?25h"


def end_at_control_c() -> object:
    """Ends the process at Control-C at once, and returns what was done before; None outside the main thread.

    It is for as long as nothing is open that had to be closed.
    """
    return _handle(_end_at_once)


def heed_control_c_between_steps() -> object:
    """Raises `KeyboardInterrupt` at Control-C, but not in the midst of a step that could not take it.

    Such are an import, a start of threads, the first use of numpy by the native module, and any step of a
    library that is soon over. The rest is as above.
    """
    return _handle(_between_steps)


class DroppedTriedAgain:
    """While it is entered, a Control-C that the interpreter drops is tried again; other drops are shown."""

    def __enter__(self) -> None:
        """Receives the exceptions that the interpreter drops."""
        import sys

        self._shown = sys.unraisablehook
        sys.unraisablehook = self._dropped

    def __exit__(self, *_: object) -> None:
        """Leaves them to the hook that received them before."""
        import sys

        sys.unraisablehook = self._shown

    def _dropped(self, dropped: sys.UnraisableHookArgs) -> None:
        if dropped.exc_type is KeyboardInterrupt:
            _put_off()
        else:
            self._shown(dropped)


def end_by_signal(number: int) -> None:
    """Ends the process by a signal that it has handled, for the status of that signal; 0 for none."""
    if number:
        import contextlib
        import sys

        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        show_cursor()
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


def show_cursor() -> None:
    """Shows the cursor of a terminal, which a progress bar that was interrupted may have hidden."""
    for descriptor in (1, 2):
        try:
            if os.isatty(descriptor):
                os.write(descriptor, _SHOW_CURSOR)
        except OSError:  # the terminal is closed
            return


def _end_at_once(_number: int, _frame: object) -> None:
    show_cursor()
    os._exit(128 + _signal.SIGINT)  # `ExitCode.INTERRUPTED`, which may be in the midst of its import


class _Tries:
    """Number of times that Control-C was put off since it came."""

    count = 0


def _between_steps(number: int, frame: object) -> None:
    is_late = _Tries.count >= _MOST_TRIES
    if not _is_in_a_step(frame) and (is_late or not _is_of_a_library(frame)):
        _Tries.count = 0
        _signal.default_int_handler(number, frame)
    _Tries.count += 1
    _put_off()


def _put_off() -> None:
    _thread.start_new_thread(_again, (_thread.get_ident(),))


def _is_of_a_library(frame: object) -> bool:
    """Returns whether the innermost step is of Python or of a package that is installed, and no wait."""
    if frame is None:
        return False
    name = frame.f_code.co_filename  # type: ignore[attr-defined]
    if name.startswith(_OURS):
        return False
    if name.startswith(_LIBRARIES) and name.endswith(_WAITING):
        return False
    return name.startswith(_LIBRARIES) or any(each in name for each in _PACKAGES)


def _is_in_a_step(frame: object) -> bool:
    while frame is not None:
        code = frame.f_code  # type: ignore[attr-defined]
        if code.co_filename.startswith(_IMPORTING) or code.co_filename.endswith(_ASKING_VERSION):
            return True
        if any(code.co_name == function and code.co_filename.endswith(file) for function, file in _STARTING):
            return True
        frame = frame.f_back  # type: ignore[attr-defined]
    return False


def _again(main_thread: int) -> None:
    from tumble.foundation import clock

    clock.sleep(_AGAIN)
    # A signal ends a wait of the main thread, as `interrupt_main` does not.
    _signal.pthread_kill(main_thread, _signal.SIGINT)
