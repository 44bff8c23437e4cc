"""What was odd about a recording that could be used all the same."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.acquisition.imu import Imu
from tumble.acquisition.messages import REST_REJECTIONS
from tumble.log_formats import FIRMWARE_OF
from tumble.recording import Metadata
from tumble.units import TRIADS
from tumble.words import count_of


def notices(unit: Imu) -> Iterator[str]:
    """Say, a line each, what was left out, and what the reader did that a user should know."""
    metadata, acquired = unit.recording.metadata, unit.acquired
    for triad in TRIADS:
        if triad not in unit.triads:
            yield f"no {triad} readings were recorded: nothing is said of the {triad}"
    yield from metadata.remarks
    yield from unit.notices
    yield from correction_notice(metadata)
    for start, end, why in acquired.rejected_rests:
        yield f"{start:.1f} to {end:.1f} s is not a rest: {REST_REJECTIONS[why]}"
    for channel, _, _, first, last in unit.faults:
        yield f"{channel} is saturated between {first:.1f} and {last:.1f} s: turns in that time are not used"
    if not unit.recording.parts:
        yield from _gaps(unit)
    if acquired.missing:
        share = 100.0 * acquired.missing / (acquired.samples + acquired.missing)
        yield (
            f"{count_of('sample', acquired.missing)} missing ({share:.2g} %): integrals over turns run "
            "straight across the pauses, and the sigmas include what that leaves"
        )
    if acquired.not_finite:
        yield f"left out {count_of('sample', acquired.not_finite)} without a number"


def correction_notice(metadata: Metadata, what: str = "this calibration holds") -> Iterator[str]:
    """Warn of results that hold for samples that were corrected before."""
    if not metadata.already_corrected:
        return
    remedy = "; --undo-correction takes it back" if metadata.format in FIRMWARE_OF else ""
    yield f"the log was already corrected: {what} on top of that correction{remedy}"


def _gaps(unit: Imu) -> Iterator[str]:
    acquired = unit.acquired
    ends, starts = acquired.rest_times[:-1, 1], acquired.rest_times[1:, 0]
    for complete, start, end in zip(acquired.turn_complete, ends, starts, strict=False):
        saturated = any(first <= end and start <= last for *_, first, last in unit.faults)
        if not complete and not saturated:
            yield (
                f"samples are missing between {start:.1f} and {end:.1f} s: "
                "what the gyroscope read then is not used"
            )
