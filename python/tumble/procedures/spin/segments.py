"""A recording cut into rests and motions, with the samples of what may be a spin."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tumble.acquisition.acquire import corrected
from tumble.acquisition.standstills import standstills
from tumble.calibration.document import Calibration
from tumble.foundation.recording import FloatArray, Recording, SampleProgress
from tumble.foundation.results import Rest
from tumble.logs import ChunkStream

LONGEST_SPIN = 600.0
"""s without a rest; what goes on for longer is a drive, and its samples are not kept."""
LONGEST_REST = 120.0
"""s of which the samples are kept; a longer rest ends one spin and begins another."""
SHORTEST_REST = 1.0
"""s, as the segmenter has it."""
LARGEST_BIAS_CHANGE = 0.02
"""rad/s by which the bias of a gyroscope may differ between two rests of one recording."""


@dataclass(frozen=True, slots=True, eq=False)
class SpinSamples:
    """Successive samples in memory: (n,) s, (n, 3) m/s^2, (n, 3) rad/s."""

    time: FloatArray
    accelerometer: FloatArray
    gyroscope: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def joined(cls, parts: Sequence[SpinSamples]) -> SpinSamples:
        """One after the other."""
        return cls(
            np.concatenate([part.time for part in parts]),
            np.concatenate([part.accelerometer for part in parts]),
            np.concatenate([part.gyroscope for part in parts]),
        )

    def between(self, start: float, end: float) -> SpinSamples:
        """Those from `start` up to but without `end`."""
        first, last = np.searchsorted(self.time, [start, end])
        kept = slice(int(first), int(last))
        return SpinSamples(self.time[kept], self.accelerometer[kept], self.gyroscope[kept])


@dataclass(frozen=True, slots=True)
class Interval:
    """A stretch of time, s of the recording's clock, from `start` up to but without `end`."""

    start: float
    end: float

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.end - self.start

    def within(self, other: Interval) -> Interval:
        """Cuts it to what lies in the other."""
        return Interval(max(self.start, other.start), min(self.end, other.end))


@dataclass(frozen=True, slots=True, eq=False)
class UnreadSegment:
    """Where a rest or a motion lies; the samples are yet to be read."""

    interval: Interval
    rest: Rest | None = None
    """None for a motion."""


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A rest or a motion with its samples."""

    samples: SpinSamples
    rest: Rest | None = None
    """None for a motion."""

    @property
    def start(self) -> float:
        """Time of the first sample, s."""
        return float(self.samples.time[0])

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return float(self.samples.time[-1])

    def between(self, start: float, end: float) -> Segment:
        """Cuts out the part from `start` up to but without `end`."""
        return Segment(self.samples.between(start, end), self.rest)


def rest_from(samples: SpinSamples) -> Rest:
    """Describes samples, at least two, as a rest; the noise is taken to be white."""
    root = math.sqrt(len(samples))
    return Rest(
        start=float(samples.time[0]),
        end=float(samples.time[-1]),
        samples=len(samples),
        specific_force=samples.accelerometer.mean(axis=0),
        angular_rate=samples.gyroscope.mean(axis=0),
        specific_force_sigma=samples.accelerometer.std(axis=0) / root,
        angular_rate_sigma=samples.gyroscope.std(axis=0) / root,
    )


def true_rests(rests: Sequence[Rest]) -> list[Rest]:
    """Omits parts as quiet as a rest that turn, as a robot on a level floor may.

    At rest the gyroscope always reads the same, its bias. Repetition shows which of several rates that is: a
    robot comes back to rest, seldom to one speed. Where none comes back, the smallest is the bias.
    """
    if not rests:
        return []
    rates = np.array([rest.angular_rate for rest in rests])
    noise = np.array([np.linalg.norm(rest.angular_rate_sigma) for rest in rests])
    apart = np.linalg.norm(rates[:, None] - rates[None], axis=2)
    alike = apart < LARGEST_BIAS_CHANGE + 6.0 * np.hypot(noise[:, None], noise[None])
    returned = alike[0] & (np.arange(len(rests)) >= _first_other(alike[0]))
    chosen = 0 if returned.any() else int(np.argmin(np.linalg.norm(rates, axis=1)))
    return [rest for rest, same in zip(rests, alike[chosen], strict=True) if same]


def alike_rests(rests: Sequence[Rest]) -> tuple[Rest, ...]:
    """Keeps of rests those of the rate of the first, a rest for certain: a steady turn is as quiet."""
    if not rests:
        return ()
    first = rests[0]

    def apart(rest: Rest) -> bool:
        noise = np.hypot(np.linalg.norm(rest.angular_rate_sigma), np.linalg.norm(first.angular_rate_sigma))
        off = np.linalg.norm(rest.angular_rate - first.angular_rate)
        return bool(off >= LARGEST_BIAS_CHANGE + 6.0 * noise)

    return tuple(rest for rest in rests if not apart(rest))


def _first_other(alike: np.typing.NDArray[np.bool_]) -> int:
    """Index of the first that is not like the first; their count if all are."""
    others = np.flatnonzero(~alike)
    return int(others[0]) if len(others) else len(alike)


def segments_within(window: Interval, rests: Sequence[Rest]) -> Iterator[UnreadSegment]:
    """Rests and motions of a window, in turn; of one spin, each begins where the one before ends."""
    reached = window.start
    for rest in rests:
        inside = Interval(rest.start, math.nextafter(rest.end, math.inf)).within(window)
        if inside.seconds < SHORTEST_REST:
            continue
        if inside.start > reached:
            yield UnreadSegment(Interval(reached, inside.start))
        clipped = replace(rest, start=max(rest.start, inside.start), end=min(rest.end, inside.end))
        yield from _shortened(UnreadSegment(inside, clipped))
        reached = inside.end
    if reached < window.end:
        yield UnreadSegment(Interval(reached, window.end))


def _shortened(unread: UnreadSegment) -> Iterator[UnreadSegment]:
    """Returns a rest as it is, or only its ends if it is long."""
    start, end = unread.interval.start, unread.interval.end
    if unread.interval.seconds <= LONGEST_REST:
        yield unread
        return
    yield replace(unread, interval=Interval(start, start + 0.5 * LONGEST_REST))
    yield replace(unread, interval=Interval(end - 0.5 * LONGEST_REST, end))


def read_intervals(
    recording: Recording,
    calibration: Calibration | None,
    intervals: Sequence[Interval],
    progress: SampleProgress | None = None,
) -> Iterator[SpinSamples]:
    """Reads a recording once and returns the samples of each interval, in order, as soon as it has passed.

    Only the samples of one interval are held at a time.
    """
    waiting = iter(intervals)
    interval = next(waiting, None)
    parts: list[SpinSamples] = []
    done = 0
    stream = recording.chunks()
    for chunk in stream:
        moving = standstills(chunk, recording.metadata.triads).moving(chunk)
        piece = SpinSamples(moving.time, *corrected(moving, calibration))
        done += len(chunk)
        if progress is not None:
            progress(done, stream.expected if isinstance(stream, ChunkStream) else None)
        while interval is not None:
            parts.append(piece.between(interval.start, interval.end))
            if chunk.time[-1] < interval.end:
                break
            yield SpinSamples.joined(parts)
            parts, interval = [], next(waiting, None)
    while interval is not None:
        yield (
            SpinSamples.joined(parts)
            if parts
            else SpinSamples(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        )
        parts, interval = [], next(waiting, None)
