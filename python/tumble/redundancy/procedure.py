"""The redundancy procedure on logs: what all units said, replayed through the monitor of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from pydantic import ValidationError

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.documents import mistake_in
from tumble.errors import CalibrationFileError, ProcedureError
from tumble.file_names import file_stem, unit_stem
from tumble.files import prepare_folder
from tumble.logs import ReadOptions, parse_spec
from tumble.recording import FloatArray, Recording, RecordingSource, SampleProgress, sources_of
from tumble.redundancy.factory import Factory, by_unit, factory_errors
from tumble.redundancy.logs import SideBySide, UnitLog, open_units
from tumble.redundancy.messages import explain, unfit_threshold
from tumble.redundancy.replay import COMMANDS, Command, replay
from tumble.redundancy.result import RECORDED, Identified, RedundancyEvent, RedundancyResult, SecondaryError
from tumble.redundancy.settings import RedundancySettings
from tumble.redundancy.store import ErrorStore, Rejected
from tumble.redundancy.units import CHANNELS, UnitSettings, identity_of
from tumble.redundancy.witness import WitnessSource, in_order, witnesses_of
from tumble.results import Precision

Settings: TypeAlias = RedundancySettings | Mapping[str, object] | str | Path


def redundancy(
    primary: RecordingSource,
    secondaries: RecordingSource | Sequence[RecordingSource],
    *,
    log: str | Path | None = None,
    settings: Settings | None = None,
    calibration: Calibration | str | Path | None = None,
    store: str | Path | None = None,
    factory: Factory = (),
    commands: Sequence[tuple[float, Command]] = (),
    witness: WitnessSource | Sequence[WitnessSource] = (),
    witness_sigma: float | None = None,
    precision: Precision = "f64",
    allow_missing: bool = False,
    as_published: bool = False,
    keep_output: bool = True,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    progress: SampleProgress | None = None,
) -> RedundancyResult:
    """Replay the logs of a redundant set, sample by sample, through the monitor.

    Units are names of IMUs in `log`, or `LOG:NAME` of logs stamped by one clock, or recordings.
    `settings` are a settings file or its content. `calibration` is the primary's own. `store` is a folder
    with the errors stored before, where what is adopted replaces them, and with the primary's own
    calibration, which it keeps for runs without one. `factory` are turntable calibrations of secondaries,
    by name or in files that state whose they are, which become the first errors in it. `commands` are
    given to the monitor at their times, s of the common clock. `witness` is what something else on board
    says of the motion, as `Witness` or a table of it, which settles what units cannot between them;
    `witness_sigma`, m/s, is that of tables that state none. With `precision` `f32` it computes as a
    device would. With `allow_missing`, a unit that cannot be read is replayed as one that never says
    anything. With `as_published` settings begin from `RedundancySettings.as_published()`, and `settings`
    override them. `keep_output` keeps what the platform would have used, 72 bytes a sample. `read` says
    how to read all logs, or each by what names its unit. `progress` is told samples done, and samples
    expected where known.

    Raises `TumbleError`, in one line, where settings or logs make no sense; `store` is then as it was.

    Method: docs/theory/redundancy.md.
    """
    chosen = settings_from(settings)
    if as_published:
        chosen = RedundancySettings.as_published().and_then(chosen)
    applied = Calibration.load(calibration) if isinstance(calibration, str | Path) else calibration
    _refuse_unknown_commands(commands)
    units = open_units((primary, *sources_of(secondaries)), log, read, allow_missing)
    names = tuple(unit.name for unit in units)
    said = in_order(witnesses_of(witness, witness_sigma), names)
    known = _known_units(chosen, units)
    serials = _serials(units, known)
    identities = identities_of(names, chosen, serials)
    errors = None if store is None else ErrorStore(prepare_folder(store), identities[0])
    given = applied
    if errors is not None and applied is None:
        applied = _stored_calibration(errors, identities[0])
    monitor = _monitor(identities, known, applied, chosen, precision)
    rejected = [] if errors is None else list(_restore(monitor, errors, identities[1:]))
    begun = _from_factory(factory, errors, monitor, dict(zip(identities, known, strict=True)), applied)
    blocks = SideBySide(units, [own.time_offset for own in known], progress)
    replayed = replay(monitor, blocks, commands, names, witnesses=said, keep_output=keep_output)
    events = (*_rejections(rejected, blocks.start), *replayed.events)
    found = tuple(_errors(monitor, identities))
    if errors is not None:
        if given is not None:
            _keep_calibration(errors, given)
        for unit, error in begun:
            errors.save(unit, error)
        keep_adopted(errors, found, identities)
    return RedundancyResult(
        primary=units[0].name,
        secondaries=tuple(unit.name for unit in units[1:]),
        start=blocks.start,
        end=blocks.end,
        settings=chosen.by_name(),
        events=events,
        errors=found,
        window_time=replayed.window_time,
        traces=replayed.traces(),
        selected=tuple(replayed.selected(blocks.end)),
        replay_rate=(blocks.end - blocks.start) / max(replayed.seconds, 1e-9),
        warnings=(
            *_warnings(units, applied, rejected),
            *(_from_store(errors) if errors is not None and given is not applied else ()),
            *(() if errors is None else (*_without_serial(identities), *errors.notices())),
            *blocks.notices(),
        ),
        calibration_hash=applied.hash() if applied else "",
        software=f"tumble {_core.__version__}",
        serials=serials,
        defaults=RedundancySettings().by_name(),
        identities=identities,
        applied=applied.content() if applied else {},
        store=None if store is None else Path(store),
        output=replayed.output() if keep_output else None,
        degraded=replayed.degraded,
        preset="as published" if as_published else "",
    )


def identities_of(
    names: Sequence[str], settings: RedundancySettings, serials: Mapping[str, str]
) -> tuple[Identified, ...]:
    """Give each unit the number that stored errors know it by.

    Raises `ProcedureError` where two have the same, or would be written to the same files.
    """
    found: dict[int, Identified] = {}
    stems: dict[str, str] = {}
    for name in names:
        if stems.setdefault(file_stem(name).casefold(), name) != name:
            twin = stems[file_stem(name).casefold()]
            raise ProcedureError(
                f"{name} and {twin}: would both be written to {unit_stem(name, 'redundancy')}.yaml; "
                "rename one of the logs"
            )
        unit = _identified(name, settings.units.get(name, UnitSettings()), serials)
        if unit.identity in found:
            raise ProcedureError(
                f"{name}: has the identity {unit.identity} of {found[unit.identity].name}; give each its "
                f"own, with --set units.{name}.identity=NUMBER"
            )
        found[unit.identity] = unit
    return tuple(found.values())


def _identified(name: str, unit: UnitSettings, serials: Mapping[str, str]) -> Identified:
    serial = serials.get(name, "")
    shared = list(serials.values()).count(serial) > 1
    return Identified(name, identity_of(name, unit, serial, shared=shared), serial, identity_of(name, unit))


def _serials(units: Sequence[UnitLog], known: Sequence[UnitSettings]) -> dict[str, str]:
    """Give the serial of each unit, empty where none is stated; raises `ProcedureError` where two are."""
    found: dict[str, str] = {}
    for unit, own in zip(units, known, strict=True):
        logged = unit.recording.metadata.serial if unit.recording is not None else ""
        if own.serial and logged and own.serial != logged:
            raise ProcedureError(
                f"units: {unit.name}: serial is {own.serial}, but its log states {logged}; leave it out, or "
                "give the log of that unit"
            )
        found[unit.name] = own.serial or logged
    return found


def _without_serial(identities: Sequence[Identified]) -> Iterator[str]:
    """Say which units a store knows by no more than their names."""
    names = [unit.name for unit in identities if not unit.serial]
    if names:
        yield (
            f"no serial number of {', '.join(names)} is known, so that the store cannot tell another unit of "
            f"the same name; --set units.{names[0]}.serial=TEXT states it"
        )


def keep_adopted(
    store: ErrorStore, errors: Sequence[SecondaryError], identities: Sequence[Identified]
) -> None:
    """Store what was adopted; what was loaded is there already."""
    by_name = {unit.name: unit for unit in identities}
    for error in errors:
        if error.adopted is not None:
            store.save(by_name[error.unit], error)


def settings_from(settings: Settings | None) -> RedundancySettings:
    """Read settings from a file, or from what a file would hold; raises `TumbleError` in one line."""
    if settings is None:
        return RedundancySettings()
    if isinstance(settings, RedundancySettings):
        return settings.with_rotations_read(Path())
    if isinstance(settings, str | Path):
        return RedundancySettings.load(settings)
    try:
        return RedundancySettings.model_validate(dict(settings)).with_rotations_read(Path())
    except ValidationError as error:
        raise ProcedureError(f"settings: {mistake_in(error, RedundancySettings)}") from error


def _refuse_unknown_commands(commands: Sequence[tuple[float, str]]) -> None:
    for time, command in commands:
        if command not in COMMANDS or not np.isfinite(time):
            known = ", ".join(map(repr, COMMANDS))
            raise ProcedureError(f"command {command!r} at {time} s: known are {known}, at a time in s")


def _known_units(settings: RedundancySettings, units: Sequence[UnitLog]) -> list[UnitSettings]:
    """Give what is known of each unit; raises `ProcedureError` where that is of no unit."""
    names = [unit.name for unit in units]
    for name in settings.units:
        if name not in names:
            raise ProcedureError(f"units: {name}: is none of {', '.join(names)}; use one of these names")
    known = [settings.units.get(name, UnitSettings()) for name in names]
    for stated in ("sensor_from_primary", "lever_arm"):
        if getattr(known[0], stated) is not None:
            raise ProcedureError(
                f"units: {names[0]}: is the primary, from which {stated} is counted; leave it out"
            )
    if set(known[0].axes) != set(CHANNELS):
        raise ProcedureError(f"units: {names[0]}: is the primary, which needs all of {' '.join(CHANNELS)}")
    return known


def _monitor(
    identities: Sequence[Identified],
    known: Sequence[UnitSettings],
    calibration: Calibration | None,
    settings: RedundancySettings,
    precision: Precision,
) -> _core.RedundancyMonitor:
    units = [
        _core.RedundancyUnit(unit.identity, **_arguments(own, calibration if index == 0 else None))
        for index, (unit, own) in enumerate(zip(identities, known, strict=True))
    ]
    by_name = settings.by_name()
    try:
        return _core.RedundancyMonitor(units, by_name, precision)
    except _core.CoreError as error:
        kind, figures = error.args
        if kind == "unfit threshold":
            raise ProcedureError(unfit_threshold(identities[figures["unit"]].name)) from error
        if kind != "contradictory settings":
            raise
        raise ProcedureError(f"settings: {explain(figures, by_name)}") from error


def _arguments(unit: UnitSettings, calibration: Calibration | None) -> dict[str, Any]:
    has = [channel in unit.axes for channel in CHANNELS]
    # Samples are handed over in the time of the common clock, so that the monitor has no offset to add.
    return {
        "sensor_from_primary": unit.sensor_from_primary,
        "lever_arm": unit.lever_arm,
        "axes": tuple(has),
        "specific_force_range": unit.specific_force_range,
        "angular_rate_range": unit.angular_rate_range,
        "accelerometer_threshold": unit.accelerometer_threshold,
        "gyroscope_threshold": unit.gyroscope_threshold,
        "calibration": None if calibration is None else _models(calibration),
    }


def _models(calibration: Calibration) -> dict[str, tuple[FloatArray, FloatArray, float]]:
    """Give M, b and what they left of each triad, root mean square of a channel."""
    triads = {"accelerometer": calibration.accelerometer, "gyroscope": calibration.gyroscope}
    return {name: (triad.M, triad.b, triad.residual) for name, triad in triads.items() if triad is not None}


def _stored_calibration(store: ErrorStore, primary: Identified) -> Calibration | None:
    """Read the primary's own calibration of an earlier run; raises `CalibrationFileError` if unfit."""
    path = store.primary_path
    if not path.exists():
        return None
    stored = Calibration.load(path)
    if stored.serial and primary.serial and stored.serial != primary.serial:
        raise CalibrationFileError(
            f"{path}: is of the unit with serial {stored.serial}, but the log is of {primary.name} with "
            f"serial {primary.serial}; give each set a --store of its own"
        )
    return stored


def _keep_calibration(store: ErrorStore, calibration: Calibration) -> None:
    """Store the primary's own calibration for later runs, unless it is there."""
    path = store.primary_path
    if not path.exists() or Calibration.load(path).hash() != calibration.hash():
        calibration.save(path)


def _from_store(store: ErrorStore) -> Iterator[str]:
    yield f"the primary's own calibration is that of the store, {store.primary_path}"


def _restore(
    monitor: _core.RedundancyMonitor, store: ErrorStore, secondaries: Sequence[Identified]
) -> Iterator[Rejected]:
    """Give the monitor what is stored; what neither store nor monitor takes is set aside by the next save."""
    for unit in secondaries:
        found, rejected = store.load(unit)
        factory_errors, more = store.load_factory(unit)
        yield from dict.fromkeys([*rejected, *more])
        for factory in factory_errors:
            monitor.restore_factory(_record(factory, unit.identity))
        for error in found:
            why = monitor.restore(_record(error, unit.identity))
            if why is not None:
                store.distrust(unit, error.sensor)


def _from_factory(
    factory: Factory,
    store: ErrorStore | None,
    monitor: _core.RedundancyMonitor,
    known: Mapping[Identified, UnitSettings],
    primary: Calibration | None,
) -> list[tuple[Identified, SecondaryError]]:
    """Give the monitor the errors from the factory that the store does not hold yet, and list them.

    Raises `TumbleError` where there is no store, it holds others, or they cannot be of the unit.
    """
    if not factory:
        return []
    if store is None:
        raise ProcedureError("--factory: needs --store, the folder that keeps the errors")
    secondaries = {unit.name: unit for unit in list(known)[1:]}
    begun = []
    calibrations = by_unit(factory, {name: unit.serial for name, unit in secondaries.items()})
    for name, calibration in calibrations.items():
        unit = secondaries[name]
        for error in factory_errors(name, calibration, known[unit], primary):
            if not store.lacks_factory(unit, error):
                continue
            why = monitor.restore(_record(error, unit.identity))
            if why is not None:
                raise ProcedureError(
                    f"--factory: {name}: its {error.sensor} is {why} for a unit mounted as stated; check "
                    "sensor_from_primary, the axes of the log and the largest_... settings"
                )
            begun.append((unit, error))
    return begun


def _record(error: SecondaryError, identity: int) -> dict[str, object]:
    return {"identity": identity} | {name: getattr(error, name) for name in RECORDED}


def _rejections(rejected: Sequence[Rejected], time: float) -> Iterator[RedundancyEvent]:
    """Tell what the store itself refused; what the monitor refused, it tells itself."""
    for each in rejected:
        figures = {"sensor": each.sensor, "reason": each.reason, "detail": each.detail}
        yield RedundancyEvent(time, each.unit, "record rejected", figures)


def _errors(monitor: _core.RedundancyMonitor, identities: Sequence[Identified]) -> Iterator[SecondaryError]:
    """Give what the monitor holds."""
    names = {unit.identity: unit.name for unit in identities}
    for record in monitor.records():
        fields: dict[str, Any] = dict(record)
        yield SecondaryError(unit=names[fields.pop("identity")], **fields)


def _may_differ_in_clock(recordings: Sequence[Recording]) -> bool:
    """Whether neither the clocks that logs state nor the file they share says that one clock stamped all."""
    clocks = {recording.metadata.clock for recording in recordings}
    if len(clocks) == 1 and clocks != {""}:
        return False
    stated = [each.metadata.source for each in recordings if not each.metadata.in_memory]
    files = {parse_spec(source).path.resolve() for source in stated}
    return len(files) > 1 or len(stated) < len(recordings)


def _warnings(
    units: Sequence[UnitLog], calibration: Calibration | None, rejected: Sequence[Rejected]
) -> Iterator[str]:
    """Say what a user should know of the logs, the calibration and the store."""
    for unit in units:
        if unit.recording is None:
            yield f"{unit.name}: is missing and replayed as a unit that sends nothing: {unit.missing}"
        else:
            yield from (f"{unit.name}: {notice}" for notice in unit.recording.metadata.remarks)
    if _may_differ_in_clock([unit.recording for unit in units if unit.recording is not None]):
        yield (
            "the logs do not say whether one clock stamped them all; that is assumed; tumble align "
            "finds the offset between two"
        )
    gyroscope = calibration.gyroscope if calibration is not None else None
    if gyroscope is not None and gyroscope.g_sensitivity is not None:
        yield "the g-sensitivity in the calibration of the primary is not used in the replay"
    for each in rejected:
        yield f"{each.unit}: stored error of the {each.sensor} was not loaded, {each.reason}: {each.detail}"
