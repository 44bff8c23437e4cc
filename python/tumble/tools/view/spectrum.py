"""Amplitude spectral density of a section, by Welch's method.

Source: P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra", IEEE Trans.
Audio Electroacoust. 15, 1967. Segments overlap by half, have a Hann window, and are freed of their mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.tools.view.samples import KeptSamples
from tumble.tools.viewers.content import Form

FEWEST_SAMPLES = 64
LARGEST_SEGMENT = 1 << 16
SEGMENTS = 8
"""Segments, without overlap, that are wanted for a mean that is smooth enough to read."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Amplitude spectral density of one channel."""

    channel: str
    frequency: FloatArray
    """(n,) Hz, from the first above zero to half the rate."""
    density: FloatArray
    """(n,) unit of the channel / sqrt(Hz)."""


def spectra(samples: KeptSamples, start: float, end: float, form: Form = "raw") -> list[Spectrum]:
    """Returns the spectra of a section, s of the time shown, of its longest run without a gap.

    Raises `ProcedureError` where that is too short.
    """
    runs = samples.stretches(start, end)
    longest = max(runs, key=lambda run: run.stop - run.start, default=slice(0, 0))
    count = longest.stop - longest.start
    if count < FEWEST_SAMPLES:
        raise ProcedureError(
            f"{start:.3f} to {end:.3f} s holds {count} samples without a gap; a spectrum needs "
            f"{FEWEST_SAMPLES}, select more",
            about=samples.name,
        )
    rate = 1.0 / samples.interval(longest)
    return [
        Spectrum(channel, *amplitude_density(samples.values(form, channel, longest), rate))
        for channel in samples.recording.metadata.channels
    ]


def amplitude_density(values: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Returns frequencies, Hz, and amplitude spectral density of (n,) values at `rate`, Hz.

    The square of the density, summed over frequency, is the variance of the values.
    """
    length = min(LARGEST_SEGMENT, 1 << max(int(np.log2(len(values) / SEGMENTS)), 5))
    window = np.hanning(length + 1)[:-1]
    power = np.zeros(length // 2 + 1)
    starts = range(0, len(values) - length + 1, length // 2)
    for first in starts:
        segment = values[first : first + length]
        power += np.abs(np.fft.rfft((segment - segment.mean()) * window)) ** 2
    density: FloatArray = power / (len(starts) * rate * np.square(window).sum())
    density[1:-1] *= 2.0
    frequency: FloatArray = np.fft.rfftfreq(length, 1.0 / rate).astype(np.float64)
    return frequency[1:], np.sqrt(density[1:])
