"""The redundancy procedure on logs: samples of all units, replayed through the monitor of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.calibration.start import applied_first
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Recording, RecordingSource, SampleProgress, sources_of
from tumble.foundation.results import Precision
from tumble.logs import ReadOptions, SingleAxes, parse_spec
from tumble.logs.aiding import AidingSource, aiding_measurements_of, in_order, recorded_aiding
from tumble.procedures.redundancy.factory import Factory
from tumble.procedures.redundancy.logs import (
    SideBySide,
    UnitLog,
    channels_of_units,
    has_own_log,
    open_units,
    readings_of,
    serials_of,
)
from tumble.procedures.redundancy.monitor import COMMANDS, Command, RedundancyMonitor, SettingValues
from tumble.procedures.redundancy.replay import replay, selected_spans
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult
from tumble.procedures.redundancy.settings import RedundancySettings


def redundancy(
    primary: RecordingSource | SingleAxes,
    secondaries: RecordingSource | SingleAxes | Sequence[RecordingSource | SingleAxes],
    *,
    log: str | Path | None = None,
    settings: SettingValues | None = None,
    calibration: Calibration | str | Path | None = None,
    store: str | Path | None = None,
    factory: Factory = (),
    commands: Sequence[tuple[float, Command]] = (),
    aiding: AidingSource | Sequence[AidingSource] = (),
    aiding_sigma: float | None = None,
    precision: Precision = "f64",
    allow_missing: bool = False,
    as_published: bool = False,
    keep_output: bool = True,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    progress: SampleProgress | None = None,
) -> RedundancyResult:
    """Replays the logs of a redundant set, sample by sample, through the monitor.

    Units are names of IMUs in `log`, or `LOG:NAME` of logs stamped by one clock, or recordings, or
    `SingleAxes`, whose axes are in logs of their own. `settings` are a settings file or its content.
    `calibration` is the primary's own. `store` is a folder with the errors stored before, where what is
    adopted replaces them, and with the primary's own calibration, which it keeps for runs without one.
    `factory` are turntable calibrations of secondaries, by name or in files that state whose they are, which
    become the first errors in it. `commands` are given to the monitor at their times, s from the start.
    `aiding` are aiding measurements of the motion, as `Aiding` or a table of it, which decide where units
    cannot; by default, those received while `log`, a session, was recorded. `aiding_sigma`, m/s, is that of
    tables that state none. With `precision` `f32` it computes as a device would. With `allow_missing`, a unit
    that cannot be read is replayed as one without samples. With `as_published` settings begin from
    `RedundancySettings.as_published()`, and `settings` override them. `keep_output` keeps what the platform
    would have used, 72 bytes a sample. `read` holds the options of reading all logs, or each by what names
    its unit. `progress` receives samples done, and samples expected where known.

    Raises `TumbleError`, in one line, where settings or logs make no sense; `store` is then as it was.

    Method: docs/theory/redundancy.md.
    """
    _refuse_unknown_commands(commands)
    others = [secondaries] if isinstance(secondaries, SingleAxes) else sources_of(secondaries)
    units = open_units((primary, *others), log, read, allow_missing)
    names = tuple(unit.name for unit in units)
    if units[0].recording is not None:
        calibration = applied_first(calibration, units[0].recording.metadata)
    recorded = () if log is None else recorded_aiding(log)
    said = in_order(aiding_measurements_of(aiding, aiding_sigma) or recorded, names)
    monitor = RedundancyMonitor(
        names[0],
        names[1:],
        settings=settings,
        calibration=calibration,
        store=store,
        factory=factory,
        serials=serials_of(units),
        channels=channels_of_units(units),
        precision=precision,
        as_published=as_published,
    )
    blocks = SideBySide(units, monitor.time_offsets, progress)
    replayed = replay(monitor, blocks, commands, measurements=said, keep_output=keep_output)
    monitor.save()
    result = result_of(
        monitor,
        replayed.events,
        end=blocks.end + (blocks.last_silence if monitor.is_silent else 0.0),
        warnings=(*_warnings(units), *monitor.notices(), *blocks.notices()),
        preset="as published" if as_published else "",
    )
    return replace(
        result,
        start=blocks.start,
        window_time=replayed.window_time,
        traces=replayed.traces(),
        replay_rate=(blocks.end - blocks.start) / max(replayed.seconds, 1e-9),
        output=replayed.output() if keep_output else None,
        readings=readings_of(units),
    )


def result_of(
    monitor: RedundancyMonitor,
    events: Sequence[RedundancyEvent],
    *,
    end: float,
    warnings: tuple[str, ...] = (),
    preset: str = "",
) -> RedundancyResult:
    """Puts together what a monitor did and found by `end`, s: all but traces and output."""
    applied = monitor.applied
    return RedundancyResult(
        primary=monitor.units[0],
        secondaries=monitor.units[1:],
        start=monitor.start,
        end=end,
        settings=monitor.settings.by_name(),
        events=tuple(events),
        errors=monitor.records,
        window_time=np.empty(0),
        traces=(),
        selected=tuple(selected_spans(events, end)),
        replay_rate=np.nan,
        warnings=warnings,
        calibration_hash=applied.hash() if applied else "",
        software=f"tumble {_core.__version__}",
        serials=monitor.serials,
        defaults=RedundancySettings().by_name(),
        identities=monitor.identities,
        applied=applied.content() if applied else {},
        store=monitor.store,
        degraded=monitor.degraded,
        preset=preset,
    )


def _refuse_unknown_commands(commands: Sequence[tuple[float, str]]) -> None:
    for time, command in commands:
        if command not in COMMANDS or not np.isfinite(time):
            known = ", ".join(map(repr, COMMANDS))
            raise ProcedureError(f"command {command!r} at {time} s: known are {known}, at a time in s")


def _may_differ_in_clock(recordings: Sequence[Recording]) -> bool:
    """Returns whether there is no evidence, in stated clocks or a common file, that one clock stamped all."""
    clocks = {recording.metadata.clock for recording in recordings}
    if len(clocks) == 1 and clocks != {""}:
        return False
    stated = [each.metadata.source for each in recordings if has_own_log(each)]
    files = {parse_spec(source).path.resolve() for source in stated}
    return len(files) > 1 or len(stated) < len(recordings)


def _warnings(units: Sequence[UnitLog]) -> Iterator[str]:
    """Describes warnings on the logs, for the user."""
    for unit in units:
        if unit.recording is None:
            yield f"{unit.name}: is missing and replayed as a unit that sends nothing: {unit.missing}"
        else:
            metadata = unit.recording.metadata
            yield from (f"{unit.name}: {line}" for line in (*metadata.remarks, *metadata.assumptions))
    if _may_differ_in_clock([unit.recording for unit in units if unit.recording is not None]):
        yield (
            "the logs do not say whether one clock stamped them all; that is assumed; tumble align "
            "finds the offset between two"
        )
