"""Look at a recording from beginning to end: what it holds, how good it is, what it can serve."""

from __future__ import annotations

import math

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import push_recorded, rests_of, scale_notice
from tumble.acquisition.messages import REST_REJECTIONS
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Metadata, Recording, RecordingSource, SampleProgress
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.services import Evidence
from tumble.foundation.words import count_of
from tumble.logs import ChunkStream, Counts, ReadOptions, open_recording
from tumble.logs.unread_columns import on_unread
from tumble.tools.inspect.result import ChannelFacts, Inspection, MagnetometerFacts, Timing
from tumble.tools.inspect.samples import CHANNELS, SampleWatch
from tumble.tools.inspect.services import faults_of, services_of

_MOST_OF_IT = (0.05, 0.95)
"""Quantiles between which the strength of a field is stated."""


def inspect(
    recording: RecordingSource, progress: SampleProgress | None = None, *, read: ReadOptions | None = None
) -> Inspection:
    """Inspects one recording in one pass; memory does not grow with its length.

    `read` holds the options of reading a log. `progress` receives the samples done, and samples expected
    where they are known beforehand.

    Raises `LogError` where the recording breaks off or is not fit to use.
    """
    recording = open_recording(recording, read)
    triads = recording.metadata.triads
    watch, counts = SampleWatch(triads), Counts()
    segmenter, by_hand = _core.Segmenter(), _core.Segmenter(by_hand=True)
    for number, part in enumerate(recording.parts or (recording,)):
        if number:
            watch.time.begin_part()
        for each in (segmenter, by_hand):
            each.begin_part(part.name if recording.parts else "")
        stream = part.chunks()
        for chunk in stream:
            watch.push(chunk)
            for each in (segmenter, by_hand):
                push_recorded(each, chunk, chunk.accelerometer, chunk.gyroscope, triads)
            if progress is not None:
                progress(watch.time.samples, stream.expected if isinstance(stream, ChunkStream) else None)
        if isinstance(stream, ChunkStream):
            counts.add(stream.counts)
    if watch.time.samples == 0:
        raise LogError(f"{recording.metadata.source}: holds no samples")
    return _conclude(recording, watch, segmenter.finish(), by_hand.finish(), counts)


def _conclude(
    recording: Recording,
    watch: SampleWatch,
    acquired: _core.Acquired,
    by_hand: _core.Acquired,
    counts: Counts,
) -> Inspection:
    metadata = recording.metadata
    triads = metadata.triads
    rests = rests_of(acquired, triads=triads)
    channels = _channels(watch, acquired)
    stuck = [channel.name for channel in channels if channel.stuck]
    timing = _timing(watch, counts)
    magnetic = recording.magnetic
    evidence = Evidence(
        triads=triads,
        alone=metadata.alone,
        rests=rests,
        rests_by_hand=rests_of(by_hand, triads=triads),
        turn_angles=acquired.turn_angles,
        trace=acquired.trace(),
        temperature=watch.temperature,
        has_magnetometer=recording.has_magnetometer,
        faults=faults_of(watch.time.interval, stuck),
        lacking_rate=on_slow_rate(timing.rate),
    )
    return Inspection(
        metadata=metadata,
        timing=timing,
        channels=channels,
        temperature=acquired.temperature,
        magnetometer=_facts_of(magnetic),
        rests=rests,
        not_rests=tuple((start, end, REST_REJECTIONS[why]) for start, end, why in acquired.rejected_rests),
        directions=len(evidence.directions) if "accelerometer" in triads else 0,
        services=tuple(services_of(evidence)),
        remarks=(
            *metadata.remarks,
            *metadata.assumptions,
            *on_unread(metadata.unread, triads),
            *counts.notices(),
            *scale_notice(acquired, STANDARD_GRAVITY),
            *(magnetic.remarks if magnetic is not None else ()),
            *_warnings(metadata, timing, channels),
        ),
    )


def _facts_of(track: MagneticTrack | None) -> MagnetometerFacts | None:
    """Sums up a magnetometer; None where there is none, or it has no reading."""
    if track is None or not len(track):
        return None
    lengths = np.linalg.norm(track.field, axis=1)
    low, high = np.quantile(lengths, _MOST_OF_IT)
    return MagnetometerFacts(
        track.name,
        len(track),
        track.rate,
        track.unit,
        track.unit_reason,
        float(low),
        track.strength,
        float(high),
        track.current is not None,
    )


def _channels(watch: SampleWatch, acquired: _core.Acquired) -> tuple[ChannelFacts, ...]:
    stuck = {name for name, kind, *_ in acquired.faults if kind == "stuck"}
    noise = dict(zip(CHANNELS, acquired.noise_density, strict=True))
    return tuple(
        ChannelFacts(
            channel.name,
            channel.unit,
            channel.low,
            channel.mean,
            channel.high,
            channel.step,
            0 if channel.name in stuck else channel.saturated,
            channel.name in stuck,
            float(noise[channel.name]) if noise[channel.name] > 0.0 else math.nan,
        )
        for channel in watch.channels
    )


def _timing(watch: SampleWatch, counts: Counts) -> Timing:
    time = watch.time
    return Timing(
        samples=time.samples,
        start=time.start,
        end=time.end,
        duration=time.duration,
        rate=1.0 / time.interval if time.interval > 0.0 else math.nan,
        jitter=time.jitter,
        gaps=time.gaps,
        missing=time.missing,
        longest_gap=time.longest_gap,
        longest_gap_at=time.longest_gap_at,
        duplicates=counts.duplicates,
        without_number=counts.without_number,
    )


def _warnings(metadata: Metadata, timing: Timing, channels: tuple[ChannelFacts, ...]) -> tuple[str, ...]:
    warnings = []
    if metadata.already_corrected:
        warnings.append("the log is already corrected: a calibration made from it adds to that correction")
    warnings += on_slow_rate(timing.rate)
    if timing.jitter * timing.rate > 0.2:
        warnings.append(
            "the interval between samples scatters by more than a fifth: are they times of arrival?"
        )
    warnings += [f"{channel.name} is stuck at {channel.mean:.6g}" for channel in channels if channel.stuck]
    warnings += [
        f"{channel.name} is saturated in {count_of('sample', channel.saturated)}"
        for channel in channels
        if channel.saturated
    ]
    return tuple(warnings)
