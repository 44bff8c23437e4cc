"""The noise procedure: logs of a sensor that stands still become deviations and the terms they show."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import acquire, refuse_if_damaged, scale_notice
from tumble.acquisition.coarseness import coarse_channels
from tumble.acquisition.duplicate_sensors import refuse_copies
from tumble.acquisition.imu import Imu, digest_of, log_name
from tumble.acquisition.joined import open_joined, progress_of_log
from tumble.acquisition.messages import REST_REJECTIONS
from tumble.calibration.document import Calibration
from tumble.calibration.start import started_from
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.noise_terms import SLOW, TERM_UNITS
from tumble.foundation.recording import FloatArray, Recording, RecordingSource, SampleProgress
from tumble.foundation.results import INTERVAL, Parameter
from tumble.foundation.units import UNITS, Triad
from tumble.logs import ReadOptions
from tumble.procedures.noise import messages
from tumble.procedures.noise.course import LevelDrift, NoiseChange
from tumble.procedures.noise.result import ChannelNoise, DeviationCurve, Disturbance, NoiseResult, StillPart
from tumble.procedures.noise.samples import StillSamples, without
from tumble.procedures.noise.stillness import Stillness, stillness

LARGEST_ROUNDING = 1.5
"""Steps of the readings by which rounding changes a level at most, with room for inexact multiples."""
LARGEST_RATE_DIFFERENCE = 0.02
"""Share by which the rates of logs that are joined may differ."""


class _ReadOut(NamedTuple):
    """Noise that logs showed where they were read at rest."""

    figures: list[_core.NoiseFigures]
    still: StillPart
    changes: list[NoiseChange]
    drifts: list[LevelDrift]
    clipped: list[int]
    """Numbers of the channels whose noise the end of their range cuts off."""


def noise(
    sources: RecordingSource | Sequence[RecordingSource],
    *,
    calibration: Calibration | str | Path | None = None,
    read: ReadOptions | None = None,
    progress: SampleProgress | None = None,
) -> NoiseResult:
    """Finds the noise of a sensor from one log or several in which it stands still.

    Only the parts of logs at rest are used; gaps divide them into stretches, and no difference spans a gap.
    Steps, ramps and knocks are found, named and left out.

    Several logs are records of one sensor. Memory does not grow with their length. `calibration` is the one
    that the noise is added to. `progress` receives the samples done, and those expected where they are known.

    Raises `TumbleError`, in one line, where a log cannot be read, does not stand still, or is of another rate
    than the first.

    Method: docs/theory/noise.md.
    """
    recordings = open_joined(sources, read)
    first = recordings[0]
    before = started_from(calibration, first.metadata)
    units: list[Imu] = []
    for recording in recordings:
        unit = acquire(recording, progress=progress_of_log(progress, len(units), len(recordings)))
        _refuse_unless_still(unit)
        _refuse_other_rate(units[0] if units else unit, unit)
        units.append(unit)
        refuse_copies((each.name, each.digest) for each in units)
    still = [stillness(unit.recording, np.array(unit.acquired.rest_times)) for unit in units]
    read_out, disturbances = _without_disturbances(recordings, still, progress)
    channels, remarks = _channels(read_out, units, still)
    return NoiseResult(
        name=first.name,
        sources=tuple(log_name(recording) for recording in recordings),
        serial=first.metadata.serial or (before.serial if before else ""),
        still=read_out.still,
        channels=channels,
        disturbances=disturbances,
        temperature=_temperature(units),
        logs=tuple(replace(unit.log, sha256=digest_of(unit.recording)) for unit in units),
        start_hash=before.hash() if before else "",
        start=before.content() if before else {},
        warnings=(
            *_notices(units),
            *messages.disturbances(disturbances, {unit.name: unit.log.time for unit in units}),
            *messages.warnings_of(read_out.still, channels),
            *remarks,
        ),
        software=f"tumble {_core.__version__}",
    )


def _channels(
    read_out: _ReadOut, units: Sequence[Imu], still: Sequence[Stillness]
) -> tuple[tuple[ChannelNoise, ...], list[str]]:
    """Returns the noise of all channels as far as the logs show it, and remarks on what hides the rest."""
    triads = units[0].recording.metadata.triads
    names = [f"{triad} {axis}" for triad in triads for axis in "xyz"]
    sways = np.any([each.sways for each in still], axis=0)
    coarse = [each.channel for unit in units for each in coarse_channels(unit.acquired, triads)]
    why = dict.fromkeys((names[number] for number in read_out.clipped), messages.CLIPPED)
    why |= dict.fromkeys(coarse, messages.ROUNDED)
    changing = {each.channel for each in read_out.changes}
    # White noise that changes makes means scatter more, too, and is named.
    drifts = {each.channel: each for each in read_out.drifts if each.channel not in changing}
    channels = tuple(
        unshown(channel, why[channel.name]) if channel.name in why else _bounded(channel, drifts.get(number))
        for number, channel in enumerate(channels_of(triads, read_out.figures))
    )
    remarks = [
        *messages.changing(read_out.changes, triads),
        *messages.level_drifts(list(drifts.values()), triads),
        *messages.swaying([names[number] for number in np.flatnonzero(sways)]),
    ]
    return channels, remarks


def _without_disturbances(
    recordings: Sequence[Recording], still: Sequence[Stillness], progress: SampleProgress | None
) -> tuple[_ReadOut, tuple[Disturbance, ...]]:
    """Reads logs where they stood still; again without what disturbs them, where anything does."""
    rests = [each.rests for each in still]
    triads = recordings[0].metadata.triads
    watch = _core.NoiseWatch(3 * len(triads))
    read_out = _read(recordings, rests, progress, watch)
    # A change by a step of the readings is rounding.
    coarse = np.max([each.steps for each in still], axis=0)
    disturbances = tuple(
        each
        for each, step in _disturbances(watch, triads, coarse)
        if abs(each.size) > LARGEST_ROUNDING * step
    )
    disturbed = [
        [(each.start, each.end) for each in disturbances if each.log == log and each.left_out]
        for log in range(len(recordings))
    ]
    parted = [without(rest, times) for rest, times in zip(rests, disturbed, strict=True)]
    if all(map(np.array_equal, parted, rests)):
        return read_out, disturbances
    return _read(recordings, parted, progress), disturbances


def _read(
    recordings: Sequence[Recording],
    rests: Sequence[FloatArray],
    progress: SampleProgress | None,
    watch: _core.NoiseWatch | None = None,
) -> _ReadOut:
    still = StillSamples(recordings[0].metadata.triads, watch)
    for recording, times in zip(recordings, rests, strict=True):
        still.read(recording, times, progress)
    return _ReadOut(
        *still.finish(), still.course.changes(), still.course.drifts(), still.range_ends.reached()
    )


def _disturbances(
    watch: _core.NoiseWatch, triads: Sequence[Triad], steps: FloatArray
) -> list[tuple[Disturbance, float]]:
    """Lists disturbances, each with the step of the readings of its channel."""
    found = [
        (
            Disturbance(
                channel=f"{triads[place // 3]} {'xyz'[place % 3]}",
                unit=UNITS[triads[place // 3]],
                kind=each["kind"],
                log=each["log"],
                start=each["time"][0],
                end=each["time"][1],
                size=each["size"],
                sigma=each["sigma"],
                left_out=not more,
            ),
            float(steps[place]),
        )
        for place, (of_channel, more) in enumerate(watch.conclude())
        for each in of_channel
    ]
    return sorted(found, key=lambda each: (each[0].log, each[0].start))


def _refuse_unless_still(unit: Imu) -> None:
    """Raises `ProcedureError`, in one line, where a log has no part that stands still."""
    refuse_if_damaged(unit.name, unit, unit.faults)
    if len(unit.acquired.rest_times):
        return
    why = ", ".join(
        f"{unit.log.time.span(start, end)} s {REST_REJECTIONS[reason]}"
        for start, end, reason in unit.acquired.rejected_rests[:3]
    )
    raise ProcedureError(
        f"{unit.name}: never stands still for a second{': ' if why else ''}{why}; "
        "let the unit lie untouched, away from motors and draughts, and record again"
    )


def _refuse_other_rate(first: Imu, unit: Imu) -> None:
    rates = [each.acquired.samples / each.log.duration for each in (first, unit) if each.log.duration]
    if len(rates) == 2 and abs(math.log(rates[1] / rates[0])) > LARGEST_RATE_DIFFERENCE:
        raise ProcedureError(
            f"{unit.name}: has {rates[1]:.4g} samples a second, {first.name} {rates[0]:.4g}; "
            "join logs of one rate only"
        )


def _temperature(units: Sequence[Imu]) -> tuple[float, float, float] | None:
    known = [unit.acquired.temperature for unit in units if unit.acquired.temperature is not None]
    if not known:
        return None
    low, mean, high = zip(*known, strict=True)
    return min(low), float(np.mean(mean)), max(high)


def _notices(units: Sequence[Imu]) -> Iterator[str]:
    for unit in units:
        whose = f"{unit.name}: " if len(units) > 1 else ""
        for line in (
            *unit.recording.metadata.remarks,
            *unit.recording.metadata.assumptions,
            *unit.notices,
            *(scale_notice(unit.acquired, STANDARD_GRAVITY) if "accelerometer" in unit.triads else ()),
        ):
            yield f"{whose}{line}"
        refused = unit.acquired.rejected_rests
        if refused:
            begin, end, reason = max(refused, key=lambda each: each[1] - each[0])
            more = f", and {len(refused) - 1} more" if len(refused) > 1 else ""
            yield f"{whose}not used: {unit.log.time.span(begin, end)} s {REST_REJECTIONS[reason]}{more}"


def channels_of(triads: Sequence[Triad], found: Sequence[_core.NoiseFigures]) -> tuple[ChannelNoise, ...]:
    """Returns the noise of each channel of these triads, as the core found it."""
    return tuple(
        _channel(f"{triad} {axis}", triad, found[3 * number + k])
        for number, triad in enumerate(triads)
        for k, axis in enumerate("xyz")
    )


def _channel(name: str, triad: Triad, found: _core.NoiseFigures) -> ChannelNoise:
    fit = found["fit"]
    curves = _curve(found["allan"]), _curve(found["modified"]), _curve(found["hadamard"])
    units = TERM_UNITS[triad]
    if fit is None:
        why = messages.TOO_SHORT if np.all(curves[0].deviation > 0.0) else messages.ROUNDED
        unknown = np.full(len(units), math.nan)
        return ChannelNoise(name, triad, *curves, _unknown(triad, why), unknown, math.nan)
    return ChannelNoise(
        name,
        triad,
        *curves,
        terms=tuple(_term(term, units[term["term"]]) for term in fit["terms"]),
        model=fit["coefficients"],
        chi_square=fit["chi_square"],
        degrees_of_freedom=fit["degrees_of_freedom"],
        misfit=fit["misfit"],
        filter=fit["filter"],
    )


def _bounded(channel: ChannelNoise, drift: LevelDrift | None) -> ChannelNoise:
    """Returns a channel with its slow terms as bounds where its level drifts in a part of the log."""
    if drift is None:
        return channel
    return replace(
        channel,
        terms=tuple(
            replace(
                term,
                value=math.nan,
                sigma=math.inf,
                low=0.0,
                observable=False,
                reason=messages.drifting(term.high, term.unit),
            )
            if term.observable and term.name in SLOW
            else term
            for term in channel.terms
        ),
    )


def unshown(channel: ChannelNoise, why: str) -> ChannelNoise:
    """Returns a channel whose noise its readings do not show, as they repeat until it has gone a step."""
    return replace(
        channel,
        terms=_unknown(channel.triad, why),
        model=np.full(len(channel.model), math.nan),
        chi_square=math.nan,
        degrees_of_freedom=0,
        misfit=0.0,
        filter=0.0,
        is_rounded=True,
    )


def _unknown(triad: Triad, why: str) -> tuple[Parameter, ...]:
    nan, inf = math.nan, math.inf
    units = TERM_UNITS[triad].items()
    return tuple(Parameter(word, unit, nan, inf, nan, nan, False, why) for word, unit in units)


def _curve(found: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> DeviationCurve:
    return DeviationCurve(*found.T.copy())


def _term(found: _core.NoiseTermFigures, unit: str) -> Parameter:
    low, high = found["low"], found["high"]
    if found["identifiable"]:
        return Parameter(found["term"], unit, found["value"], 0.5 * (high - low) / INTERVAL, low, high)
    reason = messages.not_identifiable(high, unit, found["needed"])
    return Parameter(found["term"], unit, math.nan, math.inf, 0.0, high, False, reason)
