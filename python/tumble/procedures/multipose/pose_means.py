"""Tables with one row a pose: each row is the mean of a rest, and its scatter about the fit is its noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tumble import _core
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.logs import ReadOptions
from tumble.procedures.multipose.sections import REST, Section

SAMPLES = 20
"""Samples that stand for the mean of a pose: as many as a section of a log has at least, twice."""
RATE = 10.0
"""Hz, at which they are taken: a pose is held for two seconds."""
ROUGH = 0.1
"""m/s^2 of noise of a mean with which the fit starts: so large that no pose stands out."""
ROUNDS = 3
"""Fits after the first, by which the noise settles."""
MOST_ROWS = 2000
"""Rows of a table of means: whoever holds poses by hand has tens, a robot hundreds; a recording has more."""
APART = math.radians(5.0)
"""rad, between neighbouring rows of half of a table of means: a log does not turn so far at each sample."""


def without_time(read: ReadOptions | None) -> ReadOptions:
    """Returns options that read rows without a time, one a second where nothing else is stated."""
    read = read or ReadOptions()
    return replace(read, rate=read.rate or 1.0)


def held(recording: Recording) -> tuple[Recording, tuple[Section, ...]]:
    """Returns a recording in which each row of a table stands still for a while, and those rests.

    Raises `ProcedureError` where there are more rows than anybody holds poses.
    """
    forces = np.concatenate([chunk.accelerometer for chunk in recording.chunks()])
    # Reading has counted rows without a number, and refused a log of many.
    forces = forces[np.isfinite(forces).all(axis=1)]
    if len(forces) > MOST_ROWS:
        raise ProcedureError(
            f"--pose-means: {len(forces)} rows, where a table of means has up to {MOST_ROWS}; leave it "
            "out for a recording",
            about=recording.name,
        )
    repeated = np.repeat(forces, SAMPLES, axis=0)
    time = np.arange(len(repeated)) / RATE
    chunk = Chunk(time, repeated, np.full_like(repeated, np.nan))
    metadata = replace(recording.metadata, triads=("accelerometer",), rate=RATE)
    rests = (Section(REST, k, k + SAMPLES) for k in range(0, len(repeated), SAMPLES))
    return Recording(metadata, lambda: iter((chunk,))), tuple(rests)


def each_points_elsewhere(recording: Recording) -> bool:
    """Returns whether neighbouring samples of a log differ in direction as poses do."""
    if recording.metadata.triads != ("accelerometer",):
        return False
    forces = np.concatenate([chunk.accelerometer for chunk in recording.chunks()])
    up = forces / np.linalg.norm(forces, axis=1, keepdims=True)
    cosines = np.sum(up[1:] * up[:-1], axis=1)
    return len(cosines) > 0 and float(np.nanmedian(cosines)) < math.cos(APART)


def with_noise_of_means(
    fit: Callable[[FloatArray | None], _core.MultiposeFigures],
) -> tuple[_core.MultiposeFigures, float]:
    """Returns the fit under the noise that its residuals show, and that noise of a mean, m/s^2.

    `fit` takes the noise densities of the six channels, unit/sqrt(Hz).
    Method: docs/theory/multipose.md, section 12.
    """
    sigma = ROUGH
    figures = fit(_density(sigma))
    for _ in range(ROUNDS):
        found = figures["accelerometer"]
        shown = sigma * math.sqrt(found["chi_square"] / found["degrees_of_freedom"])  # eq. 41
        if shown == 0.0:
            break
        sigma = shown
        figures = fit(_density(sigma))
    return figures, sigma


def _density(sigma: float) -> FloatArray:
    """Returns the noise of the six channels whose mean over a pose has this sigma."""
    return np.concatenate([np.full(3, sigma * math.sqrt(SAMPLES / RATE)), np.full(3, np.nan)])
