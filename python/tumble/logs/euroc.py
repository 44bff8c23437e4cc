"""The folders of EuRoC, also called ASL, and of TUM-VI: `mav0/imu0/data.csv`, or `dso/imu.txt`.

`data.csv` holds time in ns, angular rate, specific force; `sensor.yaml` beside it rate and extrinsics.
Source: https://projects.asl.ethz.ch/datasets/doku.php?id=kmavvisualinertialdatasets,
https://cvg.cit.tum.de/data/datasets/visual-inertial-dataset.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.files import note_input
from tumble.foundation.numbers import number_of
from tumble.foundation.regular_files import open_regular
from tumble.logs.columns import ImuColumns
from tumble.logs.csv import imu_of_table
from tumble.logs.options import ReadOptions
from tumble.logs.text import find_layout
from tumble.logs.track import DOCUMENTED, LoggedImu, StatedUnit, choose

_DATA = ("data.csv", "data.csv.gz", "data.csv.zst", "data.csv.bz2", "data.csv.xz")
_DSO = ("dso/imu.txt", "imu.txt")
_WIDTH = 7
_LARGEST_YAML = 1 << 16
_FOLDERS = ("mav0", "dso")
"""Names that distinguish no sequence from another."""


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a folder has this layout; a file is recognised by its column names."""
    return bool(head) or bool(_files(path))


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of the folders of IMUs; a file alone has no name."""
    return tuple(_files(path)) if is_folder(path) else ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads one IMU of a folder, or its file.

    Raises `LogError` where it has other columns, or there are several IMUs and none is named.
    """
    files = _files(path) if is_folder(path) else {"": path}
    name = choose(path, tuple(files), imu, "IMU")
    file = files[name]
    note_input(file)
    layout = find_layout(file, options)
    if len(layout.names) != _WIDTH:
        raise LogError(
            f"{file}: has {len(layout.names)} columns where time, three rates and three accelerations are "
            "expected; give its columns with --columns and its name without folder"
        )
    sensor = _sensor(file.with_name("sensor.yaml"))
    found = imu_of_table(file, replace(layout, notices=()), _columns(layout.names), options)
    return replace(
        found,
        path=path,
        imu=name,
        format="euroc",
        rate=sensor.rate,
        frame=sensor.frame or "case",
        name=_name(file, name if len(files) > 1 else ""),
        alone=len(files) == 1,
        notices=(*sensor.remarks, *_about(file)),
    )


def _files(folder: Path) -> dict[str, Path]:
    """Returns the files of IMUs below a folder, by the names of theirs."""
    for root in (folder / "mav0", folder):
        found = {
            place.name: file
            for place in sorted(root.glob("imu*"))
            for file in [next((place / name for name in _DATA if is_file(place / name)), None)]
            if file is not None
        }
        if found:
            return found
    if folder.name.startswith("imu") and (file := _first(folder, _DATA)):
        return {folder.name: file}
    names = _DSO if folder.name == "dso" else _DSO[:1]
    return {"imu0": file} if (file := _first(folder, names)) else {}


def _first(folder: Path, names: tuple[str, ...]) -> Path | None:
    return next((folder / name for name in names if is_file(folder / name)), None)


def _columns(names: tuple[str, ...]) -> ImuColumns:
    time, gx, gy, gz, ax, ay, az = names
    return ImuColumns(
        (ax, ay, az),
        (gx, gy, gz),
        time,
        accelerometer_unit=StatedUnit("m/s^2", DOCUMENTED),
        gyroscope_unit=StatedUnit("rad/s", DOCUMENTED),
        time_unit=StatedUnit("ns", DOCUMENTED),
    )


def _name(file: Path, imu: str) -> str:
    """Names an IMU after the sequence, and after its folder where there are several."""
    folders = [part for part in file.resolve().parts[:-1] if part not in _FOLDERS]
    while len(folders) > 1 and folders[-1].startswith("imu"):
        folders.pop()
    return f"{folders[-1]}-{imu}" if imu else folders[-1]


def _about(file: Path) -> tuple[str, ...]:
    if file.name != "imu.txt":
        return ()
    return (
        "imu.txt holds samples made up at the times of images besides those of the sensor; mav0 does not",
    )


@dataclass(frozen=True, slots=True)
class _Sensor:
    """Contents of `sensor.yaml`."""

    rate: float | None = None
    frame: str = ""
    remarks: tuple[str, ...] = ()


def _sensor(file: Path) -> _Sensor:
    """Reads what stands beside the samples; nothing of it is needed for reading them."""
    if not is_file(file):
        return _Sensor()
    note_input(file)
    stated = _yaml(file)
    if stated is None:
        return _Sensor(remarks=(f"{file.name} is no YAML and was left out",))
    rate = number_of(str(stated.get("rate_hz", "")))
    return _Sensor(rate if rate and rate > 0.0 else None, *_extrinsics(stated))


def _yaml(file: Path) -> dict[str, Any] | None:
    import yaml

    from tumble.foundation.bounded_yaml import parse

    with open_regular(file) as stream:
        text = stream.read(_LARGEST_YAML).decode("utf-8", errors="replace")
    try:
        stated = parse("\n".join(line for line in text.splitlines() if not line.startswith("%")))[1]
    except yaml.YAMLError:
        return None
    return stated if isinstance(stated, dict) else None


def _extrinsics(stated: dict[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Describes the frame of the samples: that of the body, or the sensor's with its extrinsics."""
    given = stated.get("T_BS")
    values = given.get("data") if isinstance(given, dict) else None
    numbers = [number_of(str(value)) for value in values] if isinstance(values, list) else []
    if len(numbers) != 16 or None in numbers:
        return "", ()
    matrix = np.array(numbers, dtype=np.float64).reshape(4, 4)
    if np.array_equal(matrix, np.eye(4)):
        return "body", ()
    angle = np.degrees(np.arccos(np.clip((np.trace(matrix[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    shift = float(np.linalg.norm(matrix[:3, 3]))
    return "sensor", (
        f"samples are in the frame of the sensor, which T_BS in sensor.yaml turns by {angle:.4g} deg and "
        f"shifts by {shift:.4g} m from that of the body",
    )
