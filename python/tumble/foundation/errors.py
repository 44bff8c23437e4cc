"""Errors a user can correct. Anything else that is raised is a bug of ours."""

from __future__ import annotations

from collections.abc import Sequence

from tumble.foundation.secrets import without_secrets
from tumble.foundation.words import plain


def shown(text: str) -> str:
    """Returns text as messages show it: on one line, and without the secrets of addresses."""
    return plain(without_secrets(text, is_message=True))


class TumbleError(Exception):
    """A mistake of the user in one line: cause, place, reason and remedy.

    `why` is the line without what it is about. The command line prints the line and exits with code 2; a bug
    keeps its traceback and exits 1.
    """

    def __init__(self, why: str, about: str = "") -> None:
        why, about = shown(why), shown(about)
        super().__init__(f"{about}: {why}" if about else why)
        self.why = why
        self.about = about
        self.is_told = False
        """True if a live session has reported it as its last event."""

    @property
    def reasons(self) -> tuple[str, ...]:
        """Lines that state the mistakes: `why`, or one for each of several."""
        return (self.why,)


class CommandError(TumbleError):
    """A command line that lacks an argument, or holds an unknown option or value."""


class PlaceError(TumbleError):
    """A file or folder that cannot be looked at or read."""


class LogError(TumbleError):
    """A log cannot be read, or holds data of no IMU."""


class TableError(TumbleError):
    """A rate table refuses, is silent, or was commanded beyond its limits."""


class ArrayError(TumbleError):
    """An array that holds no numbers, or has an unusable shape."""


class CalibrationFileError(TumbleError):
    """A calibration, pose list or limits file does not hold what its schema asks for."""


class ProcedureError(TumbleError):
    """The recordings do not show what the procedure needs."""


class TargetsError(ProcedureError):
    """None of the targets can be calibrated, each for a reason of its own."""

    def __init__(self, failures: Sequence[str]) -> None:
        super().__init__("; ".join(failures))
        self._failures = tuple(map(shown, failures))

    @property
    def reasons(self) -> tuple[str, ...]:
        """A line for each target."""
        return self._failures


class OutputError(TumbleError):
    """A result cannot be written; what was there before is untouched."""


class ReaderGoneError(OSError):
    """End of standard output, whose reader closed it: it wants no more, which is no mistake.

    Libraries that draw and parse commands take a `BrokenPipeError` for a failure.
    """
