"""Terms of noise: words, units, and the names that other programs have for them."""

from __future__ import annotations

from collections.abc import Mapping

from tumble.foundation.units import UNITS, Triad

QUANTISATION, WHITE, BIAS_INSTABILITY, RANDOM_WALK, RAMP = (
    "quantisation",
    "white noise",
    "bias instability",
    "random walk",
    "ramp",
)
"""The core's words for the terms."""
SLOW = (BIAS_INSTABILITY, RANDOM_WALK, RAMP)
"""Terms that long averages show, as a drifting level does."""
TERM_UNITS: Mapping[Triad, Mapping[str, str]] = {
    "accelerometer": {
        QUANTISATION: "m/s",
        WHITE: "m/s^2/sqrt(Hz)",
        BIAS_INSTABILITY: UNITS["accelerometer"],
        RANDOM_WALK: "m/s^3/sqrt(Hz)",
        RAMP: "m/s^3",
    },
    "gyroscope": {
        QUANTISATION: "rad",
        WHITE: "rad/s/sqrt(Hz)",
        BIAS_INSTABILITY: UNITS["gyroscope"],
        RANDOM_WALK: "rad/s^2/sqrt(Hz)",
        RAMP: "rad/s^2",
    },
}
"""Units of the coefficients Q, N, B, K and R."""
KALIBR: Mapping[Triad, tuple[str, str]] = {
    "accelerometer": ("accelerometer_noise_density", "accelerometer_random_walk"),
    "gyroscope": ("gyroscope_noise_density", "gyroscope_random_walk"),
}
"""Names of N and K; OpenVINS reads the same."""
VINS: Mapping[Triad, tuple[str, str]] = {"accelerometer": ("acc_n", "acc_w"), "gyroscope": ("gyr_n", "gyr_w")}
