"""Notices on irregularities of a recording that is usable all the same."""

from __future__ import annotations

from collections.abc import Iterator

from tumble import _core
from tumble.acquisition import messages
from tumble.acquisition.coarseness import coarse_notices
from tumble.acquisition.imu import ChannelFault, Imu
from tumble.foundation.log_formats import FIRMWARE_OF
from tumble.foundation.recording import Metadata
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of
from tumble.logs.set_clock import PAUSE_INTERVALS
from tumble.logs.unread_columns import on_missing


def notices(unit: Imu, missing: int | None = None) -> Iterator[str]:
    """Yields a notice on each kind of samples left out, and the remarks of the reader.

    `missing` counts the samples that are missing where the files of a folder were joined: pauses between
    them are none.
    """
    metadata, acquired = unit.recording.metadata, unit.acquired
    missing = acquired.missing if missing is None else missing
    missing = max(0, missing - len(unit.clock_sets) * (PAUSE_INTERVALS - 1))
    for triad in TRIADS:
        if triad not in unit.triads:
            yield (
                on_missing(triad, metadata.unread)
                if metadata.unread
                else messages.NOT_RECORDED.format(triad=triad)
            )
    yield from metadata.remarks
    yield from metadata.assumptions_but(*_confirmed(unit))
    yield from unit.notices
    yield from on_slow_rate(unit.rate)
    yield from correction_notice(metadata)
    for start, end, why in acquired.rejected_rests:
        yield messages.NO_REST.format(span=unit.log.time.span(start, end), why=messages.REST_REJECTIONS[why])
    for fault in unit.faults:
        yield _saturated(fault, unit)
    yield from coarse_notices(unit.acquired, unit.triads)
    if not unit.recording.parts:
        yield from _gaps(unit)
    if missing:
        share = 100.0 * missing / (acquired.samples + missing)
        yield messages.MISSING.format(counted=count_of("sample", missing), share=share)
    if acquired.not_finite:
        yield f"left out {count_of('sample', acquired.not_finite)} without a number"


def _confirmed(unit: Imu) -> tuple[Triad, ...]:
    """Returns the sensors whose units the turns between rests confirm."""
    if unit.triads != TRIADS or not unit.recording.metadata.gyroscope_unit.doubt:
        return ()
    consistency, *_ = _core.gyroscope_consistency(unit.acquired)
    return ("gyroscope",) if consistency == "consistent" else ()


def correction_notice(metadata: Metadata, what: str = messages.HOLDS) -> Iterator[str]:
    """Warns of results that hold for samples that were corrected before."""
    if not metadata.already_corrected:
        return
    remedy = "; --undo-correction takes it back" if metadata.format in FIRMWARE_OF else ""
    yield messages.CORRECTED.format(what=what, remedy=remedy)


def _saturated(fault: ChannelFault, unit: Imu) -> str:
    """Describes how often a channel was at the end of its range, and the effect."""
    turns = list(_turns(unit.acquired))
    touched = [(start, end) for _, start, end in turns if fault.touches(start, end)]
    time = unit.log.time
    seen = messages.AT_RANGE_END.format(
        channel=fault.channel,
        samples=fault.samples,
        all=count_of("sample", unit.acquired.samples),
        touched=len(touched),
        turns=count_of("turn", len(turns)),
    )
    first = messages.FIRST_AT.format(seen=seen, first=time.at(fault.first))
    if not fault.is_of_gyroscope:
        return messages.TURNS_USED.format(seen=first)
    if not touched:
        return first
    spans = ", ".join(f"{time.span(start, end)} s" for start, end in touched[: messages.MOST_NAMED])
    more = len(touched) - messages.MOST_NAMED
    if more > 0:
        spans = messages.AND_MORE.format(spans=spans, count=more)
    return messages.TURNS_LEFT_OUT.format(seen=seen, spans=spans)


def _turns(acquired: _core.Acquired) -> Iterator[tuple[bool, float, float]]:
    """Returns of each turn whether it is known in full, and its start and end, s."""
    ends, starts = acquired.rest_times[:-1, 1], acquired.rest_times[1:, 0]
    return zip(acquired.turn_complete, ends, starts, strict=False)


def _gaps(unit: Imu) -> Iterator[str]:
    for complete, start, end in _turns(unit.acquired):
        saturated = any(fault.is_of_gyroscope and fault.touches(start, end) for fault in unit.faults)
        is_set = any(start <= time <= end for time in unit.clock_sets)
        if not complete and not saturated and not is_set:
            yield messages.GAP.format(span=unit.log.time.span(start, end))
