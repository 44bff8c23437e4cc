"""Rests and motions in turn: what may be one spin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.procedures.spin.failure import SpinFailure
from tumble.procedures.spin.segments import Segment, SpinSamples


@dataclass(frozen=True, slots=True)
class Chain:
    """Rests and motions in turn, without a gap: one spin, if it is one."""

    segments: tuple[Segment, ...]
    given: bool = False
    """The user stated that this is a spin."""

    @property
    def start(self) -> float:
        """Time of the first sample, s."""
        return self.segments[0].start

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return self.segments[-1].end

    @property
    def samples(self) -> SpinSamples:
        """All of them."""
        return SpinSamples.joined([segment.samples for segment in self.segments])

    @property
    def rests(self) -> tuple[Rest, ...]:
        """The rests in it."""
        return tuple(segment.rest for segment in self.segments if segment.rest is not None)

    @property
    def rest_times(self) -> FloatArray:
        """(k, 2) s between which the robot stood."""
        times = [(each.start, each.end) for each in self.segments if each.rest is not None]
        return np.array(times, dtype=np.float64).reshape(-1, 2)

    @property
    def motions(self) -> tuple[Segment, ...]:
        """Motions beside and between the rests."""
        return tuple(segment for segment in self.segments if segment.rest is None)


@dataclass(frozen=True, slots=True)
class FailedChain:
    """Why a chain is no spin, and the motion that is to blame, where it is a single one."""

    failure: SpinFailure
    motion: Segment | None = None
