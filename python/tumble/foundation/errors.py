"""Errors a user can correct. Anything else that is raised is a bug of ours."""

from __future__ import annotations

from tumble.foundation.secrets import without_secrets
from tumble.foundation.words import plain


class TumbleError(Exception):
    """A mistake of the user in one line: cause, place, reason and remedy.

    `why` is the line without what it is about. The command line prints the line and exits with code 2; a bug
    keeps its traceback and exits 1.
    """

    def __init__(self, why: str, about: str = "") -> None:
        why, about = plain(without_secrets(why)), plain(without_secrets(about))
        super().__init__(f"{about}: {why}" if about else why)
        self.why = why
        self.about = about
        self.is_told = False
        """True if a live session has reported it as its last event."""


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


class OutputError(TumbleError):
    """A result cannot be written; what was there before is untouched."""
