"""`LOG:NAME`: a file, and which of its IMUs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.errors import LogError, PlaceError
from tumble.foundation.file_status import exists, is_folder
from tumble.foundation.files import note_input
from tumble.logs import standard_input

if TYPE_CHECKING:
    from tumble.foundation.recording import Recording


@dataclass(frozen=True, slots=True)
class LogSpec:
    """A path that exists, and the name of an IMU in it where one was given."""

    path: Path
    imu: str | None = None


def parse_spec(source: str | Path) -> LogSpec:
    """Splits `LOG:NAME` at the last colon that leaves an existing path; a path that exists is taken whole.

    `-` is standard input.

    Raises `LogError` where no reading of the text names something that exists.
    """
    text = str(source)
    if text == standard_input.NAME:
        return LogSpec(standard_input.piped_log())
    position, hidden = len(text), None
    while position > 0:
        path = Path(text[:position])
        try:
            if exists(path):
                note_input(path)
                return LogSpec(path, text[position + 1 :] or None)
        except PlaceError as error:  # the name of an IMU may be longer than any file's
            hidden = hidden or error
        position = text.rfind(":", 0, position)
    if hidden is not None:
        raise LogError(str(hidden)) from hidden
    parent = Path(text).parent
    hint = "check the path" if is_folder(parent) else f"folder {parent} does not exist either"
    raise LogError(f"{text}: no such file or folder; {hint}")


def files_of(recording: Recording) -> Sequence[Path]:
    """Lists the files that a recording is read from, with all in its folder; none where it is in memory."""
    if recording.metadata.in_memory:
        return ()
    source = parse_spec(recording.metadata.source).path
    return (source, *source.glob("*"))
