"""The magnetometer of a log, corrected."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.turned_axes import in_axes
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray, Recording


def corrected_magnetometer(calibration: Calibration, recording: Recording) -> MagneticTrack | None:
    """Returns the readings of a magnetometer freed of calibrated errors; None where the log has none.

    The effect of current is corrected where the log states what the calibration has it for. Without a
    calibrated magnetometer readings stay as they are.
    """
    track = recording.magnetic
    calibration = in_axes(calibration, recording.metadata.body)
    section = calibration.magnetometer
    if track is None or section is None:
        return track
    current = track.current if track.current_unit == section.current_unit else None
    temperature = None if section.temperature_drift is None else _temperature(recording, track)
    return replace(track, field=calibration.correct_magnetic(track.field, current, temperature))


def _temperature(recording: Recording, track: MagneticTrack) -> FloatArray | None:
    """Returns the temperature of the IMU at each reading, degC; None where it was not recorded."""
    found = np.full(len(track), np.nan)
    for chunk in recording.chunks():
        if chunk.temperature is not None and len(chunk):
            within = (track.time >= chunk.time[0]) & (track.time <= chunk.time[-1])
            found[within] = np.interp(track.time[within], chunk.time, chunk.temperature)
    return found if np.isfinite(found).any() else None


def warnings_on_magnetometer(
    calibration: Calibration, track: MagneticTrack | None, *, what: str = "log"
) -> Iterator[str]:
    """Describes parts of the magnetometer of `what`, a log or a source, that are not corrected."""
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
        yield f"the calibration has the effect of {wanted}, which the {what} does not state; it is left in"
    elif unknown := int(np.isnan(track.current).sum()):
        yield f"{wanted} is not known for {unknown} of {len(track)} readings; its effect is left in these"
