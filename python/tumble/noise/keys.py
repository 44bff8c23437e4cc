"""The noise of an IMU under the names that visual-inertial estimators give it, a figure for each triad.

Kalibr and OpenVINS (`kalibr_imu_chain.yaml`) take densities of continuous time. VINS-Mono and VINS-Fusion
take what one sample scatters by: their `acc_n` is added once a sample, so that it is N times the root of the
rate, and so for `acc_w`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from tumble.noise.result import RANDOM_WALK, TERM_UNITS, WHITE, NoiseResult
from tumble.units import UNITS, Triad

KALIBR = {
    "accelerometer": ("accelerometer_noise_density", "accelerometer_random_walk"),
    "gyroscope": ("gyroscope_noise_density", "gyroscope_random_walk"),
}
"""Names of N and K; OpenVINS reads the same."""
VINS = {"accelerometer": ("acc_n", "acc_w"), "gyroscope": ("gyr_n", "gyr_w")}


@dataclass(frozen=True, slots=True)
class NoiseKey:
    """One figure under the name a program reads it by."""

    name: str
    value: float
    unit: str
    remark: str
    """What the figure is, where it is not what was found of every axis."""


def kalibr_keys(result: NoiseResult) -> list[NoiseKey]:
    """Give N and K of each triad as Kalibr and OpenVINS read them."""
    return [
        _of_triad(result, triad, term, name, 1.0, unit)
        for triad in result.triads
        for name, term, unit in zip(KALIBR[triad], (WHITE, RANDOM_WALK), _units(triad), strict=True)
    ]


def vins_keys(result: NoiseResult) -> list[NoiseKey]:
    """Give N and K of each triad as VINS-Mono and VINS-Fusion read them, for the rate of the log."""
    scale = sqrt(result.rate)
    return [
        _of_triad(result, triad, term, name, scale, UNITS[triad] if term == WHITE else f"{UNITS[triad]}/s")
        for triad in result.triads
        for name, term in zip(VINS[triad], (WHITE, RANDOM_WALK), strict=True)
    ]


def keys_text(result: NoiseResult) -> str:
    """Write a file that Kalibr reads with --imu; the keys of VINS are comments in it."""
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
        return f"# {key.name}: not known, as the log is too short or too disturbed"
    remark = f"; {key.remark}" if key.remark else ""
    # YAML 1.1 takes 1e-05 for text: a number needs its point.
    return f"{key.name}: {key.value:.6e}  # {key.unit}{remark}"


def _of_triad(result: NoiseResult, triad: Triad, term: str, name: str, scale: float, unit: str) -> NoiseKey:
    found = [channel.term(term) for channel in result.channels if channel.triad == triad]
    # Estimators refuse zero: where a term is not identifiable, what it is at most.
    values = [each.value if each.observable else each.high for each in found]
    hidden = [axis for axis, each in zip("xyz", found, strict=True) if not each.observable]
    remark = f"not identifiable in {', '.join(hidden)}: what it is at most" if hidden else ""
    return NoiseKey(name, scale * float(np.sqrt(np.mean(np.square(values)))), unit, remark)
