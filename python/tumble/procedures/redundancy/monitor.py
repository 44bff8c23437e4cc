"""The redundancy monitor as a program drives it: logs are replayed through it, and it runs live."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.calibration.start import calibration_of
from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.foundation.file_names import file_stem, unit_stem
from tumble.foundation.file_status import exists
from tumble.foundation.files import prepare_folder
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.results import Precision
from tumble.foundation.serials import are_of_two
from tumble.foundation.units import CHANNELS, Channel
from tumble.logs.aiding import Aiding, NativeAiding, in_order, order
from tumble.procedures.redundancy.factory import Factory, by_unit, factory_errors
from tumble.procedures.redundancy.known_faults import NO_SAMPLES
from tumble.procedures.redundancy.messages import explain, unfit_threshold
from tumble.procedures.redundancy.result import (
    NONE_FIT,
    RECORDED,
    Figure,
    Identified,
    RedundancyEvent,
    SecondaryError,
    SetOutput,
)
from tumble.procedures.redundancy.settings import RedundancySettings
from tumble.procedures.redundancy.store import ErrorStore, Rejected
from tumble.procedures.redundancy.units import UnitSettings, identity_of, with_axes

SettingValues: TypeAlias = RedundancySettings | Mapping[str, object] | str | Path
Command: TypeAlias = Literal["evaluate", "return to primary"]
COMMANDS: tuple[Command, ...] = ("evaluate", "return to primary")
SampleArrays: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""Time (n,) s of the common clock, specific force (n, 3) m/s^2, angular rate (n, 3) rad/s."""

MOST_SECONDARIES = 7
ALL_WITHIN = 1.0
"""s after the first sample in which the others are awaited: the first unit is not the source for that."""
SILENCE = 1.0
"""s without a sample of any unit after which the set is silent: longer ones are no pause to its clock."""
_OUTPUT = ("time", "unit", "specific_force", "angular_rate", "flags")


class RedundancyMonitor:
    """A primary and one to seven secondaries, watched while their samples come.

    >>> import numpy as np
    >>> from tumble import Chunk, RedundancyMonitor
    >>> monitor = RedundancyMonitor("front", ["rear"])
    >>> time = np.arange(400) / 100
    >>> noise = np.random.default_rng(1).normal(0.0, 0.01, (2, 400, 6))
    >>> force, rate = noise[:, :, :3] + (0.0, 0.0, 9.80665), 0.1 * noise[:, :, 3:]
    >>> for at in range(400):
    ...     one = slice(at, at + 1)
    ...     for number, unit in enumerate(monitor.units):
    ...         for event in monitor.push(unit, Chunk(time[one], force[number, one], rate[number, one])):
    ...             if event.event != "evaluated":
    ...                 print(f"{event.time:.1f} s {event.unit}: {event.event}")
    0.0 s front: selected
    0.6 s front: rest began
    >>> monitor.source, len(monitor.output), monitor.records
    ('front', 0, ())

    Names distinguish the units. Samples of different units come in any order, as long as none is
    more than a window behind the others; those of one unit in order of time, s of the units' common clock.

    `settings` are a settings file or its content; with `as_published` they begin from those of the
    literature. `calibration` is the primary's own. `store` is a folder of errors stored before, which
    `save` adds to, and which keeps the primary's calibration for runs without one. `factory` are turntable
    calibrations of secondaries, which become the first errors in it. `serials` are serial numbers, by name;
    `channels` those that units have, by name, all of them where a unit is not named.
    With `precision` `f32` it computes as a device would.

    Raises `TumbleError`, in one line, where settings, units or store make no sense.

    Method: docs/theory/redundancy.md.
    """

    def __init__(
        self,
        primary: str,
        secondaries: Sequence[str],
        *,
        settings: SettingValues | None = None,
        calibration: Calibration | str | Path | None = None,
        store: str | Path | None = None,
        factory: Factory = (),
        serials: Mapping[str, str] | None = None,
        channels: Mapping[str, Sequence[Channel]] | None = None,
        precision: Precision = "f64",
        as_published: bool = False,
    ) -> None:
        refuse_other_counts(len(secondaries))
        self.units: tuple[str, ...] = (primary, *secondaries)
        """Names, primary first."""
        self.settings = settings_from(settings)
        if as_published:
            self.settings = RedundancySettings.as_published().and_then(self.settings)
        self._known = _known_units(self.settings, self.units, channels or {})
        self.serials = _serials(dict(zip(self.units, self._known, strict=True)), serials or {})
        """Serial numbers by name, empty where none is known."""
        self.identities = identities_of(self.units, self.settings, self.serials)
        """Identities by which stored errors know the units, primary first."""
        self._given = calibration_of(calibration, self.identities[0].serial, about=primary)
        self._store = None if store is None else ErrorStore(prepare_folder(store), self.identities[0])
        self.applied = self._given or self._stored_calibration()
        """The primary's own calibration."""
        self._drifting = [primary] if self.applied is not None and self.applied.temperature_drifts() else []
        """Units whose calibration knows a temperature drift, which the replay does not use."""
        self._core = _core_monitor(self.identities, self._known, self.applied, self.settings, precision)
        self._rejected = [] if self._store is None else list(self._restore(self._store))
        self._begun = self._from_factory(factory)
        self._stored: dict[tuple[str, str], float] = {}
        """When what was saved of a sensor was adopted, s."""
        self._measurements: list[NativeAiding] = []
        self.heard: Sequence[NativeAiding] = ()
        """Aiding measurements that counted from the samples of the last `push` on."""
        self._commands: list[Command] = []
        self._output = _output_of(self.units, None)
        self.is_silent = False
        """Indicates whether `tick` reported a lasting silence."""
        self.source = ""
        """Name of the unit that the output comes from; empty where there is none."""
        self.start, self.newest = math.inf, -math.inf
        """s of the common clock: the first and the latest time that was pushed."""
        self.said, self.degraded_samples = 0, 0
        """Samples of the output so far, and those whose source was known to be wrong, or contradicted."""

    def push(
        self, unit: str, samples: Chunk | tuple[ArrayLike, ArrayLike, ArrayLike]
    ) -> tuple[RedundancyEvent, ...]:
        """Adds successive samples of a unit, and returns the events; `output` is then their output.

        A temperature in the chunk, degC, bounds the drift of its biases since the calibration.
        `samples` are a chunk, or time (n,) s, specific force (n, 3) m/s^2 and angular rate (n, 3) rad/s of
        the unit's own clock and axes, to which `time_offset` and mounting of its settings apply.

        Raises `ProcedureError` where there is no such unit, `ArrayError` for what are no samples.
        """
        if unit not in self.units:
            raise ProcedureError(f"{unit}: is none of {', '.join(self.units)}; use one of these names")
        number = self.units.index(unit)
        chunk = samples if isinstance(samples, Chunk) else Chunk(*samples)  # type: ignore[arg-type]
        if not len(chunk):
            self._output = _output_of(self.units, None)
            return ()
        offset = self._known[number].time_offset
        time = chunk.time + offset if offset else chunk.time
        latest = float(time.max())
        self.heard = self._due(latest)
        commands = [(-math.inf, command) for command in self._commands]
        self._commands = []
        before = self._rejections(float(time[0]))
        said = self._core.push(
            number,
            np.ascontiguousarray(time),
            np.ascontiguousarray(chunk.accelerometer),
            np.ascontiguousarray(chunk.gyroscope),
            commands,
            self.heard,
            None if chunk.temperature is None else np.ascontiguousarray(chunk.temperature),
        )
        self._note(float(time.min()), latest, said)
        self._output = _output_of(self.units, said)
        return (*before, *self._events(said))

    def replay(
        self,
        block: Sequence[SampleArrays],
        commands: Sequence[tuple[float, Command]] = (),
        measurements: Sequence[NativeAiding] = (),
        *,
        arrivals: Sequence[FloatArray] | None = None,
        temperatures: Sequence[FloatArray | None] | None = None,
        keep_output: bool = False,
    ) -> tuple[tuple[RedundancyEvent, ...], _core.RedundancyReplay]:
        """Adds samples of all units, primary first, in order of time, or of `arrivals`.

        `temperatures` are those of the samples, degC, None of a unit where nobody knows.
        Gives what happened, and all else. Times are of the common clock, offsets added; see `push` for the
        rest, `_core.RedundancyMonitor.replay` for commands and measurements.
        """
        begun = [place for place, (time, _, _) in enumerate(block) if len(time)]
        if begun:
            keys = arrivals or [time for time, _, _ in block]
            first = min(begun, key=lambda place: float(keys[place][0]))
            before = self._rejections(float(block[first][0][0]))
        else:
            before = ()
        times, forces, rates = zip(*block, strict=True)
        said = self._core.replay(
            times,
            forces,
            rates,
            commands,
            measurements,
            keep_output,
            arrivals=arrivals,
            temperatures=temperatures,
        )
        for place in begun:
            self._note(float(times[place].min()), float(times[place].max()))
        self._count(said)
        return (*before, *self._events(said)), said

    def tick(self, time: float) -> tuple[RedundancyEvent, ...]:
        """Reports the time, s of the common clock, though no samples may have come.

        Where no unit has for `SILENCE`, there is an event `no samples`, once for each silence, of the time
        at which it had lasted so long.
        """
        if self.is_silent or not math.isfinite(self.newest) or time - self.newest <= SILENCE:
            return ()
        self.is_silent = True
        figures = {"since": self.newest}
        return (RedundancyEvent(self.newest + SILENCE, self.units[0], NO_SAMPLES, figures),)

    def aiding(self, aiding: Aiding) -> None:
        """Adds aiding measurements of the motion, which count once samples of their times come.

        It has to come within a second of its time.

        Raises `ProcedureError` where a score is of no unit of the set.
        """
        self._measurements = sorted([*self._measurements, *in_order([aiding], self.units)], key=order)

    def command(self, command: Command) -> None:
        """Returns a command with the next sample: `evaluate`, or `return to primary`."""
        if command not in COMMANDS:
            raise ProcedureError(f"command {command!r}: known are {', '.join(map(repr, COMMANDS))}")
        self._commands.append(command)

    @property
    def store(self) -> Path | None:
        """Folder of stored errors."""
        return None if self._store is None else self._store.folder

    @property
    def time_offsets(self) -> tuple[float, ...]:
        """Offsets that `push` adds to the time of each unit, s, primary first."""
        return tuple(own.time_offset for own in self._known)

    @property
    def output(self) -> SetOutput:
        """Output for the samples of the last `push`: empty where its unit was not the source."""
        return self._output

    @property
    def degraded(self) -> float:
        """Share of the output whose source was known to be wrong, or contradicted."""
        return self.degraded_samples / max(self.said, 1)

    @property
    def records(self) -> tuple[SecondaryError, ...]:
        """Errors of all sensors of secondaries that are stored now; none for a sensor never calibrated."""
        names = {unit.identity: unit.name for unit in self.identities}
        return tuple(_secondary_error(names, record) for record in self._core.records())

    def save(self) -> None:
        """Writes what is not in the store yet: errors adopted, those from the factory, the calibration.

        Every file takes its name only once it is whole; without a store nothing is done.

        Raises `OutputError` where the folder cannot be written to.
        """
        if self._store is None:
            return
        if self._given is not None:
            _keep_calibration(self._store, self._given)
        while self._begun:
            self._store.save(*self._begun.pop(0))
        by_name = {unit.name: unit for unit in self.identities}
        for error in self.records:
            if error.adopted is None or self._stored.get((error.unit, error.sensor)) == error.adopted:
                continue
            self._store.save(by_name[error.unit], error)
            self._stored[error.unit, error.sensor] = error.adopted

    def notices(self) -> Iterator[str]:
        """Describes notices on the calibration and the store, for the user."""
        gyroscope = self.applied.gyroscope if self.applied is not None else None
        if gyroscope is not None and gyroscope.g_sensitivity is not None:
            yield "the g-sensitivity in the calibration of the primary is not used in the replay"
        for name in self._drifting:
            yield (
                f"the temperature drift in the calibration of {name} is not used in the replay: biases and "
                "scales are those at its reference temperature"
            )
        for each in self._rejected:
            what = f"{each.unit}: stored error of the {each.sensor}"
            yield f"{what} was not loaded, {each.reason}: {each.detail}"
        if self._store is None:
            return
        if self._given is not self.applied:
            yield f"the primary's own calibration is that of the store, {self._store.primary_path}"
        yield from _without_serial(self.identities)
        yield from self._store.notices()

    def _due(self, latest: float) -> Sequence[NativeAiding]:
        """Removes and returns aiding measurements up to the latest time."""
        count = bisect_right(self._measurements, latest, key=_time_of) if self._measurements else 0
        due = self._measurements[:count]
        if count:
            self._measurements = self._measurements[count:]
        return due

    def _note(self, first: float, latest: float, said: _core.RedundancySaid | None = None) -> None:
        self.start, self.newest = min(self.start, first), max(self.newest, latest)
        self.is_silent = False
        if said is not None:
            self._count(said)

    def _count(self, said: _core.RedundancySaid) -> None:
        self.said += said["said"]
        self.degraded_samples += said["degraded"]

    def _events(self, said: _core.RedundancySaid) -> Iterator[RedundancyEvent]:
        for time, unit, event, figures in said["events"]:
            if event == "selected":
                self.source = "" if figures["reason"] == NONE_FIT else self.units[unit]
            yield RedundancyEvent(time, self.units[unit], event, self._named(figures))

    def _named(self, figures: Mapping[str, float | int | str | bool | list[int]]) -> dict[str, Figure]:
        """Puts names in the place of the numbers of units."""
        return {
            name: tuple(self.units[unit] for unit in figure) if isinstance(figure, list) else figure
            for name, figure in figures.items()
        }

    def _rejections(self, time: float) -> tuple[RedundancyEvent, ...]:
        """Reports records that the store rejected, with the first sample; the core reports its own."""
        if math.isfinite(self.start):
            return ()
        return tuple(
            RedundancyEvent(
                time,
                each.unit,
                "record rejected",
                {"sensor": each.sensor, "reason": each.reason, "detail": each.detail},
            )
            for each in self._rejected
        )

    def _stored_calibration(self) -> Calibration | None:
        """Reads the primary's own calibration of an earlier run; raises `CalibrationFileError` if unfit."""
        if self._store is None or not exists(self._store.primary_path):
            return None
        path, primary = self._store.primary_path, self.identities[0]
        stored = Calibration.load(path)
        if are_of_two(stored.serial, primary.serial):
            raise CalibrationFileError(
                f"{path}: is of the unit with serial {stored.serial}, but the log is of {primary.name} with "
                f"serial {primary.serial}; give each set a --store of its own"
            )
        return stored

    def _restore(self, store: ErrorStore) -> Iterator[Rejected]:
        """Core what is stored; what neither store nor core takes is set aside by the next save."""
        for unit in self.identities[1:]:
            found, rejected = store.load(unit)
            factory_errors, more = store.load_factory(unit)
            yield from dict.fromkeys([*rejected, *more])
            for factory in factory_errors:
                self._core.restore_factory(_record(factory, unit.identity))
            for error in found:
                why = self._core.restore(_record(error, unit.identity))
                if why is not None:
                    store.distrust(unit, error.sensor)

    def _from_factory(self, factory: Factory) -> list[tuple[Identified, SecondaryError]]:
        """Passes errors from the factory that the store does not hold yet to the core, and lists them.

        Raises `TumbleError` where there is no store, it holds others, or they cannot be of the unit.
        """
        if not factory:
            return []
        if self._store is None:
            raise ProcedureError("--factory: needs --store, the folder that keeps the errors")
        known = dict(zip(self.units, self._known, strict=True))
        secondaries = {unit.name: unit for unit in self.identities[1:]}
        begun = []
        calibrations = by_unit(factory, {name: unit.serial for name, unit in secondaries.items()})
        for name, calibration in calibrations.items():
            unit = secondaries[name]
            if calibration.temperature_drifts():
                self._drifting.append(name)
            for error in factory_errors(name, calibration, known[name], self.applied):
                if not self._store.lacks_factory(unit, error):
                    continue
                why = self._core.restore(_record(error, unit.identity))
                if why is not None:
                    raise ProcedureError(
                        f"--factory: {name}: its {error.sensor} is {why} for a unit mounted as stated; check "
                        "sensor_from_primary, the axes of the log and the largest_... settings"
                    )
                begun.append((unit, error))
        return begun


def refuse_other_counts(secondaries: int) -> None:
    """Raises `ProcedureError` where a set cannot have so many secondaries."""
    if not 0 < secondaries <= MOST_SECONDARIES:
        raise ProcedureError(
            f"{secondaries} secondaries were named; give the primary 1 to {MOST_SECONDARIES}"
        )


def settings_from(settings: SettingValues | None) -> RedundancySettings:
    """Reads settings from a file, or from what a file would hold; raises `TumbleError` in one line."""
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


def identities_of(
    names: Sequence[str], settings: RedundancySettings, serials: Mapping[str, str]
) -> tuple[Identified, ...]:
    """Returns each unit the number that stored errors know it by.

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


def _serials(units: Mapping[str, UnitSettings], logged: Mapping[str, str]) -> dict[str, str]:
    """Returns the serial of each unit, empty where none is stated; raises `ProcedureError` where two are."""
    found: dict[str, str] = {}
    for name, own in units.items():
        stated = logged.get(name, "")
        if are_of_two(own.serial, stated):
            raise ProcedureError(
                f"units: {name}: serial is {own.serial}, but its log states {stated}; leave it out, or "
                "give the log of that unit"
            )
        found[name] = own.serial or stated
    return found


def _without_serial(identities: Sequence[Identified]) -> Iterator[str]:
    """Describes units that a store knows only by their names."""
    names = [unit.name for unit in identities if not unit.serial]
    if names:
        yield (
            f"no serial number of {', '.join(names)} is known, so that the store cannot tell another unit of "
            f"the same name; --set units.{names[0]}.serial=TEXT states it"
        )


def _known_units(
    settings: RedundancySettings, names: Sequence[str], channels: Mapping[str, Sequence[Channel]]
) -> list[UnitSettings]:
    """Returns what is known of each unit; raises `ProcedureError` where that is of no unit."""
    for name in settings.units:
        if name not in names:
            raise ProcedureError(f"units: {name}: is none of {', '.join(names)}; use one of these names")
    known = [
        with_axes(name, settings.units.get(name, UnitSettings()), channels.get(name, CHANNELS))
        for name in names
    ]
    for stated in ("sensor_from_primary", "lever_arm"):
        if getattr(known[0], stated) is not None:
            raise ProcedureError(
                f"units: {names[0]}: is the primary, from which {stated} is counted; leave it out"
            )
    return known


def _core_monitor(
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
    has = [channel in (unit.axes or ()) for channel in CHANNELS]
    # Samples are handed over in the time of the common clock, so that the core has no offset to add.
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
    """Returns M, b and what they left of each triad, root mean square of a channel."""
    triads = {"accelerometer": calibration.accelerometer, "gyroscope": calibration.gyroscope}
    return {name: (triad.M, triad.b, triad.residual) for name, triad in triads.items() if triad is not None}


def _keep_calibration(store: ErrorStore, calibration: Calibration) -> None:
    """Stores the primary's own calibration for later runs, unless it is there."""
    path = store.primary_path
    if not exists(path) or Calibration.load(path).hash() != calibration.hash():
        calibration.save(path)


def _record(error: SecondaryError, identity: int) -> dict[str, object]:
    return {"identity": identity} | {name: getattr(error, name) for name in RECORDED}


def _secondary_error(names: Mapping[int, str], record: Mapping[str, object]) -> SecondaryError:
    fields: dict[str, Any] = dict(record)
    return SecondaryError(unit=names[fields.pop("identity")], **fields)


def _output_of(units: tuple[str, ...], said: _core.RedundancySaid | None) -> SetOutput:
    if said is None:
        nothing, none = np.empty((0, 3)), np.empty(0, dtype=np.int64)
        return SetOutput(units, np.empty(0), none, nothing, nothing, none)
    time, unit, force, rate, flags = (
        said[f"output_{column}"]  # type: ignore[literal-required]
        for column in _OUTPUT
    )
    return SetOutput(units, time, unit.astype(np.int64), force, rate, flags.astype(np.int64))


def _time_of(aiding: NativeAiding) -> float:
    return aiding[0]
