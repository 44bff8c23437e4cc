"""The noise of an IMU under the names that visual-inertial estimators give it, a figure for each triad.

Kalibr and OpenVINS (`kalibr_imu_chain.yaml`) take densities of continuous time. VINS-Mono and VINS-Fusion
take what one sample scatters by: their `acc_n` is added once a sample, so that it is N times the root of the
rate, and so for `acc_w`.

A filter that trusts its sensor too much diverges, one that trusts it too little is slow. So where the record
does not show a term, or the terms do not follow the curve, its key is conservative: N is what the measured
Allan deviation itself is at 1 s, K is its upper bound. No key is below the curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan, sqrt

import numpy as np

from tumble.foundation.noise_terms import KALIBR, RANDOM_WALK, TERM_UNITS, VINS, WHITE
from tumble.foundation.units import UNITS, Triad
from tumble.procedures.noise.result import ChannelNoise, NoiseResult


@dataclass(frozen=True, slots=True)
class NoiseKey:
    """One figure under the name a program reads it by."""

    name: str
    value: float
    unit: str
    remark: str
    """Explanation of the figure, where it is not the plain estimate of every axis."""


def kalibr_keys(result: NoiseResult) -> list[NoiseKey]:
    """Returns N and K of each triad as Kalibr and OpenVINS read them."""
    return [
        _of_triad(result, triad, term, name, 1.0, unit)
        for triad in result.triads
        for name, term, unit in zip(KALIBR[triad], (WHITE, RANDOM_WALK), _units(triad), strict=True)
    ]


def vins_keys(result: NoiseResult) -> list[NoiseKey]:
    """Returns N and K of each triad as VINS-Mono and VINS-Fusion read them, for the rate of the log."""
    scale = sqrt(result.rate)
    return [
        _of_triad(result, triad, term, name, scale, UNITS[triad] if term == WHITE else f"{UNITS[triad]}/s")
        for triad in result.triads
        for name, term in zip(VINS[triad], (WHITE, RANDOM_WALK), strict=True)
    ]


def keys_text(result: NoiseResult) -> str:
    """Writes a file that Kalibr reads with --imu; the keys of VINS are comments in it."""
    lines = [
        f"# Noise of {result.name}, root mean square over the axes, by {result.software}.",
        "# Kalibr and OpenVINS: continuous time. Many set two to ten times as much for a unit that moves.",
        *(_line(key) for key in kalibr_keys(result)),
        "rostopic: /imu/data  # yours",
        f"update_rate: {result.rate:.6g}  # Hz",
        f"# VINS-Mono and VINS-Fusion: of one sample at {result.rate:.6g} Hz.",
        *(f"# {_line(key).removeprefix('# ')}" for key in vins_keys(result)),
    ]
    return "\n".join(lines) + "\n"


def _units(triad: Triad) -> tuple[str, str]:
    return TERM_UNITS[triad][WHITE], TERM_UNITS[triad][RANDOM_WALK]


def _line(key: NoiseKey) -> str:
    if not isfinite(key.value):
        return f"# {key.name}: not known, as the log is too short, too disturbed or too coarse"
    remark = f"; {key.remark}" if key.remark else ""
    # YAML 1.1 takes 1e-05 for text: a number needs its point.
    return f"{key.name}: {key.value:.6e}  # {key.unit}{remark}"


def filter_density(channel: ChannelNoise) -> float:
    """Returns N for a filter: as it was found, or conservative, the curve's own value at 1 s."""
    term = channel.term(WHITE)
    if channel.is_rounded:
        return nan
    if term.observable and channel.misfit == 0.0:
        return term.value
    curve = channel.density_at_one_second
    return max(term.value, curve) if term.observable else curve


def filter_random_walk(channel: ChannelNoise) -> float:
    """Returns K for a filter: as it was found, or conservative, its upper bound."""
    term = channel.term(RANDOM_WALK)
    return term.value if term.observable and channel.misfit == 0.0 else term.high


_CONSERVATIVE = {
    WHITE: "the measured Allan deviation at 1 s",
    RANDOM_WALK: "its upper bound",
}


def _of_triad(result: NoiseResult, triad: Triad, term: str, name: str, scale: float, unit: str) -> NoiseKey:
    channels = [channel for channel in result.channels if channel.triad == triad]
    found = {WHITE: filter_density, RANDOM_WALK: filter_random_walk}[term]
    # Estimators refuse zero.
    values = [found(channel) for channel in channels]
    raised = [
        axis
        for axis, channel, value in zip("xyz", channels, values, strict=True)
        if not channel.term(term).observable or value > channel.term(term).value
    ]
    remark = f"conservative in {', '.join(raised)}: {_CONSERVATIVE[term]}" if raised else ""
    return NoiseKey(name, scale * float(np.sqrt(np.mean(np.square(values)))), unit, remark)
