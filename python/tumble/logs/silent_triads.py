"""Triads that a log has a place for and no reading of: they are left out, and the other one is used.

A driver without a gyroscope publishes zeros, or states -1 as their covariance; so does each topic of a camera
that publishes its two sensors apart. A sensor that reads 0 at every moment shows nothing either.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.logs.track import LoggedImu, RawSamples


def without_silent_triads(track: LoggedImu, head: RawSamples) -> LoggedImu:
    """Returns a track without the triad that holds no reading, in a log where the other one does."""
    silent = [triad for triad in track.triads if _is_silent(_of(head, triad))]
    if len(track.triads) < len(TRIADS) or len(silent) != 1 or _speaks_later(track, silent[0]):
        return track
    (triad,) = silent
    kept: Triad = "gyroscope" if triad == "accelerometer" else "accelerometer"
    seen = "is 0 in all samples" if np.isfinite(_of(head, triad)).any() else "holds no number"
    return replace(
        track, triads=(kept,), notices=(*track.notices, f"{triad} {seen}, and is left out as not recorded")
    )


def _of(samples: RawSamples, triad: Triad) -> FloatArray:
    return samples.accelerometer if triad == "accelerometer" else samples.gyroscope


def _is_silent(readings: FloatArray) -> bool:
    return not np.nan_to_num(readings).any()


def _speaks_later(track: LoggedImu, triad: Triad) -> bool:
    """Returns whether any sample behind the head reads anything; a coarse gyroscope rests at 0."""
    return any(not _is_silent(_of(samples, triad)) for samples in track.read(lambda samples: samples))
