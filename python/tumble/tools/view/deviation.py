"""Allan deviation of a section, by the core."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.tools.view.samples import CHUNK, KeptSamples
from tumble.tools.viewers.content import Form

FEWEST_SAMPLES = 64


@dataclass(frozen=True, slots=True)
class Deviation:
    """Allan deviation of one channel."""

    channel: str
    tau: FloatArray
    """(n,) averaging time, s."""
    deviation: FloatArray
    """(n,) unit of the channel."""
    low: FloatArray
    high: FloatArray
    """(n,) ends of the 95 % interval."""


def deviations(samples: KeptSamples, start: float, end: float, form: Form = "raw") -> list[Deviation]:
    """Returns the Allan deviations of a section, s of the time shown; no difference spans a gap.

    Raises `ProcedureError` where it is too short.
    """
    channels = samples.recording.metadata.channels
    record = _core.NoiseRecord(len(channels), allan_only=True)
    count, time = 0, 0.0
    for run in samples.stretches(start, end):
        for first in range(run.start, run.stop, CHUNK):
            rows = slice(first, min(first + CHUNK, run.stop))
            record.push(np.stack([samples.values(form, channel, rows) for channel in channels], axis=1))
        record.end_stretch()
        if run.stop - run.start > 1:
            count += run.stop - run.start - 1
            time += samples.interval(run) * (run.stop - run.start - 1)
    if count < FEWEST_SAMPLES:
        raise ProcedureError(
            f"{start:.3f} to {end:.3f} s holds {count} samples; an Allan deviation needs {FEWEST_SAMPLES}, "
            "select more",
            about=samples.name,
        )
    found = record.conclude(time / count)
    return [Deviation(name, *each["allan"].T[:4].copy()) for name, each in zip(channels, found, strict=True)]
