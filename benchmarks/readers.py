"""Reading each format of logs against bare reading of the same file by its library, and memory over length.

`python -m benchmarks.readers [--tiny] [--only NAME]`. Another format is another row of `READERS`.
"""

from __future__ import annotations

import argparse
import gzip
import json
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]
import pyarrow.feather  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]
import scipy.io
from pymavlink import mavutil  # type: ignore[import-untyped]
from pymavlink.dialects.v20 import common as mavlink  # type: ignore[import-untyped]
from pyulog.core import ULog  # type: ignore[import-untyped]
from rich.console import Console
from rich.table import Table

import tumble
from benchmarks import readers_arrays as arrays
from benchmarks.arrow_csv import csv_of_ours
from benchmarks.memory import LARGEST_GROWTH, peak_here
from benchmarks.recordings import FORMATS as RECORDINGS
from benchmarks.results import Content, load, machine, save
from benchmarks.speed import side_by_side
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import Chunk

SEED = 20_254_000_000
LARGEST_RATIO = 1.3
LONGER = 10
RATE = 200.0
_EPOCH = 1_700_000_000_000_000_000
_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Reader:
    """A format: how a file of it is written, and how its library reads it."""

    write: Callable[[Path, Chunk], Path]
    """Write into a folder; give what a user would name."""
    bare: Callable[[Path], object]
    library: str
    timeless: bool = False
    """Indicates whether its files hold no time."""
    share: float = 1.0
    """Share of the benchmark's samples with which it is measured, where each is a file."""


def _columns(chunk: Chunk, order: Sequence[str]) -> dict[str, object]:
    triads = {"a": chunk.accelerometer, "g": chunk.gyroscope}
    return {
        f"{triad}{axis}": triads[triad][:, number] for triad in order for number, axis in enumerate(_AXES)
    }


def _stamps(chunk: Chunk) -> object:
    return np.rint(chunk.time * 1e9).astype(np.int64) + _EPOCH


def _table(path: Path, head: str, columns: dict[str, object], delimiter: str = ",") -> Path:
    options = pa.csv.WriteOptions(include_header=False, delimiter=delimiter, quoting_style="none")
    with path.open("wb") as file:
        file.write(head.encode())
        pa.csv.write_csv(pa.table(columns), file, options)
    return path


def _recording(name: str) -> Callable[[Path, Chunk], Path]:
    file, write = RECORDINGS[name]

    def written(folder: Path, chunk: Chunk) -> Path:
        write(folder / file, chunk)
        return folder / file

    return written


def _euroc(folder: Path, chunk: Chunk) -> Path:
    place = folder / "mav0" / "imu0"
    place.mkdir(parents=True)
    names = [f"w_RS_S_{axis} [rad s^-1]" for axis in _AXES] + [f"a_RS_S_{axis} [m s^-2]" for axis in _AXES]
    head = f"#timestamp [ns],{','.join(names)}\n"
    _table(place / "data.csv", head, {"t": _stamps(chunk), **_columns(chunk, "ga")})
    return folder / "mav0"


def _packed(folder: Path, chunk: Chunk) -> Path:
    plain = _recording("CSV")(folder, chunk)
    path = plain.with_name("log.csv.gz")
    with plain.open("rb") as source, gzip.open(path, "wb", compresslevel=1) as target:
        shutil.copyfileobj(source, target)
    plain.unlink()
    return path


def _xsens(folder: Path, chunk: Chunk) -> Path:
    names = [f"Acc_{axis.upper()}" for axis in _AXES] + [f"Gyr_{axis.upper()}" for axis in _AXES]
    head = "// Start Time: Unknown\n// Update Rate: 200.0Hz\n" + "\t".join(["PacketCounter", *names]) + "\n"
    counter = np.arange(len(chunk)) % 65_536
    return _table(folder / "MT_0.txt", head, {"t": counter, **_columns(chunk, "ag")}, "\t")


def _vectornav(folder: Path, chunk: Chunk) -> Path:
    """Writes some thousand sentences again and again, as they hold no time."""
    lines = []
    for force, rate in zip(chunk.accelerometer[:5000].tolist(), chunk.gyroscope[:5000].tolist(), strict=True):
        values = [*(f"{value:+07.3f}" for value in force), *(f"{value:+09.6f}" for value in rate)]
        text = f"VNIMU,+00.1000,+00.2000,+00.3000,{','.join(values)},+24.5,+101.325"
        lines.append(f"${text}*{reduce(lambda left, right: left ^ right, text.encode()):02X}\r\n".encode())
    whole, rest = divmod(len(chunk), len(lines))
    path = folder / "vn100.txt"
    with path.open("wb") as file:
        for _ in range(whole):
            file.writelines(lines)
        file.writelines(lines[:rest])
    return path


def _rostopic(folder: Path, chunk: Chunk) -> Path:
    def nine(name: str) -> dict[str, object]:
        return {f"field.{name}_covariance{number}": np.zeros(len(chunk)) for number in range(9)}

    stamps = _stamps(chunk)
    columns: dict[str, object] = {"%time": stamps, "field.header.stamp": stamps, **nine("orientation")}
    for name, triad in (("angular_velocity", chunk.gyroscope), ("linear_acceleration", chunk.accelerometer)):
        columns |= {f"field.{name}.{axis}": triad[:, number] for number, axis in enumerate(_AXES)} | nine(
            name
        )
    return _table(folder / "imu.csv", ",".join(columns) + "\n", columns)


def _kitti(folder: Path, chunk: Chunk) -> Path:
    oxts = folder / "oxts"
    (oxts / "data").mkdir(parents=True)
    stamps = np.datetime_as_string(np.asarray(_stamps(chunk)).astype("datetime64[ns]"))
    (oxts / "timestamps.txt").write_text("\n".join(stamp.replace("T", " ") for stamp in stamps) + "\n")
    for number, (force, rate) in enumerate(
        zip(chunk.accelerometer.tolist(), chunk.gyroscope.tolist(), strict=True)
    ):
        fields = [*[0.5] * 11, *force, *[0.5] * 3, *rate, *[0.5] * 10]
        (oxts / "data" / f"{number:010d}.txt").write_text(" ".join(map(repr, fields)))
    return oxts


def _read_kitti(oxts: Path) -> object:
    files = sorted((oxts / "data").iterdir())
    stamps = np.array((oxts / "timestamps.txt").read_text().splitlines(), dtype="datetime64[ns]")
    return stamps, np.array([np.array(file.read_text().split(), dtype=np.float64) for file in files])


def _ulog(folder: Path, chunk: Chunk) -> Path:
    """Log as PX4 does, a message of each sensor in turn."""
    fields = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
    topics = ("sensor_accel", "sensor_gyro")
    content = [b"ULog\x01\x12\x35\x01" + bytes(8)]
    bodies = [(b"F", f"{topic}:{fields}".encode()) for topic in topics]
    bodies += [(b"A", bytes((0, number, 0)) + topic.encode()) for number, topic in enumerate(topics)]
    content += [struct.pack("<H", len(body)) + kind + body for kind, body in bodies]
    head = [("size", "<u2"), ("kind", "S1"), ("number", "<u2")]
    record = np.dtype([*head, ("stamps", "<u8", 2), ("device", "<u4"), ("xyz", "<f4", 3)])
    data = np.zeros((len(chunk), len(topics)), record)
    data["size"], data["kind"], data["device"] = record.itemsize - 3, b"D", 7
    data["number"] = np.arange(len(topics))
    data["stamps"] = np.rint(1e6 * chunk.time)[:, np.newaxis, np.newaxis]
    data["xyz"][:, 0], data["xyz"][:, 1] = chunk.accelerometer, chunk.gyroscope
    path = folder / "flight.ulg"
    path.write_bytes(b"".join(content) + data.tobytes())
    return path


def _read_ulog(path: Path) -> object:
    return ULog(str(path), ["sensor_accel", "sensor_gyro"])


def _dataflash(folder: Path, chunk: Chunk) -> Path:
    """Log as ArduPilot does, IMU messages only."""
    kinds = (
        (0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        (0x81, "IMU", "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T", 3 + 8 + 1 + 7 * 4),
    )
    content = b"".join(
        b"\xa3\x95\x80"
        + struct.pack("<BB4s16s64s", kind, size, name.encode(), letters.encode(), columns.encode())
        for kind, name, letters, columns, size in kinds
    )
    head = [("mark", "S2"), ("kind", "u1"), ("time", "<u8"), ("instance", "u1")]
    data = np.zeros(len(chunk), np.dtype([*head, ("gyr", "<f4", 3), ("acc", "<f4", 3), ("t", "<f4")]))
    data["mark"], data["kind"], data["time"] = b"\xa3\x95", 0x81, np.rint(1e6 * chunk.time)
    data["gyr"], data["acc"] = chunk.gyroscope, chunk.accelerometer
    path = folder / "flight.bin"
    path.write_bytes(content + data.tobytes())
    return path


def _tlog(folder: Path, chunk: Chunk) -> Path:
    """Logs the HIGHRES_IMU that a ground station receives."""
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    path = folder / "flight.tlog"
    with path.open("wb") as file:
        for stamp, force, rate in zip(
            np.rint(1e6 * chunk.time).astype(int).tolist(),
            chunk.accelerometer.tolist(),
            chunk.gyroscope.tolist(),
            strict=True,
        ):
            message = mavlink.MAVLink_highres_imu_message(
                stamp, *force, *rate, 0, 0, 0, 0, 0, 0, 25.0, 0xFFFF
            )
            file.write((_EPOCH // 1000 + stamp).to_bytes(8, "big") + message.pack(sender))
    return path


def _read_messages(path: Path, kind: str) -> object:
    log, count = mavutil.mavlink_connection(str(path)), 0
    while log.recv_match(type=kind) is not None:
        count += 1
    log.close()
    return count


def _csv(path: Path, *, lines: int = 0, delimiter: str = ",") -> object:
    read = pa.csv.ReadOptions(skip_rows=lines, autogenerate_column_names=lines > 0)
    return pa.csv.read_csv(path, read_options=read, parse_options=pa.csv.ParseOptions(delimiter=delimiter))


def _labelled(folder: Path, chunk: Chunk) -> Path:
    """Prints as a sketch does for the plotter of the Arduino IDE."""
    names = [f"{triad}{axis.upper()}" for triad in ("Acc", "Gyr") for axis in _AXES]
    path = folder / "monitor.txt"
    with path.open("w") as file:
        for row in np.hstack([chunk.accelerometer, chunk.gyroscope]).tolist():
            file.write(",".join(f"{name}:{value!r}" for name, value in zip(names, row, strict=True)) + "\n")
    return path


def _read_labelled(path: Path) -> object:
    number = re.compile(r":([^,\n]+)")
    return np.array([number.findall(line) for line in path.read_text().splitlines()], dtype=np.float64)


def _json_lines(folder: Path, chunk: Chunk) -> Path:
    names = ["time", *(f"{triad}{axis}" for triad in "ag" for axis in _AXES)]
    path = folder / "log.jsonl"
    with path.open("w") as file:
        for row in np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope]).tolist():
            file.write(json.dumps(dict(zip(names, row, strict=True))) + "\n")
    return path


def _read_json_lines(path: Path) -> object:
    return [json.loads(line) for line in path.read_text().splitlines()]


def _in_g(chunk: Chunk) -> Chunk:
    return Chunk(chunk.time, np.round(chunk.accelerometer / STANDARD_GRAVITY, 9), chunk.gyroscope)


def _picoquake(folder: Path, chunk: Chunk) -> Path:
    names = ["count", *(f"{triad}_{axis}" for triad in "ag" for axis in _AXES)]
    head = f"# PLab PicoQuake Data\n# Config: data_rate = {RATE} Hz\n{','.join(names)}\n"
    return _table(folder / "log.csv", head, {"count": np.arange(len(chunk)), **_columns(_in_g(chunk), "ag")})


def _metawear(folder: Path, chunk: Chunk) -> Path:
    """Writes both files at one rate, as reading at two is bound by interpolation."""
    stamps = np.asarray(_stamps(chunk)) // 1_000_000
    for sensor, unit, triad in (("Gyroscope", "deg/s", "g"), ("Accelerometer", "g", "a")):
        head = f"epoch (ms),{','.join(f'{axis}-axis ({unit})' for axis in _AXES)}\n"
        path = folder / f"log_MetaWear_{sensor}_200.000Hz_1.4.4.csv"
        _table(path, head, {"t": stamps, **_columns(_in_g(chunk), triad)})
    return path


def _read_metawear(path: Path) -> object:
    return [_csv(file) for file in path.parent.iterdir()]


PYARROW = "pyarrow.csv.read_csv"
READERS = {
    "csv": Reader(_recording("CSV"), csv_of_ours, PYARROW),
    "csv.gz": Reader(_packed, csv_of_ours, PYARROW),
    "parquet": Reader(_recording("Parquet"), pa.parquet.read_table, "pyarrow.parquet.read_table"),
    "euroc": Reader(_euroc, lambda path: _csv(path / "imu0" / "data.csv"), PYARROW),
    "xsens": Reader(_xsens, lambda path: _csv(path, lines=3, delimiter="\t"), PYARROW),
    "vectornav": Reader(_vectornav, lambda path: _csv(path, lines=0), PYARROW, timeless=True),
    "ros_echo": Reader(_rostopic, _csv, PYARROW),
    "kitti": Reader(_kitti, _read_kitti, "numpy.array of each file", share=0.02),
    "json_lines": Reader(_json_lines, _read_json_lines, "json.loads", share=0.3),
    "labelled": Reader(_labelled, _read_labelled, "re and numpy", timeless=True, share=0.3),
    "picoquake": Reader(_picoquake, lambda path: _csv(path, lines=3), PYARROW),
    "metawear": Reader(_metawear, _read_metawear, PYARROW, share=0.3),
    "npy, archive": Reader(arrays.numpy_archive(), arrays.read_archive, "numpy.load"),
    "npy, packed archive": Reader(arrays.numpy_archive(packed=True), arrays.read_archive, "numpy.load"),
    "npy": Reader(arrays.numpy_array, np.load, "numpy.load"),
    "mat": Reader(arrays.matlab(), scipy.io.loadmat, "scipy.io.loadmat"),
    "mat, packed": Reader(arrays.matlab(packed=True), scipy.io.loadmat, "scipy.io.loadmat"),
    "hdf5": Reader(arrays.hdf5(), arrays.read_hdf5, "h5py"),
    "hdf5, packed": Reader(arrays.hdf5(packed=True), arrays.read_hdf5, "h5py"),
    "feather": Reader(arrays.feather, pa.feather.read_table, "pyarrow.feather.read_table"),
    "mcap, json": Reader(arrays.json_messages, arrays.read_json, "mcap and json", share=0.3),
    "mcap, protobuf": Reader(arrays.protobuf_messages, arrays.read_protobuf, "mcap_protobuf", share=0.3),
    "ulog": Reader(_ulog, _read_ulog, "pyulog"),
    "dataflash": Reader(_dataflash, partial(_read_messages, kind="IMU"), "pymavlink", share=0.1),
    "tlog": Reader(_tlog, partial(_read_messages, kind="HIGHRES_IMU"), "pymavlink", share=0.1),
}
"""Readers that are measured, by the name of the format."""


def read_all(path: Path, *, timeless: bool) -> int:
    """Passes over all samples, checked and in SI units."""
    options = tumble.ReadOptions(rate=RATE if timeless else None)
    return sum(len(chunk) for chunk in tumble.open_recording(path, options).chunks())


def made_up(count: int) -> Chunk:
    """Simulates samples of a unit at rest, in nine decimals."""
    random = np.random.default_rng(SEED)
    force = np.round(random.normal([0.1, -0.2, 9.8], 0.02, (count, 3)), 9)
    return Chunk(np.arange(count) / RATE, force, np.round(random.normal(0.0, 0.01, (count, 3)), 9))


def _peak(path: Path, *, timeless: bool) -> int:
    """Peak resident memory, bytes, of a fresh process that reads a recording."""
    command = [sys.executable, "-m", "benchmarks.readers", "--read", str(path)]
    run = subprocess.run(
        [*command, *(["--timeless"] if timeless else [])],
        check=True, capture_output=True, text=True, cwd=Path(__file__).parent.parent,
    )  # fmt: skip
    return int(run.stdout)


def measure_one(reader: Reader, samples: int, repetitions: int) -> Content:
    """Time one format, and find the memory of a file and of one ten times as long."""
    counts = [round(samples * reader.share / LONGER), round(samples * reader.share)]
    peaks, found, size = [], {}, 0
    for count in counts:
        with tempfile.TemporaryDirectory() as folder:
            path = reader.write(Path(folder), made_up(count))
            peaks.append(_peak(path, timeless=reader.timeless))
            if count == counts[-1]:
                size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
                if read_all(path, timeless=reader.timeless) != count:
                    raise RuntimeError(f"{path}: not all of {count} samples were read")
                found = side_by_side(
                    partial(read_all, path, timeless=reader.timeless),
                    {reader.library: partial(reader.bare, path)},
                    repetitions,
                )
    return found | {
        "bytes": size,
        "megabytes_a_second": size / 1e6 / found["seconds"]["ours"],
        "samples": counts,
        "peak_bytes": peaks,
        "growth": peaks[1] / peaks[0],
    }


def table(content: Content) -> Table:
    """Figures as a table on screen."""
    shown = Table("format", "MB/s", "against", "ratio", "least and most", "growth", title="readers")
    for name, of in content["formats"].items():
        for other, ratio in of["ratios"].items():
            low, high = of["spread"][other]
            marked = f"{ratio:.2f}" if ratio <= LARGEST_RATIO else f"[bold red]{ratio:.2f}[/]"
            growth = f"{100 * (of['growth'] - 1.0):+.0f} %"
            marked_growth = growth if of["growth"] <= LARGEST_GROWTH else f"[bold red]{growth}[/]"
            speed = f"{of['megabytes_a_second']:.0f}"
            shown.add_row(name, speed, other, marked, f"{low:.2f} {high:.2f}", marked_growth)
    return shown


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiny", action="store_true", help="only see that it runs")
    parser.add_argument("--no-save", action="store_true", help="print only")
    parser.add_argument("--only", choices=READERS, help="measure one format anew, and keep the others")
    parser.add_argument("--read", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--timeless", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.read:
        read_all(options.read, timeless=options.timeless)
        print(peak_here())
        return {}
    console = Console()
    samples, repetitions = (5000, 2) if options.tiny else (1_000_000, 7)
    content: Content = {"machine": machine(), "seed": SEED, "formats": {}}
    if options.only and not options.no_save:
        content["formats"] = load("readers")["formats"]
    for name in [options.only] if options.only else READERS:
        content["formats"][name] = measure_one(READERS[name], samples, repetitions)
        console.print(f"{name} done")
    console.print(table(content))
    if not options.no_save:
        console.print(f"written to {save('readers', content)}")
    return content


if __name__ == "__main__":
    main()
