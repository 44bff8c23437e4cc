"""Work in a fork of this process, which is killed between two of its operations on files."""

from __future__ import annotations

import os
import signal
import sys
import threading

OPERATIONS = frozenset(
    {
        "open",
        "write",
        "writelines",
        "flush",
        "close",
        "__exit__",
        "fsync",
        "truncate",
        "rename",
        "replace",
        "unlink",
        "remove",
        "mkdir",
        "rmdir",
        "link",
        "symlink",
    }
)
"""Names of functions in C that change files; what a buffer holds is lost where one comes before `flush`."""


def killed_at(work, number):
    """Does some work in a fork, which is killed before its operation of a number; returns whether it was.

    With a number of 0 it is not. An error ends the test: nothing but a kill may end the work.
    """
    child = os.fork()
    if not child:
        _work_as_child(work, number)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        assert os.WTERMSIG(status) == signal.SIGKILL, status
        return True
    assert os.WEXITSTATUS(status) == 0, "the work ended with an error; see its output"
    return False


def _work_as_child(work, number):
    count = 0

    def called(_frame, event, function):
        nonlocal count
        if event == "c_call" and function.__name__ in OPERATIONS:
            count += 1
            if count == number:
                os.kill(os.getpid(), signal.SIGKILL)

    try:
        threading.setprofile(called)
        sys.setprofile(called)
        work()
        sys.setprofile(None)
    except BaseException:
        sys.setprofile(None)
        sys.excepthook(*sys.exc_info())
        os._exit(1)
    os._exit(0)
