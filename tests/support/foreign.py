"""Recordings of others, held equal to what an independent reader finds in them: `make foreign FOLDER=...`.

FOLDER holds each file as OWNER+NAME/PATH, at the commit and with the checksum of `foreign.toml`; absent files
are listed as such. Independent readers are pyulog, pymavlink, rosbags, and the csv module of Python.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import yaml

from tumble.logs import ReadOptions, open_recording

G, DEGREE = 9.80665, np.pi / 180.0
SCALE = {"m/s^2": 1.0, "g": G, "rad/s": 1.0, "deg/s": DEGREE}
CLOSE = 1e-5
"""m/s^2 and rad/s: float32 of the logs, and constants of gravity with six digits."""


def pyulog(path, row):
    from pyulog import ULog

    data = next(each.data for each in ULog(str(path)).data_list if each.name == row["imu"])
    names = [f"accelerometer_m_s2[{axis}]" for axis in range(3)] + [f"gyro_rad[{axis}]" for axis in range(3)]
    return np.column_stack([data[name] for name in names])


def pymavlink(path, row):
    from pymavlink import DFReader

    log, rows = DFReader.DFReader_binary(str(path)), []
    while (message := log.recv_match(type=["IMU"])) is not None:
        if getattr(message, "I", 0) == 0:
            rows.append([getattr(message, name) for name in ("AccX", "AccY", "AccZ", "GyrX", "GyrY", "GyrZ")])
    log.close()
    return np.array(rows)


def mavutil(path, row):
    from pymavlink import mavutil as library

    log, rows = library.mavlink_connection(str(path)), []
    while (message := log.recv_match(type=row["imu"])) is not None:
        names = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
        rows.append([message.time_usec, *(1e-3 * getattr(message, name) for name in names)])
    log.close()
    rows = np.array(rows)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return rows[:, 1:] * [G, G, G, 1.0, 1.0, 1.0]


def rosbags(path, row):
    from rosbags.highlevel import AnyReader

    rows = []
    with AnyReader([path]) as bag:
        for connection, _, data in bag.messages(
            [each for each in bag.connections if each.topic == row["imu"]]
        ):
            message = bag.deserialize(data, connection.msgtype)
            force, rate = message.linear_acceleration, message.angular_velocity
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            rows.append([stamp, force.x, force.y, force.z, rate.x, rate.y, rate.z])
    rows = np.array(rows)
    return rows[np.argsort(rows[:, 0], kind="stable"), 1:]


def table(path, row):
    return _numbers(path, row["columns"]) * _scale(row)


def pair(path, row):
    """Accelerometer at the times of the gyroscope, which stands in a file of its own, by straight lines."""
    force, turns = (
        rows[np.isfinite(rows).all(axis=1)]
        for rows in (_numbers(path, row["columns"]), _numbers(partner_of(path, row), row["columns"]))
    )
    turns = turns[(turns[:, 0] >= force[0, 0]) & (turns[:, 0] <= force[-1, 0])]
    brought = [np.interp(turns[:, 0], force[:, 0], force[:, axis]) for axis in (1, 2, 3)]
    return np.column_stack([*brought, turns[:, 1:]]) * _scale(row)


def partner_of(path, row):
    return path.parents[row["path"].count("/")] / row["partner"]


def _numbers(path, columns):
    text = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    sample = text[len(text) // 2]
    mark = next((each for each in ",;\t" if each in sample), None)
    lines = csv.reader(text, delimiter=mark) if mark else map(str.split, text)
    rows = []
    for fields in lines:
        try:
            rows.append([float(fields[column]) for column in columns])
        except (ValueError, IndexError):
            continue
    return np.array(rows)


def _scale(row):
    return [SCALE[row.get("accelerometer", "m/s^2")]] * 3 + [SCALE[row.get("gyroscope", "rad/s")]] * 3


LIST = Path(__file__).parents[1] / "foreign.toml"
READERS = {each.__name__: each for each in (pyulog, pymavlink, mavutil, rosbags, table, pair)}


def ours(path, row):
    """Returns format and (n, 6) samples as Tumble reads them, and how many it left out as repeated."""
    options = ReadOptions(rate=row.get("rate"), interpolate="partner" in row, **units(row))
    recording = open_recording(f"{path}:{row['imu']}" if row.get("imu") else path, options)
    stream = recording.chunks()
    samples = np.vstack([np.hstack([chunk.accelerometer, chunk.gyroscope]) for chunk in stream])
    return recording.metadata.format, samples, stream.counts.duplicates


def checksum(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def units(row):
    """Returns the units that a reader has to be given; those that are stated in the file it finds itself."""
    if row.get("stated"):
        return {}
    return {f"{triad}_unit": row[triad] for triad in ("accelerometer", "gyroscope") if triad in row}


def verdict(path, row):
    """Compares one file; returns its format, the number of samples and the finding."""
    if not path.is_file():
        return "", 0, "absent"
    files = {path: row["sha256"]} | (
        {partner_of(path, row): row["partner_sha256"]} if "partner" in row else {}
    )
    if any(not each.is_file() or checksum(each) != expected for each, expected in files.items()):
        return "", 0, "another version"
    format_, samples, repeated = ours(path, row)
    theirs = READERS[row["reader"]](path, row)
    if len(theirs) != len(samples) + repeated:
        return format_, len(samples), f"differs: {len(theirs)} samples by {row['reader']}"
    if repeated:
        return format_, len(samples), f"equal but for {repeated} repeated stamps"
    largest = float(np.abs(samples - theirs).max())
    return format_, len(samples), "equal" if largest < CLOSE else f"differs by {largest:.3g}"


def rows_of(path):
    """Reads the list: blocks of `key = value`, each after `[[file]]`."""
    blocks = path.read_text(encoding="utf-8").split("[[file]]\n")[1:]
    return [
        {key: yaml.safe_load(value) for key, _, value in map(_parted, block.splitlines()) if key}
        for block in blocks
    ]


def _parted(line):
    return line.partition(" = ")


def main() -> int:
    """Prints a table of all files; exits code 1 where one differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--table", type=Path, help="page whose table is written anew")
    arguments = parser.parse_args()
    found, lines = Counter(), ["| file | format | samples | against | finding |", "|---|---|---|---|---|"]
    for row in rows_of(LIST):
        path = arguments.folder / row["repository"].replace("/", "+") / row["path"]
        try:
            format_, samples, finding = verdict(path, row)
        except Exception as error:
            format_, samples, finding = "", 0, f"fails: {type(error).__name__}: {error}"
        found[finding.split()[0]] += 1
        name = f"{row['repository']}: {row['path']}"
        lines.append(f"| {name} | {format_} | {samples or ''} | {row['reader']} | {finding} |")
    print("\n".join(lines))
    print(", ".join(f"{count} {what}" for what, count in found.items()), file=sys.stderr)
    if arguments.table is not None:
        head, mark, rest = arguments.table.read_text(encoding="utf-8").partition("<!-- foreign -->\n")
        _, end, tail = rest.partition("<!-- end of foreign -->")
        text = head + mark + "\n".join(lines) + "\n" + end + tail
        arguments.table.write_text(text, encoding="utf-8")
    return int(any(what.startswith(("differs", "fails")) for what in found))


if __name__ == "__main__":
    sys.exit(main())
