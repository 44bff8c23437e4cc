"""Settings of the redundancy monitor, as a file or a command line states them, and as the core takes them.

A settings file is YAML: any of the settings by name, and under `units` what is known of each unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import yaml
from pydantic import Field, ValidationError

from tumble.foundation.documents import Document, mistake_in, read_document, read_value
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.schemas import REDUNDANCY
from tumble.foundation.setting_models import MonitorSettings
from tumble.procedures.redundancy.units import UnitSettings

SCHEMA: Literal["tumble-redundancy/1"] = "tumble-redundancy/1"


class RedundancySettings(MonitorSettings):
    """All settings of the monitor, and what is known of each unit."""

    schema_: Literal["tumble-redundancy/1"] = Field(default=SCHEMA, alias="schema")
    units: dict[str, UnitSettings] = Field(default_factory=dict)
    """Prior knowledge of each unit, by its name."""
    renamed_keys: ClassVar[Mapping[str, str]] = {
        "first_threshold": "rest_specific_force_scatter",
        "second_threshold": "rest_angular_rate_scatter",
        "third_threshold": "secondary_accelerometer_threshold",
        "fourth_threshold": "secondary_gyroscope_threshold",
        "fifth_threshold": "primary_accelerometer_threshold",
        "sixth_threshold": "primary_gyroscope_threshold",
        "family_specific_force": "tolerated_specific_force",
        "family_angular_rate": "tolerated_angular_rate",
    }

    @classmethod
    def as_published(cls) -> RedundancySettings:
        """Those of the literature: thresholds on the norm; offsets, from motion, that always replace."""
        return cls(vector_check=False, largest_fit_model="offset", fit_rests=False, adoption="always")

    @classmethod
    def load(cls, path: Path | str) -> RedundancySettings:
        """Reads a settings file, and the files it names, from its folder.

        Raises `CalibrationFileError` in one line: file, line, key, what is wrong and what to do.
        """
        return read_document(path, cls, REDUNDANCY).with_rotations_read(Path(path).parent)

    def with_rotations_read(self, folder: Path) -> RedundancySettings:
        """Puts the rotation in place of each file that is named for one: settings that `tumble align` wrote.

        Raises `CalibrationFileError` where such a file does not know the rotation of the unit.
        """
        units = dict(self.units)
        for name, unit in units.items():
            if isinstance(unit.sensor_from_primary, str):
                rotation = _rotation_in(folder / unit.sensor_from_primary, name)
                units[name] = unit.model_copy(update={"sensor_from_primary": rotation})
        return self.model_copy(update={"units": units})

    def and_then(self, later: RedundancySettings) -> RedundancySettings:
        """Adds settings that take precedence over these; units are joined setting by setting."""
        content, more = _stated(self), _stated(later)
        units = {
            name: content["units"].get(name, {}) | more["units"].get(name, {})
            for name in {**content["units"], **more["units"]}
        }
        return RedundancySettings.model_validate(content | more | {"units": units})

    def changed(self, changes: Sequence[str]) -> RedundancySettings:
        """Adds `NAME=VALUE`, or `units.UNIT.NAME=VALUE`, one after another; values are written as in YAML.

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
        return {name: getattr(self, name) for name in MonitorSettings.model_fields}


def _rotation_in(path: Path, unit: str) -> FloatArray:
    aligned = read_document(path, RedundancySettings, REDUNDANCY)
    rotation = aligned.units[unit].sensor_from_primary if unit in aligned.units else None
    if rotation is None or isinstance(rotation, str):
        known = ", ".join(aligned.units) or "no unit"
        raise CalibrationFileError(f"{path}: does not hold the rotation of {unit}; it knows {known}")
    found: FloatArray = rotation
    return found


def _stated(document: Document) -> dict[str, Any]:
    """Returns what was stated, `none` included, to be stated anew."""
    content: dict[str, Any] = {name: getattr(document, name) for name in document.model_fields_set}
    if isinstance(document, RedundancySettings):
        content["units"] = {name: _stated(unit) for name, unit in document.units.items()}
    return content


def _steps(name: str) -> list[str]:
    """Splits `units.UNIT.NAME`; the name of a unit may have dots of its own."""
    if not name.startswith("units."):
        return [name]
    unit, _, key = name.removeprefix("units.").rpartition(".")
    return ["units", unit, key]
