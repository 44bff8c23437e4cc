"""All samples of the units to be aligned, and what a rest shows of the primary's gyroscope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import dead_channel, stood_still
from tumble.acquisition.alternation import AlternationWatch
from tumble.acquisition.coarseness import coarse_channels, coarse_notices
from tumble.acquisition.duplicate_sensors import UnitHeads
from tumble.acquisition.imu import ChannelFault, faults_of
from tumble.acquisition.standstills import standstills
from tumble.foundation.arrays import AXES
from tumble.foundation.errors import ProcedureError
from tumble.foundation.growing_array import GrowingArray
from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray, SampleProgress
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of
from tumble.logs import ChunkStream
from tumble.procedures.redundancy.logs import UnitLog

UNKNOWN_BIAS = 0.1
"""rad/s, 1-sigma of a gyroscope's bias that no rest shows."""
KNOWN_BIAS = 0.005
"""rad/s by which the bias may wander in the course of a log whose rests show it."""


@dataclass(frozen=True, slots=True)
class UnitSamples:
    """Samples of one unit, in order of its own clock."""

    arrays: tuple[FloatArray, FloatArray, FloatArray]
    """Time (n,) s, specific force (n, 3) m/s^2, angular rate (n, 3) rad/s."""
    gyroscope_bias: tuple[float, float, float]
    """rad/s, mean over the rests; zero where there is none."""
    gyroscope_bias_sigma: float
    rounding: dict[Triad, FloatArray]
    """(3,) 1-sigma that rounding at rest leaves on the mean of the log, m/s^2 and rad/s."""
    notices: tuple[str, ...]
    """Notices on samples that were left out while reading."""
    gyroscope_digest: str
    """Digest, as from `SensorHead.digest`."""

    @property
    def rate(self) -> float:
        """Usual number of samples a second, Hz."""
        return 1.0 / float(np.median(np.diff(self.arrays[0])))

    @property
    def start(self) -> float:
        """First time, s."""
        return float(self.arrays[0][0])

    @property
    def end(self) -> float:
        """Last time, s."""
        return float(self.arrays[0][-1])


def read_samples(units: Sequence[UnitLog], progress: SampleProgress | None) -> list[UnitSamples]:
    """Reads all units, primary first; raises `TumbleError` where a log cannot be read or is out of order."""
    read: list[UnitSamples] = []
    done = 0
    for unit in units:
        before = done

        def advance(samples: int, expected: int | None, before: int = before) -> None:
            if progress is not None:
                # Units of one set have logs of about one length.
                progress(before + samples, None if expected is None else expected * len(units))

        read.append(_read(unit, advance))
        done += len(read[-1].arrays[0])
    return read


def _read(unit: UnitLog, progress: SampleProgress) -> UnitSamples:
    assert unit.recording is not None
    segmenter, heads, turns = _core.Segmenter(), UnitHeads(), AlternationWatch(TRIADS)
    times, forces, rates = GrowingArray(), GrowingArray(AXES), GrowingArray(AXES)
    samples = 0
    frozen: list[tuple[float, float]] = []
    stuck: list[ChannelFault] = []
    stream = unit.recording.chunks()
    for logged in stream:
        turns.push(logged)
        still = standstills(logged, TRIADS)
        stuck += still.stuck
        frozen += [(float(logged.time[a]), float(logged.time[b])) for a, b in still.frozen]
        chunk = still.moving(logged)
        segmenter.push(chunk.time, chunk.accelerometer, chunk.gyroscope)
        heads.push(chunk)
        for column, values in ((times, chunk.time), (forces, chunk.accelerometer), (rates, chunk.gyroscope)):
            column.add(values)
        samples += len(chunk)
        progress(samples, stream.expected if isinstance(stream, ChunkStream) else None)
    if samples < 2:
        raise ProcedureError(f"{unit.name}: holds {count_of('sample', samples)}; record again")
    turns.refuse(unit.name)
    arrays = times.whole(), forces.whole(), rates.whole()
    timed = np.isfinite(arrays[0])
    time, force, rate = arrays if timed.all() else (each[timed] for each in arrays)
    _refuse_if_backwards(unit.name, time)
    acquired = segmenter.finish()
    log_time = LogTime(float(time[0]))
    faults = [*stuck, *faults_of(acquired)]
    if fault := dead_channel(faults, log_time) or heads.twice():
        raise ProcedureError(f"{unit.name}: {fault}")
    bias, sigma = _bias_at_rest(acquired)
    return UnitSamples(
        (time, force, rate),
        bias,
        sigma,
        {triad: _rounding(acquired, triad) for triad in TRIADS},
        (
            *(stream.counts.notices() if isinstance(stream, ChunkStream) else ()),
            *stood_still(frozen, log_time),
            *coarse_notices(acquired),
        ),
        heads.gyroscope_digest(),
    )


def _refuse_if_backwards(name: str, time: FloatArray) -> None:
    backwards = np.flatnonzero(np.diff(time) < 0.0)
    if len(backwards):
        raise ProcedureError(
            f"{name}: time runs backwards to {time[backwards[0] + 1]:.6f} s; sort the log by time, or read "
            "it with --rate if its samples are in order"
        )


def _rounding(acquired: _core.Acquired, triad: Triad) -> FloatArray:
    """Rounding of a triad at rest, for the share of the time in which it lasts: motion averages it out."""
    share = sum(acquired.rest_samples) / max(acquired.samples, 1)
    sigma = {each.channel: each.sigma for each in coarse_channels(acquired)}
    return share * np.array([sigma.get(f"{triad} {axis}", 0.0) for axis in "xyz"])


def _bias_at_rest(acquired: _core.Acquired) -> tuple[tuple[float, float, float], float]:
    if not len(acquired.rest_times):
        return (0.0, 0.0, 0.0), UNKNOWN_BIAS
    x, y, z = np.average(acquired.rest_angular_rate, axis=0, weights=acquired.rest_samples)
    return (float(x), float(y), float(z)), KNOWN_BIAS
