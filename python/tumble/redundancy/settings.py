"""Settings of the redundancy monitor, as a file or a command line states them, and as the core takes them.

A settings file is YAML: any of the settings by name, and under `units` what is known of each unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import yaml
from pydantic import BeforeValidator, Field, ValidationError, WithJsonSchema

from tumble.documents import Document, mistake_in, read_document, read_value
from tumble.errors import CalibrationFileError, ProcedureError
from tumble.recording import FloatArray
from tumble.redundancy.units import UnitSettings

SCHEMA: Literal["tumble-redundancy/1"] = "tumble-redundancy/1"
SCHEMA_FILE = "redundancy.schema.json"
WHAT = "redundancy settings file"

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_THRESHOLD = re.compile(rf"\s*(?P<last>last\s*(?P<how>[+*])\s*)?(?P<number>{_NUMBER})\s*")


def _threshold(value: object) -> object:
    """Read `0.1`, `last+0.1` or `last*1.5`; give it without spaces."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return value
    match = _THRESHOLD.fullmatch(str(value))
    smallest = 1.0 if match and match["how"] == "*" else 0.0
    if match is None or not float(match["number"]) > smallest:
        raise ValueError(
            f"needs to be a number above 0, last+MARGIN, or last*RATIO with a ratio above 1, found {value!r}"
        )
    return f"last{match['how']}{match['number']}" if match["last"] else match["number"]


def _none(value: object) -> object:
    return None if value == "none" else value


Threshold: TypeAlias = Annotated[
    str,
    BeforeValidator(_threshold),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0.0},
                {"type": "string", "pattern": rf"^\s*(last\s*[+*]\s*)?{_NUMBER}\s*$"},
            ]
        }
    ),
]
"""`0.1`: fixed. `last+0.1`: the last error and a margin. `last*1.5`: the last error times a ratio."""
OrNone: TypeAlias = Annotated[
    Annotated[float, Field(gt=0.0)] | None,
    BeforeValidator(_none),
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0.0}, {"enum": ["none", None]}]}),
]
"""A number above 0, or `none`."""


def _setting(default: object, unit: str = "", **bounds: Any) -> Any:  # noqa: ANN401
    """Give a field with its default and unit; its meaning is the text below it."""
    return Field(default=default, json_schema_extra={"unit": unit}, validate_default=True, **bounds)


def _positive(default: float, unit: str) -> Any:  # noqa: ANN401
    return _setting(default, unit, gt=0.0)


class RestSettings(Document):
    """When a unit counts as being at rest."""

    first_threshold: float = _positive(0.1, "m/s^2")
    """Scatter of specific force, and change of its mean, below which a unit is at rest."""
    second_threshold: float = _positive(0.02, "rad/s")
    """Scatter of angular rate, and change of its mean, below which a unit is at rest."""
    rest_settle: float = _setting(0.5, "s", ge=0.0)
    """Rest that is let pass before readings count."""
    rest_duration: float = _positive(2.0, "s")
    """Rest over which readings are averaged before units are evaluated."""
    window: float = _positive(0.05, "s")
    """Length of the windows over which all units are averaged, whatever their rates; a whole part of 1 s."""
    gravity: float = _positive(9.80665, "m/s^2")
    """Local gravity."""


class EvaluationSettings(Document):
    """When units at rest are evaluated, and what deviates too much."""

    evaluate_after_start: bool = _setting(True)
    """Evaluate the first rest after the start."""
    evaluate_every: OrNone = _setting(600.0, "s")
    """Evaluate a rest again once so much time has passed; `none`: on command only."""
    data: Literal["compensated", "raw"] = _setting("compensated")
    """Take deviations after stored errors were taken off, or from data as read, with thresholds to match."""
    vector_check: bool = _setting(True)
    """Compare a secondary also with a valid primary, axis by axis: the norm is blind across gravity."""
    third_threshold: Threshold = _setting("0.1", "m/s^2")
    """Deviation of a secondary's accelerometer above which it wants calibrating."""
    fourth_threshold: Threshold = _setting("0.01", "rad/s")
    """Deviation of a secondary's gyroscope above which it wants calibrating."""
    fifth_threshold: Threshold = _setting("0.1", "m/s^2")
    """Deviation of the primary's accelerometer above which it is invalid; `last` is its last valid one."""
    sixth_threshold: Threshold = _setting("0.01", "rad/s")
    """Deviation of the primary's gyroscope above which it is invalid; `last` is its last valid one."""


class GateSettings(Document):
    """Whose deviations let a calibration be triggered."""

    gate: Literal["secondary alone", "whole primary", "sensor by sensor"] = _setting("whole primary")
    """Trigger on the secondary alone, with both sensors of the primary valid, or each with its own kind."""


class CalibrationSettings(Document):
    """What is calibrated, and how pairs are collected in motion."""

    scope: Literal["all sensors", "triggering sensor"] = _setting("all sensors")
    """Calibrate both sensors of a secondary, or only the one that deviates."""
    motion_specific_force: float = _positive(0.5, "m/s^2")
    """Change of the primary's mean specific force since the rest that counts as motion."""
    motion_angular_rate: float = _positive(0.2, "rad/s")
    """Change of the primary's mean angular rate since the rest that counts as motion."""
    motion_timeout: float = _positive(300.0, "s")
    """Longest wait for motion; then the calibration is abandoned."""
    collect: float = _positive(30.0, "s")
    """Motion to be collected."""
    collect_timeout: float = _positive(600.0, "s")
    """Longest time for collecting; then what there is has to do, or the calibration is abandoned."""
    fewest_pairs: int = _setting(200, "", ge=1)
    """Fewest pairs with which a fit is tried when time is up."""


class FitSettings(Document):
    """How much a fit may find."""

    highest_rung: Literal["offset", "gain", "affine", "affine and lever arm"] = _setting(
        "affine and lever arm"
    )
    """Top of the ladder: the highest rung up to it that the motion shows is used."""
    excitation_specific_force: float = _positive(0.5, "m/s^2")
    """Standard deviation of specific force along a direction from which on the matrix is fitted along it."""
    excitation_angular_rate: float = _positive(0.2, "rad/s")
    """Standard deviation of angular rate along a direction from which on the matrix is fitted along it."""
    excitation_lever_arm: float = _positive(2.0, "1/s^2")
    """Specific force for each metre of lever arm, root mean square, from which on the lever arm is fitted."""


class AdoptionSettings(Document):
    """What a new calibration has to be to replace the stored one."""

    improvement: float = _setting(0.02, "", ge=0.0, lt=1.0)
    """Share by which its residual on held-out pairs has to be smaller than the stored one's."""
    largest_specific_force_bias: float = _positive(3.0, "m/s^2")
    """Largest bias of an accelerometer."""
    largest_angular_rate_bias: float = _positive(1.0, "rad/s")
    """Largest bias of a gyroscope."""
    largest_scale_error: float = _positive(0.1, "")
    """Largest deviation of a scale factor from one."""
    largest_misalignment: float = _positive(0.1, "rad")
    """Largest misalignment beside the nominal mounting."""
    largest_lever_arm: float = _positive(1.0, "m")
    """Longest lever arm."""
    largest_specific_force_drift: float = _positive(0.1, "m/s^2")
    """Largest drift of an accelerometer while pairs were collected."""
    largest_angular_rate_drift: float = _positive(0.01, "rad/s")
    """Largest drift of a gyroscope while pairs were collected."""
    largest_specific_force_residual: float = _positive(0.5, "m/s^2")
    """Largest residual of an accelerometer on held-out pairs, root mean square."""
    largest_angular_rate_residual: float = _positive(0.05, "rad/s")
    """Largest residual of a gyroscope on held-out pairs, root mean square."""


class HealthSettings(Document):
    """What makes a unit unhealthy, at all times."""

    late: float = _positive(0.1, "s")
    """Time without a sample after which a unit is late."""
    frozen: float = _positive(0.1, "s")
    """Time in which all axes of a sensor repeat their readings, and 16 readings at least, until it is frozen;
    three times that for a sensor of one axis."""
    saturated: float = _positive(0.05, "s")
    """Time at the end of its range, or without finite numbers, that a sensor may spend; forgiven slowly."""
    spike_specific_force: float = _positive(40.0, "m/s^2")
    """Specific force that leaves by more, and is back with the next sample, is a spike."""
    spike_angular_rate: float = _positive(10.0, "rad/s")
    """Angular rate that leaves by more, and is back with the next sample, is a spike."""
    family_specific_force: float = _positive(1.0, "m/s^2")
    """Distance from the median of all units, from three up, beyond which specific force is out of family."""
    family_angular_rate: float = _positive(0.1, "rad/s")
    """Distance from the median of all units, from three up, beyond which angular rate is out of family."""
    family_time: float = _positive(0.5, "s")
    """Time out of family, or too noisy, after which a unit is unhealthy."""
    noise_ratio: float = _setting(5.0, "", gt=1.0)
    """Scatter of a unit, as a multiple of the median of all, beyond which it is noisy."""
    rest_specific_force: float = _positive(1.5, "m/s^2")
    """Deviation of specific force from gravity at rest that no error of a working unit explains."""
    rest_angular_rate: float = _positive(0.2, "rad/s")
    """Angular rate at rest that no error of a working unit explains."""
    recovery: float = _positive(0.5, "s")
    """Time in which nothing may have been wrong until a unit is healthy again."""


class SelectionSettings(Document):
    """Which unit is the source of the output."""

    hold: float = _setting(0.02, "s", ge=0.0)
    """Time a source has to be unhealthy before another takes over."""
    return_after: OrNone = _setting(None, "s")
    """Health to be proven by the primary before it takes over again; `none`: on command only."""
    calibrated_only: bool = _setting(False)
    """Select only secondaries that have a stored error."""


GROUPS: Mapping[str, type[Document]] = {
    "rest": RestSettings,
    "evaluation": EvaluationSettings,
    "gate": GateSettings,
    "calibration": CalibrationSettings,
    "fit": FitSettings,
    "adoption": AdoptionSettings,
    "health": HealthSettings,
    "selection": SelectionSettings,
}


# Pydantic takes the fields of the last base first.
class RedundancySettings(
    SelectionSettings,
    HealthSettings,
    AdoptionSettings,
    FitSettings,
    CalibrationSettings,
    GateSettings,
    EvaluationSettings,
    RestSettings,
):
    """All settings of the monitor, and what is known of each unit."""

    schema_: Literal["tumble-redundancy/1"] = Field(default=SCHEMA, alias="schema")
    units: dict[str, UnitSettings] = Field(default_factory=dict)
    """What is known of each unit, by its name."""

    @classmethod
    def load(cls, path: Path | str) -> RedundancySettings:
        """Read a settings file, and the files it names, from its folder.

        Raises `CalibrationFileError` in one line: file, line, key, what is wrong and what to do.
        """
        return read_document(path, cls, WHAT, SCHEMA_FILE).with_rotations_read(Path(path).parent)

    def with_rotations_read(self, folder: Path) -> RedundancySettings:
        """Put the rotation in place of each file that is named for one: settings that `tumble align` wrote.

        Raises `CalibrationFileError` where such a file does not know the rotation of the unit.
        """
        units = dict(self.units)
        for name, unit in units.items():
            if isinstance(unit.sensor_from_primary, str):
                rotation = _rotation_in(folder / unit.sensor_from_primary, name)
                units[name] = unit.model_copy(update={"sensor_from_primary": rotation})
        return self.model_copy(update={"units": units})

    def and_then(self, later: RedundancySettings) -> RedundancySettings:
        """Take in other settings, which go before these; units are joined setting by setting."""
        content, more = _stated(self), _stated(later)
        units = {
            name: content["units"].get(name, {}) | more["units"].get(name, {})
            for name in {**content["units"], **more["units"]}
        }
        return RedundancySettings.model_validate(content | more | {"units": units})

    def changed(self, changes: Sequence[str]) -> RedundancySettings:
        """Take in `NAME=VALUE`, or `units.UNIT.NAME=VALUE`, one after another; values are written as in YAML.

        Raises `ProcedureError`, in one line, where there is no such setting or its value makes no sense.
        """
        settings = self
        for text in changes:
            settings = settings._with_change(text)
        return settings

    def _with_change(self, text: str) -> RedundancySettings:
        name, sign, typed = text.partition("=")
        *path, key = _steps(name.strip())
        if not sign or not key or "" in path:
            raise ProcedureError(
                f"--set {text}: give NAME=VALUE, such as evaluate_every=60, or units.UNIT.NAME=VALUE"
            )
        try:
            value = read_value(typed)
        except yaml.YAMLError as error:
            raise ProcedureError(f"--set {text}: its value is not YAML; quote it as YAML does") from error
        content = _stated(self)
        place = content
        for step in path:
            place = place.setdefault(step, {})
        place[key] = value
        try:
            return RedundancySettings.model_validate(content).with_rotations_read(Path())
        except ValidationError as error:
            raise ProcedureError(
                f"--set {text}: {mistake_in(error, RedundancySettings)}; tumble redundancy --explain lists "
                "all settings"
            ) from error

    def by_name(self) -> dict[str, object]:
        """Every setting of the monitor by name, SI units, as the core takes it."""
        return {row.name: getattr(self, row.name) for row in explain()}


def _rotation_in(path: Path, unit: str) -> FloatArray:
    aligned = read_document(path, RedundancySettings, "file of tumble align", SCHEMA_FILE)
    rotation = aligned.units[unit].sensor_from_primary if unit in aligned.units else None
    if rotation is None or isinstance(rotation, str):
        known = ", ".join(aligned.units) or "no unit"
        raise CalibrationFileError(f"{path}: does not hold the rotation of {unit}; it knows {known}")
    found: FloatArray = rotation
    return found


def _stated(document: Document) -> dict[str, Any]:
    """Give what was stated, `none` included, to be stated anew."""
    content: dict[str, Any] = {name: getattr(document, name) for name in document.model_fields_set}
    if isinstance(document, RedundancySettings):
        content["units"] = {name: _stated(unit) for name, unit in document.units.items()}
    return content


def _steps(name: str) -> list[str]:
    """Split `units.UNIT.NAME`; the name of a unit may have dots of its own."""
    if not name.startswith("units."):
        return [name]
    unit, _, key = name.removeprefix("units.").rpartition(".")
    return ["units", unit, key]


@dataclass(frozen=True, slots=True)
class Explained:
    """A setting as people read of it."""

    group: str
    name: str
    meaning: str
    unit: str
    """Empty for what has none."""
    choices: tuple[str, ...]
    """The words it may be, if it is one of several."""
    default: object


def explain() -> Iterator[Explained]:
    """Give every setting of the monitor, in order."""
    for group, model in GROUPS.items():
        for name, field in model.model_fields.items():
            extra = field.json_schema_extra
            unit = extra.get("unit", "") if isinstance(extra, dict) else ""
            choices = getattr(field.annotation, "__args__", ()) if _is_choice(field.annotation) else ()
            yield Explained(group, name, field.description or "", str(unit), choices, field.default)


def _is_choice(annotation: object) -> bool:
    return getattr(annotation, "__origin__", None) is Literal
