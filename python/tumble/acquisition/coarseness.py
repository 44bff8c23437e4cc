"""Notices on channels of which rounding, or a dead band, leaves more on a mean than noise does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tumble import _core
from tumble.acquisition import messages
from tumble.foundation.units import TRIADS, UNITS, Triad


class CoarseChannel(NamedTuple):
    """A channel as `Acquired.coarse_channels` has it, SI."""

    channel: str
    step: float
    """Step that its readings are multiples of; zero where rounding does not matter."""
    dead_band: float
    """Half the width of the band in which it reads exactly zero; zero where that does not matter."""
    zeros: float
    """Share of the samples at rest that read exactly zero."""
    sigma: float
    """1-sigma that both leave on a mean at rest."""

    @property
    def axis(self) -> str:
        """Letter of the axis."""
        return self.channel[-1]


def coarse_channels(acquired: _core.Acquired, triads: tuple[Triad, ...] = TRIADS) -> list[CoarseChannel]:
    """Returns the channels of the triads that were recorded, of which rounding or a dead band matters."""
    found = map(CoarseChannel._make, acquired.coarse_channels)
    return [each for each in found if each.channel.startswith(triads)]


def coarse_notices(acquired: _core.Acquired, triads: tuple[Triad, ...] = TRIADS) -> Iterator[str]:
    """Yields a notice on each triad that is coarser than its noise, and on each with a dead band."""
    found = coarse_channels(acquired, triads)
    for triad in TRIADS:
        own = [each for each in found if each.channel.startswith(triad)]
        yield from _about_steps(triad, [each for each in own if each.step])
        yield from _about_the_dead_band(triad, [each for each in own if each.dead_band])


def _about_steps(triad: Triad, found: Sequence[CoarseChannel]) -> Iterator[str]:
    if not found:
        return
    axes, unit = ", ".join(each.axis for each in found), UNITS[triad]
    step, sigma = max(each.step for each in found), max(each.sigma for each in found)
    yield messages.COARSE.format(triad=triad, axes=axes, step=step, sigma=sigma, unit=unit)


def _about_the_dead_band(triad: Triad, found: Sequence[CoarseChannel]) -> Iterator[str]:
    if not found:
        return
    axes, unit = ", ".join(each.axis for each in found), UNITS[triad]
    width, zeros = max(each.dead_band for each in found), 100.0 * max(each.zeros for each in found)
    yield messages.DEAD_BAND.format(triad=triad, axes=axes, zeros=zeros, width=width, unit=unit)
