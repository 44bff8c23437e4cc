"""Lines of JSON are read by their names and units, whatever their order, as live sources read them."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

from log_fixtures import made_up, read, refusal
from tumble.logs import ReadOptions, open_recording

NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz")
RAD_S = ReadOptions(gyroscope_unit="rad/s")


def table(count=300):
    """(n, 7) samples."""
    chunk = made_up(count, seed=5)
    return np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])


def flat(row):
    return dict(zip(NAMES, row.tolist(), strict=True))


def in_units(row):
    """The same in other units, which the names state."""
    scales = (1e3, *[1.0 / 9.80665] * 3, *[180.0 / np.pi] * 3)
    names = ("time_ms", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps")
    return {name: value * scale for name, value, scale in zip(names, row.tolist(), scales, strict=True)}


def nested(row):
    values = row.tolist()
    return {"imu": {"gyro": values[4:], "acc": values[1:4]}, "ok": True, "note": "1 2 3", "t": values[0]}


def of_ros(row):
    values = row.tolist()
    seconds, rest = divmod(round(values[0] * 1e9), 10**9)
    return {
        "header": {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": "imu"},
        "angular_velocity": dict(zip("xyz", values[4:], strict=True)),
        "linear_acceleration": dict(zip("xyz", values[1:4], strict=True)),
    }


def written(path, lines, opening=""):
    path.write_text(opening + "".join(f"{line}\n" for line in lines))
    return path


@pytest.mark.parametrize("object_of", [flat, in_units, nested, of_ros])
def test_objects_are_read_by_names_and_units(tmp_path, object_of):
    rows = table()
    path = written(tmp_path / "log.jsonl", (json.dumps(object_of(row)) for row in rows))
    found = read(path, RAD_S if object_of is not in_units else ReadOptions())
    assert np.allclose(found.time, rows[:, 0], atol=1e-9)
    assert np.allclose(found.accelerometer, rows[:, 1:4])
    assert np.allclose(found.gyroscope, rows[:, 4:])
    assert open_recording(path, RAD_S).metadata.format == "json_lines"


def test_fields_in_another_order_are_those_of_their_names(tmp_path):
    rows = table()
    objects = [flat(row) for row in rows]
    mixed = [dict(reversed(list(each.items()))) if k % 2 else each for k, each in enumerate(objects)]
    found = read(written(tmp_path / "log.txt", map(json.dumps, mixed)), RAD_S)
    assert np.allclose(found.time, rows[:, 0])
    assert np.allclose(found.accelerometer, rows[:, 1:4])
    assert np.allclose(found.gyroscope, rows[:, 4:])


def test_an_array_with_an_object_a_line_and_a_packed_log_are_read(tmp_path):
    rows = table()
    lines = [json.dumps(flat(row)) for row in rows]
    text = "[" + ",\n".join(lines) + "]\n"
    (tmp_path / "log.json").write_text(text)
    (tmp_path / "log.jsonl.gz").write_bytes(gzip.compress("\n".join(lines).encode()))
    for name in ("log.json", "log.jsonl.gz"):
        assert np.allclose(read(tmp_path / name, RAD_S).accelerometer, rows[:, 1:4])


def test_units_of_a_log_are_those_of_a_field_or_a_key(tmp_path):
    rows = table()
    by_field = (
        json.dumps({"unit": unit, **flat(row + shift)})
        for row in rows
        for unit, shift in (("left", 0.0), ("right", 1.0))
    )
    by_key = (json.dumps({"left": flat(row), "right": flat(row + 1.0)}) for row in rows)
    for name, lines in (("field.jsonl", by_field), ("key.jsonl", by_key)):
        path = written(tmp_path / name, lines)
        assert "left, right" in refusal(path, RAD_S)
        assert np.allclose(read(f"{path}:right", RAD_S).accelerometer, rows[:, 1:4] + 1.0)


def test_a_magnetometer_that_is_read_less_often_has_its_times(tmp_path):
    rows = table()
    field = {"mx_uT": 20.0, "my_uT": -5.0, "mz_uT": 40.0}
    lines = (json.dumps({**flat(row), **({} if k % 10 else field)}) for k, row in enumerate(rows))
    track = open_recording(written(tmp_path / "log.jsonl", lines), RAD_S).magnetic
    assert track is not None
    assert np.allclose(track.time, rows[::10, 0])
    assert np.allclose(track.field, [20.0, -5.0, 40.0])


def test_other_lines_and_objects_are_left_out_and_named(tmp_path):
    rows = table()
    lines = [json.dumps(flat(row)) for row in rows]
    lines[100:100] = ['{"status": "ok", "battery": 3.9}', lines[100][:40]]
    path = written(tmp_path / "log.jsonl", lines, opening="booting\n")
    assert np.allclose(read(path, RAD_S).accelerometer, rows[:, 1:4])
    remarks = " ".join(open_recording(path, RAD_S).metadata.remarks)
    assert "skipped 1 line before the first sample" in remarks
    lines[50:50] = ["no object"] * 20
    assert "line 52 reads 'no object', which is no object of JSON" in refusal(
        written(tmp_path / "bad.jsonl", lines, opening="booting\n"), RAD_S
    )


@pytest.mark.parametrize(
    "text",
    [
        '{"ax": 1, "ay": 2, "az": 9.8}\n',
        '{\n "rows": [\n  {"ax": 1}\n ]\n}\n',
        "[" * 5000 + "\n" + "{" * 5000 + "\n",
    ],
)
def test_a_document_of_json_is_no_log(tmp_path, text):
    (tmp_path / "log.json").write_text(text)
    assert "JSON" in refusal(tmp_path / "log.json") or "not a log" in refusal(tmp_path / "log.json")
