"""A recording cut into rests and motions, with the samples of what may be a spin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tumble.acquisition.acquire import corrected
from tumble.calibration.document import Calibration
from tumble.logs import ChunkStream
from tumble.recording import FloatArray, Recording
from tumble.results import Rest

LONGEST_SPIN = 600.0
"""s without a rest; what goes on for longer is a drive, and its samples are not kept."""
LONGEST_REST = 120.0
"""s of which the samples are kept; a longer rest ends one spin and begins another."""
SHORTEST_REST = 1.0
"""s, as the segmenter has it."""
LARGEST_BIAS_CHANGE = 0.02
"""rad/s by which the bias of a gyroscope may differ between two rests of one recording."""

Progress = Callable[[int, int | None], None]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Successive samples in memory: (n,) s, (n, 3) m/s^2, (n, 3) rad/s."""

    time: FloatArray
    accelerometer: FloatArray
    gyroscope: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def joined(cls, parts: Sequence[Samples]) -> Samples:
        """One after the other."""
        return cls(
            np.concatenate([part.time for part in parts]),
            np.concatenate([part.accelerometer for part in parts]),
            np.concatenate([part.gyroscope for part in parts]),
        )

    def between(self, start: float, end: float) -> Samples:
        """Those from `start` up to but without `end`."""
        first, last = np.searchsorted(self.time, [start, end])
        kept = slice(int(first), int(last))
        return Samples(self.time[kept], self.accelerometer[kept], self.gyroscope[kept])


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of the recording's clock, s, from `start` up to but without `end`."""

    start: float
    end: float

    @property
    def seconds(self) -> float:
        """How long it is."""
        return self.end - self.start

    def within(self, other: Span) -> Span:
        """Cut it to what lies in the other."""
        return Span(max(self.start, other.start), min(self.end, other.end))


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where a rest or a motion lies; the samples are yet to be read."""

    span: Span
    rest: Rest | None = None
    """None for a motion."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A rest or a motion with its samples."""

    samples: Samples
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

    def between(self, start: float, end: float) -> Stretch:
        """Cut out the part from `start` up to but without `end`."""
        return Stretch(self.samples.between(start, end), self.rest)


def as_rest(samples: Samples) -> Rest:
    """Describe samples, at least two, as a rest; the noise is taken to be white."""
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


def standing(rests: Sequence[Rest]) -> list[Rest]:
    """Leave out what is as quiet as a rest and yet turns, which a robot on a level floor does.

    At rest the gyroscope always says the same, its bias. Which of several rates that is, repetition tells: a
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


def _first_other(alike: np.typing.NDArray[np.bool_]) -> int:
    """Index of the first that is not like the first; their count if all are."""
    others = np.flatnonzero(~alike)
    return int(others[0]) if len(others) else len(alike)


def places_within(window: Span, rests: Sequence[Rest]) -> Iterator[Place]:
    """Rests and motions of a window, in turn; of one spin, each begins where the one before ends."""
    reached = window.start
    for rest in rests:
        inside = Span(rest.start, math.nextafter(rest.end, math.inf)).within(window)
        if inside.seconds < SHORTEST_REST:
            continue
        if inside.start > reached:
            yield Place(Span(reached, inside.start))
        yield from _kept_of(Place(inside, _clipped(rest, inside)))
        reached = inside.end
    if reached < window.end:
        yield Place(Span(reached, window.end))


def _clipped(rest: Rest, span: Span) -> Rest:
    return replace(rest, start=max(rest.start, span.start), end=min(rest.end, span.end))


def _kept_of(place: Place) -> Iterator[Place]:
    """Give a rest as it is, or only its ends if it is long."""
    start, end = place.span.start, place.span.end
    if place.span.seconds <= LONGEST_REST:
        yield place
        return
    yield replace(place, span=Span(start, start + 0.5 * LONGEST_REST))
    yield replace(place, span=Span(end - 0.5 * LONGEST_REST, end))


def read_spans(
    recording: Recording,
    calibration: Calibration | None,
    spans: Sequence[Span],
    progress: Progress | None = None,
) -> Iterator[Samples]:
    """Read a recording once and give the samples of each span as soon as it is past; the spans are in order.

    Only the samples of one span are held at a time.
    """
    waiting = iter(spans)
    span = next(waiting, None)
    parts: list[Samples] = []
    done = 0
    stream = recording.chunks()
    for chunk in stream:
        piece = Samples(chunk.time, *corrected(chunk, calibration))
        done += len(chunk)
        if progress is not None:
            progress(done, stream.expected if isinstance(stream, ChunkStream) else None)
        while span is not None:
            parts.append(piece.between(span.start, span.end))
            if chunk.time[-1] < span.end:
                break
            yield Samples.joined(parts)
            parts, span = [], next(waiting, None)
    while span is not None:
        yield Samples.joined(parts) if parts else Samples(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        parts, span = [], next(waiting, None)
