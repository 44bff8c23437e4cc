"""`--debug` and `TUMBLE_DEBUG`: what the command does, on standard error, with times and names of modules."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import logging

OPTION = "--debug"
VARIABLE = "TUMBLE_DEBUG"


def without_debug(words: Sequence[str]) -> tuple[list[str], bool]:
    """Take `--debug` out of the words before any `--`; true if it, or the variable, was there."""
    end = words.index("--") if "--" in words else len(words)
    kept = [word for word in words[:end] if word != OPTION]
    return [*kept, *words[end:]], len(kept) < end or os.environ.get(VARIABLE, "") not in ("", "0")


@contextmanager
def debugged(words: Sequence[str]) -> Iterator[None]:
    """Show the messages of all modules while the block runs, and when it ended."""
    import logging

    shown = logging.StreamHandler(sys.stderr)  # as commands have it, which escapes names from outside
    shown.setFormatter(logging.Formatter("tumble: %(relativeCreated)7.0f ms %(name)s: %(message)s"))
    logger, before = logging.getLogger("tumble"), logging.getLogger("tumble").level
    logger.addHandler(shown)
    logger.setLevel(logging.DEBUG)
    try:
        _say_what_runs(logger.getChild("cli"), words)
        yield
        logger.getChild("cli").debug("done")
    except Exception:
        logger.getChild("cli").debug("ended by", exc_info=True)
        raise
    finally:
        logger.removeHandler(shown)
        logger.setLevel(before)


def _say_what_runs(logger: logging.Logger, words: Sequence[str]) -> None:
    import platform
    from importlib.metadata import version

    from tumble.foundation.file_status import working_folder

    what = f"{platform.python_implementation()} {platform.python_version()} on {platform.platform()}"
    logger.debug("tumble %s, %s, in %s: %s", version("tumble-imu"), what, working_folder(), " ".join(words))
