"""Rests of the reference that are no rests of a target: why, and what stood in its place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.acquisition.imu import Imu
from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray

LARGEST_JUMP = 0.005
"""rad/s by which no bias of one unit jumps within a session: acquisition rejects rests by the same."""
BY_REFERENCE = 0.5
"""A rate that the reference shows too, to this share, is a slow turn of both."""
STEADY = 0.3
"""A rate that scatters by less than this share of what it jumped by is another bias, and no motion."""
SAME_STATE = 0.5
"""Rates of one other state differ by less than this share of what they jumped by."""
RECORDED = 0.5
"""Share of a rest that the log of a target has to hold to have recorded it."""
LARGE_PART = 0.5
"""Share of the recorded rests of which the loss is no mere remark, wherever they are."""
BLOCK = 2
"""Rests at the beginning or the end of which the loss is no mere remark, for whatever reason."""


@dataclass(frozen=True, slots=True)
class LostRest:
    """A rest of the reference that the target recorded, and that is none of its rests."""

    number: int
    """Index among the rests of the reference."""
    start: float
    """s of the clock of the target."""
    jump: FloatArray
    """(3,) mean angular rate of the target less that of the rests it shares, rad/s."""
    turned: bool
    """Indicates that its rate was steady, and another one, while the reference stood still."""


@dataclass(frozen=True, slots=True)
class RestsBeside:
    """Rests of the reference that the log of a target holds."""

    shared: tuple[int, ...]
    """Indices of those that are rests of the target too."""
    lost: tuple[LostRest, ...]
    """The others, in order; without those before the log begins, after it ends and in its gaps."""
    unpaired: tuple[float, int] | None
    """Start of the first rest of the target beyond those it shares, s of its clock, and number of rests of
    the reference beyond on that side; None where either has none there."""
    one_is_enough: bool
    """Indicates that the reference has a gyroscope, which shows slow turns of both."""
    first_shared: float
    """Start of the first rest of the target that is shared, s of its clock."""

    @classmethod
    def of(cls, reference: Imu, unit: Imu, figures: _core.TargetFigures, lost: Sequence[int]) -> RestsBeside:
        """Returns them for the rests of the reference that are `lost`."""
        seen, felt = reference.acquired, unit.acquired
        pairs = figures["pairs"]
        spans = _on_clock_of_target(reference, figures["clock"])
        time, _, rate = felt.trace()
        used = [rest for _, first, last in pairs for rest in range(first, last + 1)]
        own = _Still(felt.rest_angular_rate[used], "gyroscope" in unit.triads)
        other = _Still(
            seen.rest_angular_rate[[rest for rest, _, _ in pairs]], "gyroscope" in reference.triads
        )
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        found = []
        for rest in lost:
            start, end = spans[rest]
            within = slice(*np.searchsorted(time, (start, end)))
            if (within.stop - within.start) * step < RECORDED * (end - start):
                continue
            jump = own.jump(rate[within].mean(axis=0))
            by_reference = float(np.linalg.norm(other.jump(seen.rest_angular_rate[rest])))
            size = float(np.linalg.norm(jump))
            steady = float(np.linalg.norm(np.std(rate[within], axis=0))) < STEADY * size
            turned = steady and size > LARGEST_JUMP and by_reference < BY_REFERENCE * size
            found.append(LostRest(rest, float(start), jump, turned))
        shared = sorted({*(rest for rest, _, _ in pairs), *figures["continued"]})
        return cls(
            tuple(shared),
            tuple(found),
            _unpaired(felt.rest_times[:, 0], used, len(seen.rest_times), shared),
            "gyroscope" in reference.triads,
            float(felt.rest_times[min(used), 0]) if used else 0.0,
        )

    def objections(self, time: LogTime) -> Iterator[str]:
        """Describes losses that no calibration is to be made of: units exchanged, or most of it lost.

        A rest that was bumped, vibration in one or two, and a log that begins later or ends earlier are
        none: what remains is of the same unit.
        """
        turned = [rest for rest in self.lost if rest.turned]
        if turned and (
            self._is_at_an_end(turned, 1 if self.one_is_enough else BLOCK)
            or self._is_large_part(turned)
            or _are_one_state(turned)
        ):
            yield self._exchanged(turned, time)
        elif self._is_at_an_end(self.lost, BLOCK) or self._is_large_part(self.lost):
            yield (
                f"{_rests(self.lost)} of the reference, recorded by this unit too, "
                f"{'are no rests' if len(self.lost) > 1 else 'is no rest'} of it, which is no chance: did it "
                "shake, move, or was it exchanged? Fasten it and record again"
            )
        elif self.unpaired is not None and not self.lost:
            since, count = self.unpaired
            yield (
                f"its rests from {time.at(since)} on meet none of the reference, of which {count} on that "
                "side meet none of its own: was its clock set, or were two sessions joined? Record again"
            )

    def _is_large_part(self, rests: Sequence[LostRest]) -> bool:
        return len(rests) >= LARGE_PART * (len(self.shared) + len(self.lost))

    def _is_at_an_end(self, rests: Sequence[LostRest], fewest: int) -> bool:
        """Returns whether that many of the rests are the first, or the last, that the target recorded."""
        numbers = {rest.number for rest in rests}
        recorded = sorted({*self.shared, *(rest.number for rest in self.lost)})
        return len(numbers) >= fewest and (
            numbers.issuperset(recorded[:fewest]) or numbers.issuperset(recorded[-fewest:])
        )

    def _exchanged(self, turned: Sequence[LostRest], time: LogTime) -> str:
        jump = float(np.linalg.norm(np.mean([rest.jump for rest in turned], axis=0)))
        ended = turned[-1].number < self.shared[0]
        since = self.first_shared if ended else turned[0].start
        return (
            f"from {time.at(since)} on the readings at rest are those of another unit or another state: "
            f"while the reference stands still the bias of the gyroscope changes by {jump:.2g} rad/s, and "
            f"{_rests(turned)} of the reference {'are' if len(turned) > 1 else 'is'} not used; were units "
            "exchanged, or two sessions joined? Record again"
        )


@dataclass(frozen=True, slots=True)
class _Still:
    """Angular rate of a unit at the rests it shares."""

    rates: FloatArray
    """(n, 3) rad/s."""
    recorded: bool

    def jump(self, rate: FloatArray) -> FloatArray:
        """Returns by how much a rate (3,) differs from these, rad/s; zero without a gyroscope."""
        if not self.recorded or not len(self.rates):
            return np.zeros(3)
        difference: FloatArray = rate - np.median(self.rates, axis=0)
        return difference


def _on_clock_of_target(reference: Imu, clock: _core.ClockFigures) -> FloatArray:
    """Start and end (n, 2) of the rests of the reference, s of the clock of the target."""
    times = reference.acquired.rest_times
    begun, *_ = reference.acquired.trace()[0]
    spans: FloatArray = times + clock["offset"] + clock["skew"] * (times - begun)
    return spans


def _unpaired(
    starts: FloatArray, used: Sequence[int], count: int, shared: Sequence[int]
) -> tuple[float, int] | None:
    """Rests of both units behind those they share, or else before: the first of the target, and how many."""
    if not used:
        return None
    behind, before = count - 1 - max(shared), min(shared)
    if behind and max(used) + 1 < len(starts):
        return float(starts[max(used) + 1]), behind
    return (float(starts[0]), before) if before and min(used) else None


def _are_one_state(rests: Sequence[LostRest]) -> bool:
    """Returns whether neighbouring rests share one other bias, as no slow turns by hand do."""
    jumps = np.array([rest.jump for rest in rests])
    mean = jumps.mean(axis=0)
    spread = float(np.linalg.norm(jumps - mean, axis=1).max())
    return len(rests) >= BLOCK and spread < SAME_STATE * float(np.linalg.norm(mean))


def _rests(rests: Sequence[LostRest]) -> str:
    numbers = ", ".join(str(rest.number + 1) for rest in rests)
    return f"rest{'s' if len(rests) > 1 else ''} {numbers}"
