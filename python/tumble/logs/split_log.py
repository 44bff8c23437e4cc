"""Files into which a recorder split one log, as `rosbag record --split` and loggers that rotate files do.

The stamps of each follow on those of another: the pause between them is one that the core bridges within a
log, `GAP_INTERVALS` of the interval of the samples. Neither table nor hand brings a unit from pose to pose in
so short a time, so that files of one pose each stay apart, as do files whose clock starts anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from tumble import _core
from tumble.foundation.recording import Metadata, Recording
from tumble.logs.checks import ChunkStream
from tumble.logs.units import usual_step

Files: TypeAlias = tuple[Recording, ...]


@dataclass(frozen=True, slots=True)
class _Beginning:
    """First stamp of a file and the usual step of its stamps, s."""

    start: float
    step: float


def split_logs(files: Sequence[Recording]) -> tuple[Files, ...]:
    """Returns the files of each log in the order of their stamps; logs are in the order of their first files.

    Reads a file to its end only where another may follow on it.
    """
    beginnings = [_beginning(file) for file in files]
    claims = [_following(number, files, beginnings) for number in range(len(files))]
    # One file cannot follow on two: then they are of several units, or clocks agree by chance.
    following = {
        before: after for before, after in enumerate(claims) if after is not None and claims.count(after) == 1
    }
    logs = []
    for first in sorted(set(range(len(files))) - set(following.values())):
        log = [first]
        while log[-1] in following:
            log.append(following[log[-1]])
        logs.append(tuple(files[number] for number in log))
    return tuple(logs)


def _beginning(file: Recording) -> _Beginning | None:
    """Returns where a file begins; None of one without samples."""
    stream = file.chunks()
    first = next(stream, None)
    if isinstance(stream, ChunkStream):
        stream.close()
    return None if first is None else _Beginning(float(first.time[0]), usual_step(first.time))


def _following(
    number: int, files: Sequence[Recording], beginnings: Sequence[_Beginning | None]
) -> int | None:
    """Returns the number of the file whose stamps follow on those of file `number`; None where none do."""
    own = beginnings[number]
    if own is None:
        return None
    kind = _kind(files[number].metadata)
    starts = {
        other.start: k
        for k, other in enumerate(beginnings)
        if other is not None and other.start > own.start and _kind(files[k].metadata) == kind
    }
    end = own.start
    stream = files[number].chunks()
    while starts and (chunk := next(stream, None)) is not None:
        end = float(chunk.time[-1])
        # A file that begins before the end of this one is of another unit, or of another clock.
        starts = {start: k for start, k in starts.items() if start > end}
    if isinstance(stream, ChunkStream):
        stream.close()
    if not starts:
        return None
    next_start = min(starts)
    return starts[next_start] if next_start - end <= _core.GAP_INTERVALS * own.step else None


def _kind(metadata: Metadata) -> tuple[object, ...]:
    """Returns what is the same in all files of one log."""
    return (
        metadata.format,
        metadata.frame,
        metadata.serial,
        metadata.channels,
        metadata.body,
        metadata.already_corrected,
        metadata.accelerometer_unit.name,
        metadata.gyroscope_unit.name,
        metadata.time_unit.name,
    )
