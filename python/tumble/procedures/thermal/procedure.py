"""The thermal procedure: logs of a unit that warms and cools at rest become drifts of bias and scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import acquire, refuse_if_damaged, refuse_if_misread
from tumble.acquisition.duplicate_sensors import refuse_copies
from tumble.acquisition.imu import Imu, digest_of, log_name
from tumble.acquisition.joined import open_joined, progress_of_log
from tumble.acquisition.notices import correction_notice
from tumble.acquisition.standstills import standstills
from tumble.acquisition.thermometer import with_temperature
from tumble.calibration.document import Calibration
from tumble.calibration.start import started_from
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import RecordingSource, SampleProgress
from tumble.foundation.results import Parameter
from tumble.foundation.units import TRIADS, UNITS
from tumble.logs import ReadOptions
from tumble.procedures.thermal import messages
from tumble.procedures.thermal.result import (
    AxisDrift,
    OrderScore,
    ThermalBlocks,
    ThermalResult,
    estimated,
    unknown,
)


def thermal(
    sources: RecordingSource | Sequence[RecordingSource],
    *,
    fixture: bool = False,
    calibration: Calibration | str | Path | None = None,
    calibration_temperature: float | None = None,
    read: ReadOptions | None = None,
    progress: SampleProgress | None = None,
) -> ThermalResult:
    """Finds how bias and scale of a unit change with temperature, from logs of it at rest.

    Only the parts of logs at rest are used. Several logs are sessions of one unit, each with a turn-on bias
    of its own. The attitude of the unit need not be known: its readings in a pose at the reference
    temperature are estimated with the drift. Each rest is a pose of its own; with `fixture`, which states
    that a table or jig returned the unit to each orientation exactly, all rests of one orientation are one.

    `calibration` is the one that the drift is added to. The reference is then the temperature that it was
    made at, as it states itself, or `calibration_temperature`, degC; else it is the middle of the range.
    Memory does not grow with the length of logs. `progress` receives the samples done, and those expected
    where they are known.

    Raises `TumbleError`, in one line, where a log cannot be read, holds no temperature, or does not rest;
    where its temperature hardly changes; or where nobody knows at which temperature `calibration` holds.

    Method: docs/theory/thermal.md.
    """
    recordings = open_joined(sources, read)
    first = recordings[0]
    before = started_from(calibration, first.metadata)
    asked = _reference(before, calibration_temperature)
    recorder = _core.ThermalRecorder()
    units: list[Imu] = []
    for recording in recordings:
        unit = acquire(recording, progress=progress_of_log(progress, len(units), len(recordings)))
        _refuse_unfit(unit)
        units.append(unit)
        refuse_copies((each.name, each.digest) for each in units)
        recorder.begin_session()
        _read(unit, recorder, sum(each.acquired.samples for each in units), progress)
    channels = [
        3 * TRIADS.index(triad) + k for triad in TRIADS if triad in first.metadata.triads for k in range(3)
    ]
    try:
        found = recorder.conclude(channels, fixture=fixture, reference=asked)
    except _core.CoreError as error:
        name = ", ".join(recording.name for recording in recordings)
        raise ProcedureError(messages.explain(*error.args), about=name) from None
    blocks = ThermalBlocks(
        found["time"],
        found["session"],
        found["pose"],
        found["temperature"],
        found["leg"],
        found["still"],
        found["moved"],
    )
    axes = tuple(_axis(axis, found["reference"], found["range"]) for axis in found["axes"])
    return ThermalResult(
        name=first.name,
        sources=tuple(log_name(recording) for recording in recordings),
        serial=first.metadata.serial or (before.serial if before else ""),
        reference=found["reference"],
        range=found["range"],
        step=found["step"],
        lag=_lag(found["lag"]),
        axes=axes,
        blocks=blocks,
        logs=tuple(replace(unit.log, sha256=digest_of(unit.recording)) for unit in units),
        start_hash=before.hash() if before else "",
        start=before.content() if before else {},
        options={"fixture": fixture},
        warnings=(
            *_notices(units),
            *_about_the_start(asked, found["range"]),
            *messages.warnings_of(axes, blocks),
            *messages.ambiguous_lag(found["lag_or_hysteresis"]),
        ),
        software=f"tumble {_core.__version__}",
    )


def _reference(before: Calibration | None, stated: float | None) -> float | None:
    """Temperature at which M and b of a calibration hold, degC; None where there is none that matters."""
    if before is None or stated is not None:
        return None if before is None else stated
    found = set(_references(before))
    if len(found) > 1:
        raise ProcedureError(messages.several_temperatures(before.name, sorted(found)))
    return found.pop() if found else None


def _references(calibration: Calibration) -> Iterator[float]:
    """Returns the temperature of each triad that changes any reading; one that holds noise alone does not."""
    drifts = calibration.temperature_drifts()
    for name in TRIADS:
        triad = getattr(calibration, name)
        if name in drifts:
            yield drifts[name].reference
        elif triad is not None and not (np.array_equal(triad.M, np.eye(3)) and not triad.b.any()):
            if calibration.temperature is None:
                raise ProcedureError(messages.no_temperature_of_start(calibration.name))
            yield calibration.temperature.mean


def _refuse_unfit(unit: Imu) -> None:
    """Raises `ProcedureError`, in one line, where a log is damaged or without temperature, or never rests."""
    if fault := unit.recording.metadata.temperature_fault:
        raise ProcedureError(fault, about=unit.name)
    if unit.acquired.temperature is None:
        raise ProcedureError(messages.NO_TEMPERATURE, about=unit.name)
    for jump in unit.thermometer:
        if jump.stays:
            raise ProcedureError(f"{jump.line(unit.log.time)}; cut the log there", about=unit.name)
    refuse_if_damaged(unit.name, unit, unit.faults)
    # The segmenter rejects a drifting rest as a slow turn, so that rejected rests are evidence of rest.
    if not len(unit.acquired.rest_times) and not unit.acquired.rejected_rests:
        figures = {"still": 0.0, "moved": unit.log.duration or 0.0}
        raise ProcedureError(messages.explain("too little at rest", figures), about=unit.name)
    if "accelerometer" in unit.triads:
        refuse_if_misread(unit.name, unit.acquired, STANDARD_GRAVITY)


def _read(unit: Imu, recorder: _core.ThermalRecorder, samples: int, progress: SampleProgress | None) -> None:
    """Passes a log to the core, where it has a temperature; a triad that was not recorded is zero."""
    triads = unit.triads
    for part in unit.recording.parts or (unit.recording,):
        for logged in part.chunks():
            chunk = with_temperature(standstills(logged, triads).moving(logged), unit.thermometer)
            if chunk.temperature is None:
                continue
            nothing = np.zeros((len(chunk), 3))
            recorder.push(
                chunk.time,
                chunk.accelerometer if "accelerometer" in triads else nothing,
                chunk.gyroscope if "gyroscope" in triads else nothing,
                chunk.temperature,
            )
            if progress is not None:
                progress(samples, None)


def _notices(units: Sequence[Imu]) -> Iterator[str]:
    for unit in units:
        whose = f"{unit.name}: " if len(units) > 1 else ""
        metadata = unit.recording.metadata
        corrected = correction_notice(metadata, "what is found holds")
        for line in (*metadata.remarks, *metadata.assumptions, *unit.notices, *corrected):
            yield f"{whose}{line}"


def _about_the_start(asked: float | None, found: tuple[float, float]) -> Iterator[str]:
    if asked is not None and not found[0] <= asked <= found[1]:
        yield messages.start_out_of_range(asked, *found)


def _lag(found: tuple[float, float] | None) -> Parameter:
    return unknown("lag", "s", messages.NO_LAG) if found is None else estimated("lag", "s", *found)


def _of_loop(name: str, unit: str, found: tuple[float, float] | None) -> Parameter:
    return unknown(name, unit, messages.ONE_LEG) if found is None else estimated(name, unit, *found)


def _axis(found: _core.AxisDriftFigures, reference: float, span: tuple[float, float]) -> AxisDrift:
    triad = TRIADS[found["channel"] // 3]
    unit = UNITS[triad]
    hysteresis, scale = found["hysteresis"], found["scale_change"]
    no_scale = messages.AT_REST if triad == "gyroscope" else messages.ONE_POSE
    return AxisDrift(
        name=f"{triad} {'xyz'[found['channel'] % 3]}",
        triad=triad,
        reference=reference,
        range=span,
        bias=found["bias"],
        scale=found["scale"],
        covariance=found["covariance"],
        hysteresis=_of_loop("hysteresis", unit, None if hysteresis is None else hysteresis["largest"]),
        mean_hysteresis=_of_loop("mean hysteresis", unit, None if hysteresis is None else hysteresis["mean"]),
        loop=np.zeros((0, 3)) if hysteresis is None else hysteresis["knots"] + [reference, 0.0, 0.0],
        has_hysteresis=hysteresis is not None and hysteresis["is_clear"],
        slope=estimated("bias per K", f"{unit}/K", *found["slope"]),
        scale_change=unknown("scale per K", "1/K", no_scale)
        if scale is None
        else estimated("scale per K", "1/K", *scale),
        constants=found["constants"],
        noise_density=found["noise_density"],
        bias_instability=found["bias_instability"],
        random_walk=found["random_walk"],
        scores=tuple(
            OrderScore(bias, power, weight, place == found["chosen"])
            for place, (bias, power, weight) in enumerate(found["scores"])
        ),
        change=found["change"],
    )
