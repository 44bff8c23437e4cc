"""Several logs of one sensor, read as one."""

from __future__ import annotations

from collections.abc import Sequence

from tumble.acquisition.stamps import open_sampled
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Recording, RecordingSource, SampleProgress, sources_of
from tumble.foundation.serials import refuse_several_units
from tumble.logs import ReadOptions


def open_joined(
    sources: RecordingSource | Sequence[RecordingSource], read: ReadOptions | None
) -> tuple[Recording, ...]:
    """Opens the logs of one sensor.

    Raises `TumbleError`, in one line, where one cannot be read, holds other triads than the first, or states
    another serial number.
    """
    recordings = tuple(open_sampled(source, read) for source in sources_of(sources))
    try:
        refuse_several_units((each.metadata.serial for each in recordings), "logs")
    except ProcedureError as error:
        raise ProcedureError(error.why, about=", ".join(each.name for each in recordings)) from None
    for recording in recordings[1:]:
        _refuse_other_triads(recordings[0], recording)
    return recordings


def _refuse_other_triads(first: Recording, recording: Recording) -> None:
    """Raises `ProcedureError`, in one line, where a log holds other triads than the first."""
    if recording.metadata.triads != first.metadata.triads:
        raise ProcedureError(
            f"{recording.name}: holds {' and '.join(recording.metadata.triads)} readings, "
            f"{first.name} {' and '.join(first.metadata.triads)}; join logs of one sensor only"
        )


def progress_of_log(progress: SampleProgress | None, number: int, of: int) -> SampleProgress | None:
    """Counts the samples of the first of two passes over a log, and expects as many in each of all."""
    if progress is None:
        return None
    return lambda done, expected: progress(done, None if expected is None or number else 2 * of * expected)
