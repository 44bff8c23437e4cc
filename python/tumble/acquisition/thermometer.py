"""Stretches in which a thermometer did not show a temperature: it stood still, or read what cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import Chunk, FloatArray
from tumble.logs.checks import FASTEST_WARMING
from tumble.logs.row_order import select

_SPAN = 1.0
"""s of which the largest change is kept."""
_CHANGES = 5.0
"""Usual largest changes of a span beyond which noise makes none: 10 sigmas of white noise at 10 Hz."""
_PACE = 0.1
"""Quantile of times between changes that is the thermometer's own: a coarse one repeats readings."""
_NAMED = 3
"""Failures that are described one by one."""
_LASTING = 10.0
"""Usual times between two changes beyond which a reading that stays is a standstill."""


class ThermometerFault(NamedTuple):
    """A stretch without a temperature, or a jump behind which nothing shows which side is right."""

    first: float
    last: float
    """s; of a jump that stays, the samples on both sides."""
    value: float
    """degC that it read; of a jump that stays, what it read behind it."""
    jump: float
    """K between that and what it read before or after."""
    stays: bool
    """True for a jump that stays."""

    def line(self, time: LogTime) -> str:
        """Describes it."""
        if self.stays:
            return (
                f"temperature jumps by {self.jump:.3g} K at {time.at(self.last)} and stays, faster than "
                "sensors warm"
            )
        return (
            f"the thermometer stood still or failed at {self.value:.4g} degC from "
            f"{time.span(self.first, self.last)} s, {self.jump:.3g} K from what it read next to it: that "
            "time has no temperature"
        )


class _Span(NamedTuple):
    """The largest change from one sample to the next within a second."""

    change: float
    before: float
    """s of the sample before it."""
    after: float
    """s of the sample after it."""
    value_before: float
    value_after: float
    """degC."""
    changed_before: float
    """s of the latest change before it, in any span."""
    changed_after: float
    """s of the next change in this span; NaN without one."""
    middle: float
    """degC, the median."""
    changes: int
    shortest: float
    """s, shortest time between two changes; infinite without one."""


@dataclass(slots=True)
class ThermometerWatch:
    """Finds changes from sample to sample that no sensor makes, over all of a log.

    It keeps ten numbers for each second.
    """

    _spans: list[_Span] = field(default_factory=list)
    _last: tuple[float, float] | None = None
    """Time and reading of the latest sample."""
    _changed: float = np.nan
    """s of the latest change."""

    def push(self, chunk: Chunk) -> None:
        """Takes in samples; those without temperature show nothing."""
        if chunk.temperature is None:
            return
        known = np.isfinite(chunk.temperature)
        time, values = chunk.time[known], chunk.temperature[known]
        if not len(time):
            return
        places = np.flatnonzero(np.diff(np.floor(time / _SPAN))) + 1
        for part, readings in zip(np.split(time, places), np.split(values, places), strict=True):
            self._spans.append(self._span(part, readings))

    def _span(self, time: FloatArray, values: FloatArray) -> _Span:
        middle = float(np.median(values))
        if self._last is not None:
            time, values = np.append(self._last[0], time), np.append(self._last[1], values)
        else:
            self._changed = float(time[0])
        self._last = float(time[-1]), float(values[-1])
        steps = np.abs(np.diff(values))
        moved = np.flatnonzero(steps)
        if not len(moved):
            nothing = float(time[-1])
            return _Span(0.0, nothing, nothing, middle, middle, self._changed, np.nan, middle, 0, np.inf)
        k = int(steps.argmax())
        earlier, later = moved[moved < k], moved[moved > k]
        times = np.append(self._changed, time[moved + 1])
        found = _Span(
            float(steps[k]),
            float(time[k]),
            float(time[k + 1]),
            float(values[k]),
            float(values[k + 1]),
            float(time[earlier[-1] + 1]) if len(earlier) else self._changed,
            float(time[later[0] + 1]) if len(later) else np.nan,
            middle,
            len(moved),
            float(np.diff(times).min()),
        )
        self._changed = float(times[-1])
        return found

    def faults(self) -> tuple[ThermometerFault, ...]:
        """Returns what was found, in order of time; call it after the last sample."""
        changes = np.array([span.change for span in self._spans])
        if not changes.any() or self._last is None:
            return ()
        interval = (self._last[0] - self._spans[0].before) / sum(span.changes for span in self._spans)
        # A thermometer that is read less often than samples are changes at its own pace, or not.
        pace = float(np.quantile([span.shortest for span in self._spans if span.changes], _PACE))
        usual = _CHANGES * float(np.median(changes[changes > 0.0])) + FASTEST_WARMING * pace
        found: list[ThermometerFault] = []
        for k in np.flatnonzero(changes > usual):
            span = self._spans[k]
            if span.change > usual + FASTEST_WARMING * (span.after - span.before):
                found += self._judged(int(k), _LASTING * interval)
        return tuple(each for k, each in enumerate(found) if not k or each[:2] != found[k - 1][:2])

    def _judged(self, k: int, longest: float) -> Iterator[ThermometerFault]:
        """Yields what is wrong beside the change of a span: the side that stayed, or a moment."""
        span = self._spans[k]
        until = next((each.before for each in self._spans[k + 1 :] if each.changes), self._end)
        changed_after = span.changed_after if np.isfinite(span.changed_after) else until
        stayed = span.before - span.changed_before, changed_after - span.after
        if max(stayed) > longest:
            before = span.changed_before, span.before, span.value_before
            after = span.after, changed_after, span.value_after
            yield ThermometerFault(*(before if stayed[0] > stayed[1] else after), span.change, False)
            return
        around = self._spans[max(0, k - 2)].middle, self._spans[min(len(self._spans) - 1, k + 2)].middle
        stays = abs(around[1] - around[0]) > 0.5 * span.change
        last = span.after if stays or np.isnan(span.changed_after) else span.changed_after
        yield ThermometerFault(span.before, last, span.value_after, span.change, stays)

    @property
    def _end(self) -> float:
        return np.nan if self._last is None else self._last[0]


def with_temperature(chunk: Chunk, faults: Sequence[ThermometerFault]) -> Chunk:
    """Returns the samples at which the thermometer showed a temperature."""
    failed = np.zeros(len(chunk), dtype=np.bool_)
    for fault in faults:
        failed |= (chunk.time >= fault.first) & (chunk.time <= fault.last)
    return select(chunk, ~failed) if failed.any() else chunk


def thermometer_notices(faults: Sequence[ThermometerFault], time: LogTime) -> Iterator[str]:
    """Describes what a thermometer did not show, the longest first."""
    longest = sorted(faults, key=lambda fault: fault.first - fault.last)
    yield from (fault.line(time) for fault in longest[:_NAMED])
    if len(faults) > _NAMED:
        yield f"the thermometer failed {len(faults) - _NAMED} times more, and these have no temperature"
