"""Exit codes of all commands, which docs/how-to/exit-codes.md explains."""

from __future__ import annotations


class ExitCode:
    """Exit codes. Plain numbers, so that nothing has to be imported before Control-C is heeded."""

    DONE = 0
    """Everything was done, and nothing is known to be wrong with it."""
    BUG = 1
    """Python's own, after a traceback."""
    USER_ERROR = 2
    """Nothing could be done; one line gives the reason."""
    NOT_ALL_WELL = 3
    """Results are written, and something in them is known to be wrong or was not shown."""
    INTERRUPTED = 130
    """Control-C: 128 and the number of the signal, as shells have it."""
    READER_GONE = 141
    """The reader of standard output closed it: 128 and the number of SIGPIPE, as shells have it."""
