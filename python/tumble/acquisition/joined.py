"""Several logs of one sensor, read as one."""

from __future__ import annotations

from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Recording, SampleProgress


def refuse_other_triads(first: Recording, recording: Recording) -> None:
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
