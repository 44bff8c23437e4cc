"""Content for viewers, stated once: units with samples, segments and parameters, and events."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, Literal, TypeAlias

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.log_time import DATES
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.foundation.results import Parameter, Rest
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad
from tumble.tools.apply.magnetic import corrected_magnetometer

SegmentState: TypeAlias = Literal[
    "rest", "turn", "left out", "spin", "disturbance", "source", "unhealthy", "collecting"
]
Form: TypeAlias = Literal["raw", "calibrated"]
EventLevel: TypeAlias = Literal["info", "warning", "error"]
SEGMENTS: Final = "segments"
"""Lane of rests and of the turns between them."""
BETWEEN_FILES: Final = 1.0
"""s between the files of a recording, of which each has a clock of its own; the core puts as much there."""
GOOD_VERDICTS: Final = ("pass", "calibrated", "aligned", "measured", "same")


@dataclass(frozen=True, slots=True)
class ShownSegment:
    """A stretch of time in one state."""

    state: SegmentState
    start: float
    end: float
    """s of the clock of the unit."""
    label: str = ""
    """`3: Y up`."""
    remark: str = ""
    """Reason why it is not used, or an irregularity."""
    specific_force: FloatArray | None = None
    """(3,) mean of a rest, m/s^2."""


@dataclass(frozen=True, slots=True)
class ShownEvent:
    """An instant at which something was found."""

    time: float
    """s of the clock of the first unit."""
    unit: str
    level: EventLevel
    text: str


@dataclass(frozen=True, slots=True)
class ShownParameter:
    """A number of a calibration with its uncertainty."""

    sensor: str
    name: str
    """`bias x`."""
    unit: str
    value: float
    """NaN where the data do not show it."""
    sigma: float
    """1-sigma; NaN where it is not stated."""

    @property
    def text(self) -> str:
        """Prints `0.0123 +- 0.0004 m/s^2`."""
        if not np.isfinite(self.value):
            return "not observable"
        unit = "" if self.unit == "1" else f" {self.unit}"
        sigma = f" +- {self.sigma:.2g}" if np.isfinite(self.sigma) else ""
        return f"{self.value:.6g}{sigma}{unit}"


@dataclass(frozen=True, slots=True)
class UnitPose:
    """Pose of a unit relative to the first one."""

    rotation: FloatArray
    """(3, 3) first from unit."""
    translation: FloatArray
    """(3,) m, from the first unit, in its case frame; zero along what the motion does not show."""


@dataclass(frozen=True, slots=True)
class ShownUnit:
    """A unit with all that is shown of it."""

    name: str
    recording: Recording
    calibration: Calibration | None = None
    """Calibration that corrects its readings, which are then shown beside the raw ones."""
    lanes: Mapping[str, Sequence[ShownSegment]] = field(default_factory=dict)
    """Segments by the name of their lane; those of a lane do not overlap."""
    parameters: Sequence[ShownParameter] = ()
    verdict: str = ""
    pose: UnitPose | None = None
    on_clock: Callable[[FloatArray], FloatArray] | None = None
    """Converts times of its recording to the clock of the first unit; None where both have one clock."""

    @property
    def shown_lanes(self) -> tuple[str, ...]:
        """Lanes that have segments."""
        return tuple(name for name, segments in self.lanes.items() if segments)

    def times(self, time: FloatArray) -> FloatArray:
        """Returns (n,) times of its recording on the clock of the first unit, s."""
        return time if self.on_clock is None else self.on_clock(time)

    def changes(self, lane: str) -> Iterator[tuple[float, ShownSegment | None]]:
        """Returns the changes in a lane that is shown, s of the first unit's clock; None where one ends."""
        segments = sorted(self.lanes[lane], key=lambda each: (each.start, each.end))
        starts = [*(each.start for each in segments[1:]), np.inf]
        for segment, following in zip(segments, starts, strict=True):
            start, end = self.times(np.array([segment.start, min(segment.end, following)])).tolist()
            yield start, segment
            if segment.end < following:
                yield end, None

    def samples(self) -> Iterator[tuple[Chunk, Chunk | None]]:
        """Passes over its samples: raw, and corrected where a calibration is given.

        The files of a recording of several follow one another, as they do where rests are found.
        """
        last = 0.0
        for number, part in enumerate(self.recording.parts or (self.recording,)):
            shift: float | None = None if number else 0.0
            for chunk in part.chunks():
                if not len(chunk):
                    continue
                if shift is None:
                    shift = last + BETWEEN_FILES - float(chunk.time[0])
                last = float(chunk.time[-1]) + shift
                yield self._corrected(_at(chunk, self.times(chunk.time + shift)))

    @property
    def shows_field(self) -> bool:
        """Returns whether it has a magnetometer; in a recording of several files none is shown."""
        return self.recording.has_magnetometer and not self.recording.parts

    @property
    def field_forms(self) -> tuple[Form, ...]:
        """Returns the forms in which its magnetometer is shown."""
        if not self.shows_field:
            return ()
        is_calibrated = self.calibration is not None and self.calibration.magnetometer is not None
        return ("raw", "calibrated") if is_calibrated else ("raw",)

    def fields(self) -> dict[Form, MagneticTrack]:
        """Returns the readings of its magnetometer, on the clock of the first unit; those of `field_forms`.

        Raises `LogError` where they cannot be read.
        """
        track = self.recording.magnetic if self.shows_field else None
        if track is None:
            return {}
        found: dict[Form, MagneticTrack] = {"raw": track}
        if "calibrated" in self.field_forms and self.calibration is not None:
            corrected = corrected_magnetometer(self.calibration, self.recording)
            found["calibrated"] = track if corrected is None else corrected
        return {form: replace(each, time=self.times(each.time)) for form, each in found.items()}

    def _corrected(self, chunk: Chunk) -> tuple[Chunk, Chunk | None]:
        if self.calibration is None:
            return chunk, None
        force, rate = self.calibration.correct(chunk.accelerometer, chunk.gyroscope, chunk.temperature)
        return chunk, Chunk(chunk.time, force, rate)


def _at(chunk: Chunk, time: FloatArray) -> Chunk:
    return Chunk(time, chunk.accelerometer, chunk.gyroscope, chunk.temperature)


@dataclass(frozen=True, slots=True)
class ViewerContent:
    """All that one file shows; times are those of the clock of the first unit."""

    title: str
    units: tuple[ShownUnit, ...]
    events: tuple[ShownEvent, ...] = ()


def counts_from_1970(time: float) -> bool:
    """Returns whether a stamp, s, is of a clock that counts from 1970."""
    return DATES[0] <= time <= DATES[1]


def segments_of(rests: Iterable[Rest]) -> tuple[ShownSegment, ...]:
    """Returns rests, numbered as residuals number them, and the turns between those that are used."""
    found: list[ShownSegment] = []
    number = 0
    for rest in sorted(rests, key=lambda each: each.start):
        number += rest.used
        pose = f": {rest.pose}" if rest.pose else ""
        label = f"{number}{pose}" if rest.used else ""
        state: SegmentState = "rest" if rest.used else "left out"
        found.append(
            ShownSegment(state, rest.start, rest.end, label, rest.remark, np.asarray(rest.specific_force))
        )
    used = [each for each in found if each.state == "rest"]
    turns = [
        ShownSegment("turn", before.end, after.start, f"{number}-{number + 1}")
        for number, (before, after) in enumerate(pairwise(used), start=1)
        if not any(before.end <= other.start < after.start for other in found if other.state == "left out")
    ]
    return tuple(sorted((*found, *turns), key=lambda each: (each.start, each.end)))


def parameters_of(calibration: Calibration) -> tuple[ShownParameter, ...]:
    """Returns the parameters that a calibration states."""
    return tuple(each for triad in CALIBRATED_TRIADS for each in _parameters_of(calibration, triad))


def _parameters_of(calibration: Calibration, triad: CalibratedTriad) -> Iterator[ShownParameter]:
    found, unit = getattr(calibration, triad), CALIBRATED_UNITS[triad]
    if found is None:
        return
    unknown = (np.nan,) * 3
    sigma = found.sigma
    yield from _axes(triad, "bias", unit, found.b, unknown if sigma is None else sigma.bias)
    if found.K is not None:
        yield from _axes(triad, "scale", "1", np.diag(found.K), unknown if sigma is None else sigma.scale)
    if found.angles is not None:
        yield from _axes(
            triad, "mounting", "deg", found.angles.mounting, unknown if sigma is None else sigma.mounting
        )
        skews = found.angles.non_orthogonality
        for pair in ("xy", "yz", "zx"):
            of_pair = None if sigma is None else getattr(sigma.non_orthogonality, pair)
            yield ShownParameter(
                triad, f"non-orthogonality {pair}", "deg", _number(getattr(skews, pair)), _number(of_pair)
            )
    for name, suffix in _NOISE.items():
        if (values := getattr(found, name)) is not None:
            yield from _axes(triad, name.replace("_", " "), unit + suffix, values, unknown)


_NOISE: Final = {"noise_density": "/sqrt(Hz)", "bias_instability": "", "random_walk": "/s/sqrt(Hz)"}
"""Terms of noise of a triad, with what stands behind its unit."""


def _axes(
    sensor: str, name: str, unit: str, values: Iterable[float], sigmas: Iterable[float]
) -> Iterator[ShownParameter]:
    for axis, value, sigma in zip("xyz", values, sigmas, strict=True):
        yield ShownParameter(sensor, f"{name} {axis}", unit, float(value), float(sigma))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def estimates_of(sensor: str, parameters: Iterable[Parameter]) -> tuple[ShownParameter, ...]:
    """Returns estimates that are in no calibration; NaN where the data do not show them."""
    return tuple(
        ShownParameter(
            sensor, each.name, each.unit, each.value if each.observable else float("nan"), each.sigma
        )
        for each in parameters
    )


def topic_names(units: Sequence[ShownUnit]) -> dict[str, str]:
    """Returns a name of each unit that topics of ROS and paths of Rerun may hold; each is another."""
    found: dict[str, str] = {}
    for unit in units:
        plain = re.sub(r"\W+", "_", unit.name, flags=re.ASCII).strip("_") or "unit"
        plain = plain if plain[0].isalpha() else f"unit_{plain}"
        others = [plain, *(f"{plain}_{number}" for number in range(2, len(units) + 1))]
        found[unit.name] = next(each for each in others if each not in found.values())
    return found


def verdict_event(time: float, unit: str, verdict: str, warnings: Iterable[str] = ()) -> list[ShownEvent]:
    """Returns a verdict, and the warnings that came with it, as events."""
    level: EventLevel = "info" if verdict in GOOD_VERDICTS else "warning"
    level = "error" if verdict in ("fail", "not calibrated") else level
    found = [ShownEvent(time, unit, level, f"verdict: {verdict}")] if verdict else []
    return [*found, *(ShownEvent(time, unit, "warning", text) for text in warnings)]
