"""Rows of several IMUs in one file, distinguished by a column: each label is an IMU of its own."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from log_fixtures import read, refusal
from message_fixtures import write_messages
from tumble.foundation.errors import LogError
from tumble.foundation.recording import Chunk
from tumble.logs import ReadOptions, list_imus, open_recording

RANDOM = np.random.default_rng(7)
ROWS = 900
NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz")


def table_of(labels, **more):
    """Samples of IMUs that take turns, with the label of each row."""
    numbers = RANDOM.normal(size=(ROWS, 6)).round(6)
    numbers[:, 2] += 9.8
    columns = dict(zip(NAMES, [np.arange(ROWS) * 0.005, *numbers.T], strict=True))
    return {"sensor_id": np.resize(labels, ROWS), **columns, **more}


NUMBERED = table_of([1, 2, 2])
WORDED = table_of(["left", "right"])


def mcap(path, table):
    rows = pd.DataFrame(table).to_dict("records")
    write_messages(path, "json", [(k, json.dumps(row).encode()) for k, row in enumerate(rows)], topic="/imu")


def hdf5(path, table):
    with h5py.File(path, "w") as file:
        for name, values in table.items():
            file.create_dataset(name, data=values)


def labelled(path, table):
    rows = pd.DataFrame(table).to_dict("records")
    path.write_text("".join(" ".join(f"{name}: {row[name]}" for name in row) + "\n" for row in rows))


def json_lines(path, table):
    rows = pd.DataFrame(table).to_dict("records")
    path.write_text("".join(f"{json.dumps(row)}\n" for row in rows))


WRITERS = {
    "log.csv": lambda path, table: pd.DataFrame(table).to_csv(path, index=False),
    "log.tsv": lambda path, table: pd.DataFrame(table).to_csv(path, index=False, sep="\t"),
    "log.csv.gz": lambda path, table: pd.DataFrame(table).to_csv(path, index=False),
    "log.parquet": lambda path, table: pd.DataFrame(table).to_parquet(path),
    "log.feather": lambda path, table: pd.DataFrame(table).to_feather(path),
    "log.mcap": mcap,
    "log.npz": lambda path, table: np.savez(path, **table),
    "log.npy": lambda path, table: np.save(path, pd.DataFrame(table).to_records(index=False)),
    "log.mat": lambda path, table: scipy.io.savemat(path, table),
    "log.h5": hdf5,
    "log.txt": labelled,
    "log.jsonl": json_lines,
}
OF_TEXT = ("log.csv", "log.tsv", "log.csv.gz", "log.parquet", "log.feather", "log.mcap", "log.jsonl")


def written(folder, name, table):
    WRITERS[name](folder / name, table)
    return folder / name


def rows_of(table, label) -> Chunk:
    mine = {name: np.asarray(values)[table["sensor_id"] == label] for name, values in table.items()}
    force, rate = (np.column_stack([mine[f"{letter}{axis}"] for axis in "xyz"]) for letter in "ag")
    return Chunk(mine["time"], force, rate)


def assert_read(found, expected):
    assert np.array_equal(found.accelerometer, expected.accelerometer)
    assert np.array_equal(found.gyroscope, expected.gyroscope)


CASES = [(name, NUMBERED, (1, 2)) for name in WRITERS] + [
    (name, WORDED, ("left", "right")) for name in OF_TEXT
]


@pytest.mark.parametrize(("name", "table", "labels"), CASES)
def test_each_label_of_rows_is_an_imu_of_its_own(tmp_path, name, table, labels):
    path = written(tmp_path, name, table)
    stated = ReadOptions(gyroscope_unit="rad/s", accelerometer_unit="m/s^2")
    names = list_imus(path)
    assert [each.removeprefix("/imu.") for each in names] == [str(label) for label in labels]
    assert refusal(path) == (
        f"{path}: column sensor_id distinguishes 2 IMUs: name one, as {path.name}:{names[0]} "
        f"(found: {', '.join(names)}), or rename the column if it names no IMU"
    )
    assert refusal(f"{path}:third").endswith(f"found: {', '.join(names)}")
    for label, each in zip(labels, names, strict=True):
        assert_read(read(f"{path}:{each}", stated), rows_of(table, label))
        recording = open_recording(f"{path}:{each}", stated)
        assert not recording.metadata.alone
        assert recording.metadata.source == f"{path}:{each}"


def test_each_label_of_a_data_frame_is_an_imu_of_its_own():
    stated = ReadOptions(gyroscope_unit="rad/s", accelerometer_unit="m/s^2")
    for table in (NUMBERED, WORDED):
        frame = pd.DataFrame(table)
        with pytest.raises(LogError, match=r"column sensor_id distinguishes 2 IMUs.*ReadOptions\(topic="):
            open_recording(frame, stated)
        for label in sorted(set(table["sensor_id"].tolist())):
            named = ReadOptions(topic=str(label), gyroscope_unit="rad/s", accelerometer_unit="m/s^2")
            (chunk,) = open_recording(frame, named).chunks()
            assert_read(chunk, rows_of(table, label))


@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "log.h5", "log.mcap"])
@pytest.mark.parametrize(
    "labels",
    [[7], np.arange(ROWS), np.arange(ROWS) % 256, [7] * (ROWS - 1) + [8], RANDOM.normal(size=ROWS).round(1)],
    ids=["one value", "counter", "counter of a byte", "one torn row", "fractions"],
)
def test_a_column_of_no_small_set_of_labels_changes_nothing(tmp_path, name, labels):
    table = table_of(labels)
    path = written(tmp_path, name, table)
    assert len(list_imus(path)) == 1
    assert len(read(path).time) == ROWS


def test_a_column_of_another_name_is_no_label(tmp_path):
    table = table_of([1, 2])
    table["step"] = table.pop("sensor_id")
    assert list_imus(written(tmp_path, "log.csv", table)) == ("",)


def test_labels_and_prefixes_name_an_imu_together(tmp_path):
    table = table_of([1, 2])
    second = {f"b_{name}": table[name] + 1.0 for name in NAMES[1:]}
    first = {f"a_{name}": table[name] for name in NAMES[1:]}
    path = written(tmp_path, "log.csv", {"id": table["sensor_id"], "time": table["time"], **first, **second})
    assert list_imus(path) == ("a.1", "a.2", "b.1", "b.2")
    assert "name one, as log.csv:a.1" in refusal(path)
    assert len(read(f"{path}:b.2").time) == ROWS // 2


def test_an_error_in_a_row_of_a_label_names_its_line(tmp_path):
    table = table_of([1, 2])
    table["time"][701] = table["time"][3]
    path = written(tmp_path, "log.csv", table)
    assert "line 703" in refusal(f"{path}:2")


def test_lines_left_out_leave_labels_to_their_rows(tmp_path):
    path = written(tmp_path, "log.csv", NUMBERED)
    lines = path.read_text().splitlines()
    lines[5] = lines[5].replace(",", ",x", 3)
    path.write_text("\n".join(lines) + "\n")
    kept = np.delete(np.arange(ROWS), 4)
    found = read(f"{path}:2", ReadOptions(skip_bad_lines=True, gyroscope_unit="rad/s"))
    assert_read(found, rows_of({name: values[kept] for name, values in NUMBERED.items()}, 2))


def test_rows_of_each_imu_in_a_block_of_its_own_are_told_apart(tmp_path):
    table = table_of([1, 2])
    table["sensor_id"] = np.sort(table["sensor_id"])
    path = written(tmp_path, "log.csv", table)
    assert len(read(f"{path}:2").time) == ROWS // 2


def test_a_magnetometer_keeps_to_the_rows_of_its_imu(tmp_path):
    field = RANDOM.normal(size=(ROWS, 3)).round(3) + 30.0
    table = table_of([1, 2], **{f"mag_{axis} [uT]": field[:, k] for k, axis in enumerate("xyz")})
    path = written(tmp_path, "log.parquet", table)
    magnetic = open_recording(f"{path}:2").magnetic
    assert np.array_equal(magnetic.field, field[1::2])
