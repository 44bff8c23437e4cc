"""Findings of an inspection, as plain data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

from tumble.foundation.log_time import LogTime
from tumble.foundation.plain import finite
from tumble.foundation.recording import Metadata
from tumble.foundation.results import Rest, Row, Tabular
from tumble.foundation.services import Service
from tumble.foundation.units import TRIADS
from tumble.foundation.words import count_of


@dataclass(frozen=True, slots=True)
class Timing:
    """Time stamps of a recording."""

    samples: int
    """Samples that can be used."""
    start: float
    end: float
    """Seconds of the recording's own clock."""
    duration: float
    """s."""
    rate: float
    """Hz, over the usual intervals."""
    jitter: float
    """1-sigma of the interval, s."""
    gaps: int
    missing: int
    """Samples that would fill the gaps."""
    longest_gap: float
    """s."""
    longest_gap_at: float
    """Beginning of the longest gap, s; NaN if there is none."""
    duplicates: int
    """Samples left out because they carry the time stamp of the one before."""
    without_number: int
    """Samples left out because a channel or the time is no finite number."""


@dataclass(frozen=True, slots=True)
class ChannelFacts:
    """One channel, in SI units."""

    name: str
    """`accelerometer x`."""
    unit: str
    low: float
    mean: float
    high: float
    step: float | None
    """Quantisation step; None if the values show none."""
    saturated: int
    """Samples pinned at the end of the range."""
    stuck: bool
    """One value from beginning to end."""
    noise_density: float
    """White noise at rest, unit / sqrt(Hz); NaN where no rest shows it."""


@dataclass(frozen=True, slots=True)
class MagnetometerFacts:
    """A magnetometer, raw."""

    name: str
    """Name in the log; empty where it needs none."""
    readings: int
    rate: float
    """Hz."""
    unit: str
    """Unit in the log."""
    unit_reason: str
    low: float
    """uT: 5 % of the readings are shorter."""
    strength: float
    """uT, the median length of readings."""
    high: float
    """uT: 5 % of the readings are longer."""
    has_current: bool
    """Indicates whether a current or throttle was recorded beside it."""


@dataclass(frozen=True, slots=True)
class Inspection(Tabular):
    """One recording looked at from beginning to end."""

    metadata: Metadata
    timing: Timing
    channels: tuple[ChannelFacts, ...]
    temperature: tuple[float, float, float] | None
    """Lowest, mean and highest, degC."""
    magnetometer: MagnetometerFacts | None
    """The magnetometer beside it; None where none was recorded."""
    rests: tuple[Rest, ...]
    not_rests: tuple[tuple[float, float, str], ...]
    """Start s, end s and why: segments that only look like rests."""
    directions: int
    """Directions of gravity more than 20 deg apart that the rests show."""
    services: tuple[Service, ...]
    remarks: tuple[str, ...]
    """Remarks on the recording for the user."""

    @property
    def name(self) -> str:
        """Short name of the recording."""
        return self.metadata.name

    def rows(self) -> Iterator[Row]:
        """Returns a line for each channel."""
        for channel in self.channels:
            yield {name: getattr(channel, name) for name in ChannelFacts.__slots__}

    def content(self) -> dict[str, Any]:
        """Plain mappings, lists, text and finite numbers, for JSON."""
        return cast("dict[str, Any]", finite(self))

    def __repr__(self) -> str:
        return "\n".join([f"Inspection({self.metadata.source})", *(f"  {line}" for line in self.lines())])

    def lines(self) -> list[str]:
        """All of it in words, a fact a line."""
        return [
            *head_lines(self),
            *(channel_line(channel) for channel in self.channels),
            *rest_lines(self),
            *(service_line(service) for service in self.services),
            *self.remarks,
        ]


def head_lines(inspection: Inspection) -> list[str]:
    """Describes the recording: format, time, units."""
    metadata, timing = inspection.metadata, inspection.timing
    serial = f", serial {metadata.serial}" if metadata.serial else ""
    lines = [
        f"{metadata.format}, frame {metadata.frame}{serial}, {_corrected(metadata)}",
        *((f"axes {metadata.axes}",) if metadata.axes else ()),
        _started(timing),
        f"{count_of('sample', timing.samples)} over {timing.duration:.6g} s, {timing.rate:.6g} Hz, "
        f"jitter {1e6 * timing.jitter:.3f} us",
        f"{count_of('gap', timing.gaps)}{_gap_details(timing)}, "
        f"{count_of('repeated time stamp', timing.duplicates)}, "
        f"{count_of('sample', timing.without_number)} without a number",
    ]
    for what in (*TRIADS, "time"):
        unit = getattr(metadata, f"{what}_unit")
        recorded = what == "time" or what in metadata.triads
        lines.append(f"{what} in {unit.name} ({unit.reason})" if recorded else f"{what} not recorded")
    if inspection.temperature is not None:
        low, mean, high = inspection.temperature
        lines.append(f"temperature {low:.4g} to {high:.4g} degC, mean {mean:.4g}")
    if inspection.magnetometer is not None:
        lines.append(magnetometer_line(inspection.magnetometer))
    return lines


def magnetometer_line(facts: MagnetometerFacts) -> str:
    """Describes a magnetometer: rate, unit and strength of the field."""
    name = f" {facts.name}" if facts.name else ""
    current = ", with current" if facts.has_current else ""
    return (
        f"magnetometer{name} in {facts.unit} ({facts.unit_reason}), {count_of('reading', facts.readings)}, "
        f"{facts.rate:.4g} Hz{current}: field of {facts.strength:.4g} uT, "
        f"most between {facts.low:.4g} and {facts.high:.4g} uT"
    )


def channel_line(channel: ChannelFacts) -> str:
    """Describes one channel."""
    step = "no step seen" if channel.step is None else f"step {channel.step:.4g}"
    state = ", stuck" if channel.stuck else ""
    state += f", {count_of('sample', channel.saturated)} saturated" if channel.saturated else ""
    return f"{channel.name}: {channel.low:.5g} to {channel.high:.5g} {channel.unit}, {step}{state}"


def rest_lines(inspection: Inspection) -> list[str]:
    """Describes the number of rests, and rejected candidates."""
    total = sum(rest.end - rest.start for rest in inspection.rests)
    where = (
        f" in {count_of('direction', inspection.directions)}"
        if "accelerometer" in inspection.metadata.triads
        else ""
    )
    lines = [f"{count_of('rest', len(inspection.rests))}{where}, {total:.4g} s in all"]
    reasons = Counter(why for _, _, why in inspection.not_rests)
    lines += [f"{count_of('segment', count)} not quite a rest: {why}" for why, count in reasons.items()]
    return lines


def service_line(service: Service) -> str:
    """Describes whether the recording suits a procedure, and missing conditions if not."""
    if not service.possible:
        return f"{service.procedure}: no, it needs {'; '.join(service.missing)}"
    return f"{service.procedure}: yes" + "".join(f", but {remark}" for remark in service.remarks)


def _corrected(metadata: Metadata) -> str:
    words = {True: "already corrected", False: "as the sensor gives it", None: "not known to be corrected"}
    return words[metadata.already_corrected]


def _started(timing: Timing) -> str:
    """Describes its start by its own clock: printed times count from there."""
    date = LogTime(timing.start).date
    return f"start: {f'{date}, ' if date else ''}{timing.start:.6f} s of its clock"


def _gap_details(timing: Timing) -> str:
    if not timing.gaps:
        return ""
    longest = f"longest {timing.longest_gap:.4g} s at {LogTime(timing.start).at(timing.longest_gap_at, 6)}"
    return f" ({count_of('sample', timing.missing)} missing, {longest})"
