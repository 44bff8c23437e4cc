"""Recordings whose stamps come late, read with the times at which the sensor took its samples.

A sensor samples evenly, its reader stamps when it comes to it. Procedures that integrate or count time open
logs here, so that late stamps are no concern of theirs (docs/theory/clocks.md, "Stamps that come late").
Exact stamps stay as they are, bit for bit. The first chunk of a recording decides whether they are exact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from tumble import _core
from tumble.foundation.arrival import ArrivalWatch
from tumble.foundation.recording import Chunk, FloatArray, Recording, RecordingSource
from tumble.foundation.words import count_of
from tumble.logs import ChunkStream, Counts, ReadOptions, open_recording

MILLISECONDS = 1e3
LARGEST_OF_CRYSTALS = 2e-4
"""Difference of the pace of two clocks that crystals have: 100 ppm each, as cheap ones age and warm."""

Fitted: TypeAlias = tuple[_core.SampleTimes | None, str, float]
"""Times by row, None where stamps stay; a remark, or nothing; 1-sigma of stamps that stay, s."""


class SampledStream(ChunkStream):
    """A pass over a recording with fitted times; counts and what is expected are those of the pass below."""

    def __init__(self, stream: Iterator[Chunk], times: _core.SampleTimes) -> None:
        self._times, self._stream, self._row = times, stream, 0
        self.counts, self.expected = Counts(), None
        if isinstance(stream, ChunkStream):
            self.counts, self.expected = stream.counts, stream.expected

    def __next__(self) -> Chunk:
        chunk = next(self._stream)
        time = self._times.times(self._row, len(chunk))
        self._row += len(chunk)
        return replace(chunk, time=time)

    def close(self) -> None:
        """Stops reading and lets go of the file."""
        if isinstance(self._stream, ChunkStream):
            self._stream.close()


def open_sampled(source: RecordingSource, options: ReadOptions | None = None) -> Recording:
    """Opens a log as `open_recording` does, with the times at which samples were taken.

    Raises `LogError` where it cannot be read.
    """
    return with_sample_times(open_recording(source, options))


def with_sample_times(recording: Recording) -> Recording:
    """Fits even times where stamps come late; a recording whose stamps are exact is given back as it is.

    All stamps of a recording whose stamps are late are held at once, 8 bytes a sample.
    """
    if recording.parts:
        parts = tuple(with_sample_times(part) for part in recording.parts)
        if parts == recording.parts:
            return recording
        of_parts = [remark for part in parts for remark in part.metadata.remarks]
        metadata = replace(
            recording.metadata,
            remarks=tuple(dict.fromkeys((*recording.metadata.remarks, *of_parts))),
            pace_sigma=max(part.metadata.pace_sigma for part in parts),
            fit_sigmas=max(part.metadata.fit_sigmas for part in parts),
            stamp_sigma=max(part.metadata.stamp_sigma for part in parts),
        )
        return replace(
            recording,
            metadata=metadata,
            open=lambda: (chunk for part in parts for chunk in part.chunks()),
            parts=parts,
        )
    if recording.metadata.rate is not None:
        return recording
    first = _first_chunk(recording)
    if first is None:
        return recording
    if first.received is not None:
        recording = _beside_arrival(recording)
    if not _core.stamps_are_late(np.ascontiguousarray(first.time)):
        return recording
    times, remark, stamp_sigma = _fitted(recording)
    remarks = (*recording.metadata.remarks, *([remark] if remark else []))
    metadata = replace(recording.metadata, remarks=remarks, stamp_sigma=stamp_sigma)
    if times is None:
        return replace(recording, metadata=metadata) if remark or stamp_sigma else recording
    pace = float(np.hypot(metadata.pace_sigma, times.rate_sigma))
    metadata = replace(metadata, pace_sigma=pace, fit_sigmas=(times.sigma, times.rate_sigma))
    return replace(recording, metadata=metadata, open=lambda: SampledStream(recording.chunks(), times))


def _beside_arrival(recording: Recording) -> Recording:
    """Holds stamps against the times of their recording: where both drift apart, either may be right.

    The difference of both clocks is then 1-sigma of the pace (docs/theory/clocks.md).
    """
    watch = ArrivalWatch()
    for chunk in recording.chunks():
        if chunk.received is not None:
            watch.push(chunk.time, chunk.received)
    found = watch.conclude()
    if found is None or not found.drifts:
        return recording
    metadata = recording.metadata
    pace = float(np.hypot(metadata.pace_sigma, found.skew))
    remarks = metadata.remarks
    if abs(found.skew) > LARGEST_OF_CRYSTALS:
        slow = "slow" if found.skew > 0.0 else "fast"
        remarks = (
            *remarks,
            f"stamps run {100.0 * abs(found.skew):.2g} % {slow} against the times of recording, as no two "
            "crystals do: one of both is wrong, and sigmas of scale include it; give --rate if you know it",
        )
    return replace(recording, metadata=replace(metadata, pace_sigma=pace, remarks=remarks))


def _first_chunk(recording: Recording) -> Chunk | None:
    stream = recording.chunks()
    first = next(iter(stream), None)
    if isinstance(stream, ChunkStream):
        stream.close()
    return first


def _fitted(recording: Recording) -> Fitted:
    stamps = np.concatenate([chunk.time for chunk in recording.chunks()])
    times = _core.SampleTimes.fit(stamps)
    if times is None:
        return (
            None,
            "stamps scatter, and show no even sampling that they could be fitted to: taken as they are",
            _core.scatter_of_steps(stamps),
        )
    for chunk in recording.chunks():
        # A zero has no effect in place of a missing reading.
        triads = (np.nan_to_num(chunk.accelerometer), np.nan_to_num(chunk.gyroscope))
        times.push(chunk.time, *map(np.ascontiguousarray, triads))
    return _judged(times, stamps)


def _judged(times: _core.SampleTimes, stamps: FloatArray) -> Fitted:
    """Decide, by what the signal shows, whether the stamps or the fitted times are right."""
    late = f"stamps are late by up to {times.latest * MILLISECONDS:.2g} ms"
    kept = times.kept_sigma(stamps)
    if kept is not None:
        if times.sampling != "between":
            return None, "", kept
        share, sigma = times.share or (np.nan, np.nan)
        remark = (
            f"{late} against even sampling, of which the signal shows {share:.2f} ± {sigma:.2f} as real: the "
            "sensor samples neither evenly nor when it is stamped; times were left as they are, and "
            f"angles of turns are widened by {kept * MILLISECONDS:.1g} ms of their rate; stamp samples by "
            "the sensor's own clock"
        )
        return None, remark, kept
    is_burst = times.burst > 1.0
    bursts = f" (bursts of {times.burst:.3g} samples)" if is_burst else ""
    lost = ""
    if is_burst and times.lost:
        lost = (
            f"; nothing shows where in a burst {count_of('sample', times.lost)} got lost: the times of its "
            "other samples may be wrong by as many periods; repeat the recording without losses"
        )
    remark = (
        f"{late}{bursts}; times were fitted, sampling period {times.interval * MILLISECONDS:.6g} ms, "
        f"uncertainty {times.sigma * MILLISECONDS:.1g} ms and {times.rate_sigma * 1e6:.1g} ppm of a span"
        f"{lost}"
    )
    return times, remark, 0.0
