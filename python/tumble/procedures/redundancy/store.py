"""Stored errors of secondaries on disk: one file a unit and sensor, and beside it the first it ever had.

A file takes its name only once it is whole, so that power may fail at any time. It carries a checksum, the
date, serial and identity of the unit, and those of the primary it was calibrated against. A file that
does not fit is ignored, and set aside before another takes its place; units with other serials are refused.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field

from tumble.foundation.documents import (
    ArrayField,
    Document,
    Matrix,
    Vector,
    VectorWithGaps,
    read_document,
    write_document,
)
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.file_names import file_stem
from tumble.foundation.file_status import exists
from tumble.foundation.files import prepare_folder, set_aside
from tumble.foundation.plain import finite
from tumble.foundation.provenance import date_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.schemas import STORED_ERROR
from tumble.foundation.serials import are_of_two
from tumble.procedures.redundancy.result import (
    RECORDED,
    UNKNOWN,
    FitModel,
    Identified,
    SecondaryError,
    Sensor,
)

SCHEMA: Literal["tumble-stored-error/1"] = "tumble-stored-error/1"
SENSORS: tuple[Sensor, ...] = ("accelerometer", "gyroscope")

_HEADER = f"""\
Stored error of one sensor of a secondary IMU, by Tumble: y_secondary = M y_primary + b, both as read.
SI units; M leads from the primary's case frame to the axes of the secondary; null marks what was not shown.
Written by tumble redundancy and not meant to be edited: the checksum would no longer match.
Schema: tumble schema {STORED_ERROR.name}"""

_KEYS = {"matrix": "M", "bias": "b", "matrix_sigma": "M_sigma", "bias_sigma": "b_sigma"}
"""Keys of the file for fields of an error with another name."""

MatrixWithGaps: TypeAlias = Annotated[FloatArray, ArrayField((3, 3), gaps=True)]


class StoredError(Document):
    """One sensor's error, as it stands in the file."""

    schema_: Literal["tumble-stored-error/1"] = Field(default=SCHEMA, alias="schema")
    unit: str
    identity: int = Field(ge=0, lt=2**64)
    """Identity of the secondary."""
    serial: str | None = None
    """Serial number of the secondary; absent where neither log nor settings stated one."""
    primary: str
    primary_identity: int = Field(ge=0, lt=2**64)
    """Identity of the unit against which it was calibrated."""
    primary_serial: str | None = None
    date: str | None = None
    """When it was stored: UTC, ISO 8601."""
    sensor: Sensor
    sequence: int = Field(ge=0)
    """Counts the calibrations of this sensor; 0 for one given from outside."""
    M: Matrix
    """sensor from the primary's case: y_secondary = M y_primary + b."""
    b: Vector
    """m/s^2 or rad/s."""
    M_sigma: MatrixWithGaps
    b_sigma: VectorWithGaps
    lever_arm: Vector | None = None
    """From primary to secondary, m, primary's case frame."""
    lever_arm_sigma: VectorWithGaps | None = None
    fit_model: FitModel
    directions: int = Field(ge=0, le=3)
    """Directions of motion along which M was found."""
    residual: float | None = None
    """Root mean square a channel on held-out pairs, m/s^2 or rad/s."""
    residual_before: float | None = None
    pairs: int = Field(ge=0)
    followed: Vector | None = None
    """Sum of the steps in which its calibrations followed the primary without proof that it was right.

    m/s^2 or rad/s, axes of the secondary; absent where nothing was followed.
    """
    checksum: str
    """sha256 of all the rest."""

    def digest(self) -> str:
        """Returns sha256, in hexadecimal, of all but the checksum, whatever the layout of the file."""
        content = self.content()
        del content["checksum"]
        canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(canonical.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Rejected:
    """A stored error that does not count."""

    unit: str
    sensor: Sensor
    reason: str
    """`corrupt`, `of another unit`, `against another primary`, or in the words of the core."""
    detail: str
    """Which file, and what is wrong with it, in one line."""


class ErrorStore:
    """The stored errors of the secondaries of one primary, in one folder; a `fresh` one begins anew."""

    def __init__(self, folder: Path | str, primary: Identified, *, fresh: bool = False) -> None:
        self.folder = Path(folder)
        self._primary = primary
        self._fresh = fresh
        self._distrusted: set[Path] = set()
        self._without_serial: list[Path] = []
        self._in_use: set[Path] = set()

    def load(self, unit: Identified) -> tuple[list[SecondaryError], list[Rejected]]:
        """Reads the last stored error of each sensor of a unit, or the factory's where the last is damaged.

        Never raises for damage, which is what a store has to live with; raises `CalibrationFileError` where a
        file is of a unit with another serial, or against a primary with another.
        """
        found: list[SecondaryError] = []
        rejected: list[Rejected] = []
        for sensor in SENSORS:
            for path in (self._path(unit, sensor), self._factory_path(unit, sensor)):
                if not exists(path):
                    continue
                error = self._read(path, unit, sensor)
                if isinstance(error, SecondaryError):
                    found.append(error)
                    self._in_use.add(path)
                    break
                rejected.append(error)
        return found, rejected

    def load_factory(self, unit: Identified) -> tuple[list[SecondaryError], list[Rejected]]:
        """Reads the first stored error of each sensor of a unit, as `load` reads the last."""
        paths = {sensor: self._factory_path(unit, sensor) for sensor in SENSORS}
        read = [self._read(path, unit, sensor) for sensor, path in paths.items() if exists(path)]
        found = [error for error in read if isinstance(error, SecondaryError)]
        return found, [error for error in read if isinstance(error, Rejected)]

    @property
    def primary_path(self) -> Path:
        """Path of the primary's own calibration."""
        return self.folder / f"{file_stem(self._primary.name)}-calibration.yaml"

    def notices(self) -> Iterator[str]:
        """Describes loaded files without the serial of the unit, or of its primary."""
        for path in dict.fromkeys(path for path in self._without_serial if path in self._in_use):
            yield f"{path}: does not state the serials of the unit and its primary; taken by their names"

    def distrust(self, unit: Identified, sensor: Sensor) -> None:
        """Sets stored files aside at the next `save`, instead of overwriting them."""
        self._distrusted |= {self._path(unit, sensor), self._factory_path(unit, sensor)}

    def save(self, unit: Identified, error: SecondaryError) -> Path:
        """Replaces the last stored error; the first one ever stored is kept beside it.

        Raises `OutputError` where the folder cannot be written to; what was stored before is untouched.
        """
        prepare_folder(self.folder)
        last, factory = self._path(unit, error.sensor), self._factory_path(unit, error.sensor)
        for path in (last, factory):
            if path in self._distrusted and exists(path):
                set_aside(path)
                self._distrusted.discard(path)
        content = _content(error, unit, self._primary)
        if self._fresh or not exists(factory):
            write_document(factory, _HEADER, content, renews=True)
        write_document(last, _HEADER, content, renews=True)
        return last

    def lacks_factory(self, unit: Identified, error: SecondaryError) -> bool:
        """Returns whether it has no factory error; raises `CalibrationFileError` where there is another."""
        path = self._factory_path(unit, error.sensor)
        if not exists(path):
            return True
        stored = self._read(path, unit, error.sensor)
        if isinstance(stored, SecondaryError):
            pairs = ((stored.matrix, error.matrix), (stored.bias, error.bias))
            if all(np.allclose(one, other, rtol=0.0, atol=1e-9) for one, other in pairs):
                return False
        raise CalibrationFileError(
            f"{path}: holds another error from the factory than that of --factory; give a new --store, or "
            "leave --factory out"
        )

    def _read(self, path: Path, unit: Identified, sensor: Sensor) -> SecondaryError | Rejected:
        try:
            stored = read_document(path, StoredError, STORED_ERROR)
        except CalibrationFileError as error:
            return self._rejected(path, unit, sensor, "corrupt", str(error))
        if stored.checksum != stored.digest():
            detail = f"{path}: its checksum does not match its content"
            return self._rejected(path, unit, sensor, "corrupt", detail)
        _refuse_other_serials(path, stored, unit, self._primary)
        if stored.sensor != sensor or not unit.is_known_as(stored.unit, stored.identity, stored.serial):
            detail = f"{path}: is the {stored.sensor} of {stored.unit}"
            return self._rejected(path, unit, sensor, "of another unit", detail)
        against = (stored.primary, stored.primary_identity, stored.primary_serial)
        if not self._primary.is_known_as(*against):
            detail = f"{path}: was calibrated against {stored.primary}, not {self._primary.name}"
            return self._rejected(path, unit, sensor, "against another primary", detail)
        if not (stored.serial and stored.primary_serial):
            self._without_serial.append(path)
        return _error(stored, unit.name)

    def _rejected(self, path: Path, unit: Identified, sensor: Sensor, reason: str, detail: str) -> Rejected:
        self._distrusted.add(path)
        return Rejected(unit.name, sensor, reason, detail)

    def _path(self, unit: Identified, sensor: Sensor) -> Path:
        return self.folder / f"{file_stem(unit.name)}-{sensor}.yaml"

    def _factory_path(self, unit: Identified, sensor: Sensor) -> Path:
        return self.folder / f"{file_stem(unit.name)}-{sensor}-factory.yaml"


def _refuse_other_serials(path: Path, stored: StoredError, unit: Identified, primary: Identified) -> None:
    """Raises `CalibrationFileError` where a stored error was found on other units than those of the logs."""
    for found, name, serial, now in (
        (f"is the {stored.sensor} of", stored.unit, stored.serial, unit),
        ("was calibrated against", stored.primary, stored.primary_serial, primary),
    ):
        if are_of_two(serial, now.serial):
            raise CalibrationFileError(
                f"{path}: {found} {name} with serial {serial}, but the log is of {now.name} with serial "
                f"{now.serial}; give each set a --store of its own"
            )


def _content(error: SecondaryError, unit: Identified, primary: Identified) -> dict[str, Any]:
    recorded = {_KEYS.get(name, name): finite(getattr(error, name)) for name in RECORDED}
    whose = {
        "unit": unit.name,
        "identity": unit.identity,
        "serial": unit.serial or None,
        "primary": primary.name,
        "primary_identity": primary.identity,
        "primary_serial": primary.serial or None,
        "date": date_now(),
    }
    stored = StoredError.model_validate(whose | recorded | {"checksum": ""})
    return stored.content() | {"checksum": stored.digest()}


def _error(stored: StoredError, name: str) -> SecondaryError:
    recorded = {field: getattr(stored, _KEYS.get(field, field)) for field in RECORDED}
    known = {field: value for field, value in recorded.items() if value is not None}
    for field in known:
        if field.endswith("_sigma"):
            known[field] = np.where(np.isnan(known[field]), np.inf, known[field])
    return SecondaryError(**{**UNKNOWN, "unit": name, **known})


def keep_adopted(
    store: ErrorStore, errors: Sequence[SecondaryError], identities: Sequence[Identified]
) -> None:
    """Stores what was adopted; what was loaded is there already."""
    by_name = {unit.name: unit for unit in identities}
    for error in errors:
        if error.adopted is not None:
            store.save(by_name[error.unit], error)
