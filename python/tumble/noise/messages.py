"""What a record of noise does not show, and what is odd about one, in words a user can act on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from tumble.noise.result import ChannelNoise, StillPart
from tumble.words import count_of, length_of_time

NOTABLE_SHARE = 0.01
"""Share of the samples left out that is worth a remark."""
FEW_STRETCHES = 4.0
"""Times that the longest stretch goes into all that was used, from which on gaps decide what is seen."""


def not_identifiable(high: float, unit: str, needed: float | None) -> str:
    """Say what is known of a term all the same, and what would show it."""
    if not math.isfinite(high):
        return "not identifiable: the log is too short, or too disturbed, to bound it"
    known = f"not identifiable: at most {high:.2g} {unit}"
    if needed is None:
        return f"{known}; no log that can be made would show it"
    return f"{known}; a log of {length_of_time(needed)} would show half of that"


TOO_SHORT = (
    "not identifiable: what stands still without a gap is too short; let the unit lie for a minute at least"
)
NO_NOISE = "not identifiable: the channel is rounded to steps far coarser than its noise"


def warnings_of(still: StillPart, channels: tuple[ChannelNoise, ...]) -> Iterator[str]:
    """Say what was left out, and where the terms do not explain what was found."""
    left_out = still.samples - still.used
    if left_out > NOTABLE_SHARE * still.samples:
        yield (
            f"{count_of('sample', left_out)} of {still.samples} were left out, in which the unit did not "
            "stand still"
        )
    if still.gaps:
        yield (
            f"{count_of('gap', still.gaps)} in the time of the samples; {count_of('part', still.stretches)} "
            f"without one count each by itself, the longest is {length_of_time(still.longest)}"
        )
    if still.longest * FEW_STRETCHES < still.duration and still.gaps:
        yield (
            f"averages longer than {length_of_time(0.5 * still.longest)} are lost to gaps: "
            "bias instability and random walk need a log without them"
        )
    yield from _filtered({c.name: c.shortest for c in channels if c.shortest > 1.5 * still.interval})
    widened = [c.name for c in channels if c.widening > 1.0]
    if widened:
        most = max(c.widening for c in channels)
        yield (
            f"{', '.join(widened)}: no sum of the terms explains the deviations, as with changing "
            f"temperature, vibration or a bad seat; intervals are widened, up to {most:.2g} times"
        )


def _filtered(shortest: Mapping[str, float]) -> Iterator[str]:
    by_time: dict[float, list[str]] = {}
    for name, time in shortest.items():
        by_time.setdefault(time, []).append(name)
    for time, names in by_time.items():
        yield (
            f"{', '.join(names)}: averages below {time:.3g} s do not follow the terms, as after a low-pass "
            "filter or with vibration, and were left out of the fit"
        )
