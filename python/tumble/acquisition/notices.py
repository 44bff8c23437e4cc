"""Notices on irregularities of a recording that is usable all the same."""

from __future__ import annotations

from collections.abc import Iterator

from tumble import _core
from tumble.acquisition.coarseness import coarse_notices
from tumble.acquisition.imu import ChannelFault, Imu
from tumble.acquisition.messages import REST_REJECTIONS
from tumble.foundation.log_formats import FIRMWARE_OF
from tumble.foundation.recording import Metadata
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of
from tumble.logs.unread_columns import on_missing

MOST_NAMED = 3
"""Turns of which a notice gives the time; the others it counts."""


def notices(unit: Imu, missing: int | None = None) -> Iterator[str]:
    """Yields a notice on each kind of samples left out, and the remarks of the reader.

    `missing` counts the samples that are missing where the files of a folder were joined: pauses between
    them are none.
    """
    metadata, acquired = unit.recording.metadata, unit.acquired
    missing = acquired.missing if missing is None else missing
    for triad in TRIADS:
        if triad not in unit.triads:
            yield (
                on_missing(triad, metadata.unread)
                if metadata.unread
                else f"no {triad} readings were recorded: nothing is said of the {triad}"
            )
    yield from metadata.remarks
    yield from metadata.assumptions_but(*_confirmed(unit))
    yield from unit.notices
    yield from on_slow_rate(unit.rate)
    yield from correction_notice(metadata)
    for start, end, why in acquired.rejected_rests:
        yield f"{unit.log.time.span(start, end)} s is not a rest: {REST_REJECTIONS[why]}"
    for fault in unit.faults:
        yield _saturated(fault, unit)
    yield from coarse_notices(unit.acquired, unit.triads)
    if not unit.recording.parts:
        yield from _gaps(unit)
    if missing:
        share = 100.0 * missing / (acquired.samples + missing)
        yield (
            f"{count_of('sample', missing)} missing ({share:.2g} %): integrals over turns run "
            "straight across the pauses, and the sigmas include what that leaves"
        )
    if acquired.not_finite:
        yield f"left out {count_of('sample', acquired.not_finite)} without a number"


def _confirmed(unit: Imu) -> tuple[Triad, ...]:
    """Returns the sensors whose units the turns between rests confirm."""
    if unit.triads != TRIADS or not unit.recording.metadata.gyroscope_unit.doubt:
        return ()
    consistency, *_ = _core.gyroscope_consistency(unit.acquired)
    return ("gyroscope",) if consistency == "consistent" else ()


def correction_notice(metadata: Metadata, what: str = "this calibration holds") -> Iterator[str]:
    """Warns of results that hold for samples that were corrected before."""
    if not metadata.already_corrected:
        return
    remedy = "; --undo-correction takes it back" if metadata.format in FIRMWARE_OF else ""
    yield f"the log was already corrected: {what} on top of that correction{remedy}"


def _saturated(fault: ChannelFault, unit: Imu) -> str:
    """Describes how often a channel was at the end of its range, and the effect."""
    turns = list(_turns(unit.acquired))
    touched = [(start, end) for _, start, end in turns if fault.touches(start, end)]
    seen = (
        f"{fault.channel} is at the end of its range in {fault.samples} of "
        f"{count_of('sample', unit.acquired.samples)}, in {len(touched)} of {count_of('turn', len(turns))}"
    )
    time = unit.log.time
    first = f"{seen}, first at {time.at(fault.first)}"
    if not fault.is_of_gyroscope:
        return f"{first}: gravity is read at the rests, so the turns are used"
    when = ", ".join(f"{time.span(start, end)} s" for start, end in touched[:MOST_NAMED])
    more = f" and {len(touched) - MOST_NAMED} more" if len(touched) > MOST_NAMED else ""
    return f"{seen}, which are not used: {when}{more}" if touched else first


def _turns(acquired: _core.Acquired) -> Iterator[tuple[bool, float, float]]:
    """Returns of each turn whether it is known in full, and its start and end, s."""
    ends, starts = acquired.rest_times[:-1, 1], acquired.rest_times[1:, 0]
    return zip(acquired.turn_complete, ends, starts, strict=False)


def _gaps(unit: Imu) -> Iterator[str]:
    for complete, start, end in _turns(unit.acquired):
        saturated = any(fault.is_of_gyroscope and fault.touches(start, end) for fault in unit.faults)
        if not complete and not saturated:
            yield (
                f"samples are missing from {unit.log.time.span(start, end)} s: "
                "what the gyroscope read then is not used"
            )
