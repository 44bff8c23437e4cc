"""Folders for recordings beside results, where each attempt keeps its own."""

from __future__ import annotations

import itertools
from pathlib import Path

from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.file_status import stands_there


def next_session_folder(folder: Path) -> Path:
    """Names a folder for the samples of a run beside its results, in which none lie yet."""
    taken = next(number for number in itertools.count(1) if not stands_there(folder / _session_name(number)))
    return folder / _session_name(taken)


def _session_name(number: int) -> str:
    return SESSION_FOLDER if number == 1 else f"{SESSION_FOLDER}-{number}"
