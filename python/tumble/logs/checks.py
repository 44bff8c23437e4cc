"""What every log has to keep to, checked while it streams by: time that runs forwards, and numbers."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tumble.errors import LogError
from tumble.logs.track import LoggedImu, RawSamples
from tumble.logs.units import IMPOSSIBLE_RAD_PER_S
from tumble.recording import Chunk, FloatArray

CHANNELS = ("ax", "ay", "az", "gx", "gy", "gz")

_LARGEST_SHARE_WITHOUT_NUMBER = 0.01
_LARGEST_SHARE_OF_CLASHES = 0.1

Mask = NDArray[np.bool_]


@dataclass(slots=True)
class Counts:
    """What a pass over a recording has met so far."""

    read: int = 0
    """Samples in the log."""
    duplicates: int = 0
    """Samples left out because they carry the time stamp of the one before."""
    clashes: int = 0
    """Those of the duplicates whose values differ from the sample before."""
    without_number: int = 0
    """Samples left out because the time or a channel is no finite number."""
    channels: dict[str, int] = field(default_factory=dict)
    """Of those, how many each channel accounts for."""

    def add(self, other: Counts) -> None:
        """Count what another pass has met as well."""
        self.read += other.read
        self.duplicates += other.duplicates
        self.clashes += other.clashes
        self.without_number += other.without_number
        for name, count in other.channels.items():
            self.channels[name] = self.channels.get(name, 0) + count

    def notices(self) -> tuple[str, ...]:
        """Say what was left out; empty if nothing was."""
        notices = []
        if self.duplicates:
            notices.append(f"left out {self.duplicates} samples with the time stamp of the one before")
        if self.without_number:
            channels = ", ".join(f"{name} {count}" for name, count in self.channels.items())
            notices.append(f"left out {self.without_number} samples without a number ({channels})")
        return tuple(notices)


class ChunkStream(Iterator[Chunk]):
    """One pass over a track: chunks that are fit to use, and `counts` of what was left out on the way.

    `expected` is the number of samples to come where that is known beforehand, for those who show progress.

    Raises `LogError` at the sample where time runs backwards, and at the end of a pass in which too many
    samples had to be left out; not so with `keep_faults`, which passes on all that has a time.
    """

    def __init__(
        self,
        track: LoggedImu,
        pieces: Iterator[RawSamples],
        rate: float | None,
        gyroscope_unit_is_assumed: bool,
        keep_faults: bool = False,
    ) -> None:
        self.counts = Counts()
        self.expected = track.expected
        self._track = track
        self._rate = rate
        self._gyroscope_unit_is_assumed = gyroscope_unit_is_assumed
        self._keep_faults = keep_faults
        self._last: Chunk | None = None
        self._chunks = self._generate(pieces)

    def __next__(self) -> Chunk:
        return next(self._chunks)

    def close(self) -> None:
        """Stop reading and let go of the file."""
        self._chunks.close()

    def _generate(self, pieces: Iterator[RawSamples]) -> Generator[Chunk, None, None]:
        for piece in pieces:
            first = self.counts.read
            self.counts.read += len(piece)
            stamped = self._with_time(piece, first)
            kept = (
                self._drop_no_samples(stamped)
                if self._keep_faults
                else self._drop_gaps_in_numbers(stamped, first)
            )
            chunk = self._drop_duplicates(kept)
            if len(chunk):
                chunk = self._hold_temperature(chunk)
                self._last = chunk
                self._check_rates(chunk)
                yield chunk
        self._check_totals()

    def _with_time(self, piece: RawSamples, first: int) -> Chunk:
        time = piece.time
        if time is None:
            assert self._rate is not None
            time = np.arange(first, first + len(piece), dtype=np.float64) / self._rate
        return Chunk(time, piece.accelerometer, piece.gyroscope, piece.temperature)

    def _drop_gaps_in_numbers(self, chunk: Chunk, first: int) -> Chunk:
        """Leave out samples that are not finite, then see that time runs forwards over what is left."""
        # A sum is finite only if every term is, bar overflow: one pass instead of six.
        total = chunk.time.sum() + chunk.accelerometer.sum() + chunk.gyroscope.sum()
        finite = np.ones(len(chunk), dtype=np.bool_) if np.isfinite(total) else self._finite(chunk)
        kept = chunk if finite.all() else _select(chunk, finite)
        steps = np.diff(kept.time, prepend=self._last.time[-1:] if self._last is not None else kept.time[:1])
        if bool((steps < 0.0).any()):
            at = int(np.argmax(steps < 0.0))
            place = self._track.locate(first + int(np.flatnonzero(finite)[at]))
            raise LogError(
                f"{self._track.source}: {place}: time runs backwards by "
                f"{-float(steps[at]):.6g} s to {float(kept.time[at]):.9g} s; "
                "sort the log by time, or read it with --rate if its samples are in order"
            )
        return kept

    def _drop_no_samples(self, chunk: Chunk) -> Chunk:
        """Leave out what has no time, and rows in which only other IMUs of the table have numbers."""
        stamped = np.isfinite(chunk.time)
        if unstamped := int((~stamped).sum()):
            self.counts.channels["time"] = self.counts.channels.get("time", 0) + unstamped
            self.counts.without_number += unstamped
        if not self._track.alone:
            stamped &= np.isfinite(chunk.accelerometer).any(axis=1) | np.isfinite(chunk.gyroscope).any(axis=1)
        return chunk if stamped.all() else _select(chunk, stamped)

    def _finite(self, chunk: Chunk) -> Mask:
        bad = {"time": ~np.isfinite(chunk.time)}
        for index in range(3):
            bad[CHANNELS[index]] = ~np.isfinite(chunk.accelerometer[:, index])
            bad[CHANNELS[index + 3]] = ~np.isfinite(chunk.gyroscope[:, index])
        for name, mask in bad.items():
            if found := int(mask.sum()):
                self.counts.channels[name] = self.counts.channels.get(name, 0) + found
        finite: Mask = ~np.logical_or.reduce(list(bad.values()))
        self.counts.without_number += int((~finite).sum())
        return finite

    def _drop_duplicates(self, chunk: Chunk) -> Chunk:
        if len(chunk) == 0:
            return chunk
        doubled = np.zeros(len(chunk), dtype=np.bool_)
        doubled[1:] = chunk.time[1:] == chunk.time[:-1]
        if self._last is not None:
            doubled[0] = chunk.time[0] == self._last.time[-1]
        if not doubled.any():
            return chunk
        self.counts.duplicates += int(doubled.sum())
        self.counts.clashes += int((doubled & self._differs_from_previous(chunk)).sum())
        return _select(chunk, ~doubled)

    def _differs_from_previous(self, chunk: Chunk) -> Mask:
        values = np.hstack([chunk.accelerometer, chunk.gyroscope])
        differs = np.zeros(len(chunk), dtype=np.bool_)
        differs[1:] = (values[1:] != values[:-1]).any(axis=1)
        if self._last is not None:
            previous = np.hstack([self._last.accelerometer[-1], self._last.gyroscope[-1]])
            differs[0] = bool((values[0] != previous).any())
        return differs

    def _hold_temperature(self, chunk: Chunk) -> Chunk:
        """Fill gaps in temperature, which is often logged less often, with the value before."""
        if chunk.temperature is None or not np.isnan(chunk.temperature).any():
            return chunk
        before = np.nan
        if self._last is not None and self._last.temperature is not None:
            before = self._last.temperature[-1]
        values = np.concatenate([[before], chunk.temperature])
        latest = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
        return replace(chunk, temperature=values[latest][1:])

    def _check_rates(self, chunk: Chunk) -> None:
        if not self._gyroscope_unit_is_assumed:
            return
        rates = np.abs(chunk.gyroscope)
        if self._keep_faults:
            rates = np.where(np.isfinite(rates), rates, 0.0)
        fastest = float(rates.max())
        if fastest > IMPOSSIBLE_RAD_PER_S:
            at = float(chunk.time[int(rates.max(axis=1).argmax())])
            raise LogError(
                f"{self._track.source}: gyroscope was assumed to be in rad/s, as no unit is stated, but "
                f"reads {fastest:.6g} at {at:.6f} s; give --gyroscope-unit (deg/s?)"
            )

    def _check_totals(self) -> None:
        counts = self.counts
        if counts.read == 0:
            raise LogError(f"{self._track.source}: holds no samples")
        if self._keep_faults:
            return
        if counts.without_number > _LARGEST_SHARE_WITHOUT_NUMBER * counts.read:
            name, found = max(counts.channels.items(), key=lambda item: item[1])
            raise LogError(
                f"{self._track.source}: {name} is no number in {found} of {counts.read} samples; "
                "up to 1 % would be left out, but this is a fault: repair or cut the log"
            )
        if counts.clashes > _LARGEST_SHARE_OF_CLASHES * counts.read:
            raise LogError(
                f"{self._track.source}: {counts.clashes} of {counts.read} samples share the time stamp of "
                "the one before but not its values: the clock of the log is too coarse; read it with --rate"
            )


def _select(chunk: Chunk, mask: Mask) -> Chunk:
    temperature: FloatArray | None = None if chunk.temperature is None else chunk.temperature[mask]
    return Chunk(chunk.time[mask], chunk.accelerometer[mask], chunk.gyroscope[mask], temperature)
