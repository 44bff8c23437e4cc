"""Messages about the steps of a run: `--debug`, `TUMBLE_DEBUG=1`, or Python's `logging` at level DEBUG.

Python's `logging` is used where somebody has imported it, and costs nothing where nobody has.
"""

from __future__ import annotations

import sys

DEBUG = 10
"""Level of `logging`, which is not imported for it."""


def debug(module: str, message: str, *figures: object) -> None:
    """Log a message of a module; `figures` take the place of `%s` if it is shown."""
    logging = sys.modules.get("logging")
    if logging is not None and (logger := logging.getLogger(module)).isEnabledFor(DEBUG):
        logger.debug(message, *figures)


def is_debugged(module: str) -> bool:
    """Return whether messages of a module are shown; asked before work that only serves a message."""
    logging = sys.modules.get("logging")
    return logging is not None and bool(logging.getLogger(module).isEnabledFor(DEBUG))
