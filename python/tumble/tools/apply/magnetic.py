"""Readings of a magnetometer, corrected beside the chunks of the IMU."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray


def corrected(
    calibration: Calibration, track: MagneticTrack, temperature: FloatArray | None = None
) -> MagneticTrack:
    """Returns a track freed of calibrated errors; `temperature` (m,), degC, is that of its readings.

    The effect of current is corrected where the log states what the calibration has it for.
    """
    if calibration.magnetometer is None:
        return track
    states_it = track.current_unit == calibration.magnetometer.current_unit
    field = calibration.correct_magnetic(track.field, track.current if states_it else None, temperature)
    return replace(track, field=field, already_corrected=True)


class MagneticPieces:
    """Hands out the corrected readings of a recording with the chunks of its IMU, each once."""

    def __init__(self, calibration: Calibration, track: MagneticTrack) -> None:
        self._calibration = calibration
        self._track = track
        self._done = 0

    def beside(self, chunk: Chunk, *, is_last: bool) -> MagneticTrack:
        """Returns the readings up to the last sample of a chunk, or all that are left, that were not yet."""
        start, end = self._done, len(self._track)
        if not is_last:
            end = int(np.searchsorted(self._track.time, chunk.time[-1:].max(initial=-np.inf), side="right"))
        self._done = max(start, end)
        piece = self._track.chosen(slice(start, self._done))
        return corrected(self._calibration, piece, temperature_at(piece.time, chunk))


def marked(chunks: Iterable[Chunk]) -> Iterator[tuple[Chunk, bool]]:
    """Pairs chunks with whether each is the last."""
    before: Chunk | None = None
    for chunk in chunks:
        if before is not None:
            yield before, False
        before = chunk
    if before is not None:
        yield before, True


def temperature_at(time: FloatArray, chunk: Chunk) -> FloatArray | None:
    """Returns the temperature of a chunk, degC, at (m,) s; None where it has none."""
    if chunk.temperature is None or not len(chunk):
        return None
    return np.interp(time, chunk.time, chunk.temperature)


def warnings_on_magnetometer(calibration: Calibration, track: MagneticTrack | None) -> Iterator[str]:
    """Describes what of the magnetometer of a log the calibration does not correct."""
    section = calibration.magnetometer
    if track is None:
        return
    if section is None:
        yield "the calibration has no magnetometer section; the magnetometer is left as measured"
        return
    if section.current is None:
        return
    wanted = "current" if section.current_unit == "A" else "throttle"
    if track.current is None or track.current_unit != section.current_unit:
        yield f"the calibration has the effect of {wanted}, which the log does not state; it is left in"
    elif unknown := int(np.isnan(track.current).sum()):
        yield f"{wanted} is not known for {unknown} of {len(track)} readings; its effect is left in these"
