"""Messages on terms that a noise record does not show, and on its irregularities, each with a remedy."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from tumble.foundation.log_time import LogTime
from tumble.foundation.units import Triad
from tumble.foundation.words import count_of, join, length_of_time
from tumble.procedures.noise.course import LevelDrift, NoiseChange
from tumble.procedures.noise.result import KNOCK, RAMP_OF_LEVEL, STEP, ChannelNoise, Disturbance, StillPart

NOTABLE_SHARE = 0.01
"""Share of the samples left out that is worth a remark."""
MOST_NAMED = 6
"""Disturbances that are named one by one."""
FEW_STRETCHES = 4.0
"""Times that the longest stretch goes into all that was used, from which on gaps decide what is seen."""


def not_identifiable(high: float, unit: str, needed: float | None) -> str:
    """Describes the bound on a term that is not identifiable, and the remedy."""
    if not math.isfinite(high):
        return "not identifiable: the log is too short, or too disturbed, to bound it"
    known = f"not identifiable: at most {high:.2g} {unit}"
    if needed is None:
        return f"{known}; no log that can be made would show it"
    return f"{known}; a log of {length_of_time(needed)} would show half of that"


TOO_SHORT = (
    "not identifiable: what stands still without a gap is too short; let the unit lie for a minute at least"
)
NO_STEPS = (
    "no two samples at rest follow each other as samples do elsewhere in the log: its rate changes; "
    "split the log where it does"
)
ROUNDED = (
    "not identifiable: the readings are rounded to steps coarser than the noise; log more digits, or choose "
    "a smaller range"
)
CLIPPED = (
    "not identifiable: readings pile up at one value, the end of the range, which cuts the noise off; choose "
    "a larger range, or turn this axis away from gravity"
)


def warnings_of(still: StillPart, channels: tuple[ChannelNoise, ...]) -> Iterator[str]:
    """Reports samples left out, and where the terms do not explain the curve."""
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
    yield from _filtered({c.name: c.filter for c in channels if c.filter > 0.0})
    apart = {channel.name: channel.misfit for channel in channels if channel.misfit > 0.0}
    if apart:
        yield (
            f"{_names(apart)}: the terms follow the measured deviations to within {_shares(apart.values())} "
            "only, as with vibration, changing temperature or a bad seat: intervals are wider by that, "
            "and the curve itself counts"
        )


def drifting(high: float, unit: str) -> str:
    """Describes the bound on a slow term of a channel whose level drifts in a part of the log."""
    return (
        f"not identifiable: at most {high:.2g} {unit}; the level drifts in a part of the log: leave that "
        "out, and record at a steady temperature"
    )


def _channel_names(found: Iterable[LevelDrift | NoiseChange], triads: Sequence[Triad]) -> str:
    return _names(f"{triads[each.channel // 3]} {'xyz'[each.channel % 3]}" for each in found)


def level_drifts(found: Collection[LevelDrift], triads: Sequence[Triad]) -> Iterator[str]:
    """Names channels whose level drifts in a part of the log."""
    if not found:
        return
    names = _channel_names(found, triads)
    most = max(found, key=lambda each: each.factor)
    begin, end = (f"{100.0 * share:.0f}" for share in most.at)
    yield (
        f"{names}: the level drifts from {begin} to {end} % of the samples, up to {most.factor:.2g} times as "
        "much as elsewhere, as while a unit warms up: bias instability and random walk are bounds only; "
        "leave that part out"
    )


def swaying(names: Sequence[str]) -> Iterator[str]:
    """Names channels that sway between rests as slow noise or slow motion does."""
    if names:
        yield (
            f"{_names(names)}: sways between rests by no more than noise may, as behind a slow low-pass "
            "filter or on something soft: it counts as noise; if the unit moved, let it lie on something firm"
        )


def changing(found: Sequence[NoiseChange], triads: Sequence[Triad]) -> Iterator[str]:
    """Names channels whose white noise is not the same all along the log, or in all logs."""
    if not found:
        return
    names = _channel_names(found, triads)
    factors = [each.largest / each.least for each in found]
    most = max(found, key=lambda each: each.largest / each.least)
    least, largest = (f"{100.0 * share:.0f} %" for share in most.at)
    yield (
        f"{names}: white noise changes by a factor of {_range(factors, 1.0)} within the samples, from its "
        f"least after {least} of them to its largest after {largest}: what is stated is its mean; look at "
        "the supply and at what else changes, and join logs of one state only"
    )


def disturbances(found: Sequence[Disturbance], logs: Mapping[str, LogTime]) -> Iterator[str]:
    """Names steps, ramps and knocks, those of several channels at one time together."""
    names, times = list(logs), list(logs.values())
    groups: list[list[Disturbance]] = []
    for each in (each for each in found if each.left_out):
        last = groups[-1] if groups else []
        together = last and (last[0].log, last[0].kind) == (each.log, each.kind)
        if together and each.start <= max(one.end for one in last):
            last.append(each)
        else:
            groups.append([each])
    groups.sort(key=lambda group: -max(abs(each.size) / each.sigma for each in group))
    for group in groups[:MOST_NAMED]:
        whose = f"{names[group[0].log]}: " if len(logs) > 1 else ""
        yield f"{whose}{_disturbance(group, times[group[0].log])}; left out of the deviations"
    if len(groups) > MOST_NAMED:
        yield f"{len(groups) - MOST_NAMED} smaller disturbances were left out too; --json lists them"
    for channel in dict.fromkeys(each.channel for each in found if not each.left_out):
        largest = max(
            (e for e in found if e.channel == channel), key=lambda each: abs(each.size) / each.sigma
        )
        yield (
            f"{_disturbance([largest], times[largest.log])}, and there are many more: so many are part of "
            "its noise, and were not left out"
        )


def _disturbance(group: Sequence[Disturbance], time: LogTime) -> str:
    largest = max(group, key=lambda each: abs(each.size) / each.sigma)
    names = _names([each.channel for each in group])
    verb = {STEP: "steps", RAMP_OF_LEVEL: "drifts", KNOCK: "is knocked"}[largest.kind]
    if largest.kind == RAMP_OF_LEVEL:
        when = f"from {time.span(largest.start, largest.end)} s"
    else:
        when = f"at {time.at(0.5 * (largest.start + largest.end))}"
    return f"{names} {verb} by {largest.size:.2g} {largest.unit} {when}"


def _names(channels: Iterable[str]) -> str:
    """Joins `accelerometer x`, `accelerometer y` to `accelerometer x and y`."""
    axes: dict[str, list[str]] = {}
    for channel in dict.fromkeys(channels):
        triad, axis = channel.split()
        axes.setdefault(triad, []).append(axis)
    return ", ".join(f"{triad} {join(of_triad)}" for triad, of_triad in axes.items())


def _filtered(constants: Mapping[str, float]) -> Iterator[str]:
    if constants:
        yield (
            f"{_names(constants)}: averages of a few samples show a low-pass filter, of a time constant of "
            f"{_range(constants.values(), 1e3)} ms; white noise is given as it is at longer ones"
        )


def _shares(misfits: Collection[float]) -> str:
    return f"{_range(misfits, 100.0)} %"


def _range(values: Collection[float], scale: float) -> str:
    low, high = (f"{scale * value:.2g}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
