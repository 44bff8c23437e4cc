"""Logs that unpack, compute or link to more than their bytes hold: one line, in bounded memory and time."""

from __future__ import annotations

import os
import shutil
import sqlite3
import struct
import tempfile
import zipfile
import zlib
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import h5py
import lz4.frame
import numpy as np
import pyarrow as pa
import pyarrow.ipc
import pyarrow.parquet as pq
import pytest
import scipy.io
from google.protobuf import descriptor_pb2
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import storage_mcap

from bag_fixtures import write_ros2
from hostile import read_or_refuse
from hostile_places import patient
from log_fixtures import made_up, read, write_text
from message_fixtures import write_messages
from tumble.foundation.errors import LogError
from tumble.foundation.units import CHANNELS
from tumble.logs import csv, formats, list_imus, npy
from tumble.logs.bounded_bags import BoundedZstd, unpacked_lz4, unpacked_zstd
from tumble.logs.columns import find_imus
from tumble.logs.feather_sizes import largest_unpacked
from tumble.logs.options import ReadOptions
from turntable_sessions import one_line, typed

ATTACKS = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "attack"
MOST = 64 << 20
"""Bytes of memory for any of these, which are small."""


def refused(path):
    """The line in which a log is refused, without more memory than it needs."""
    with patient(), pytest.raises(LogError) as caught:
        list_imus(path, ReadOptions())
    assert "\n" not in str(caught.value)
    with patient():
        assert read_or_refuse(path) < MOST
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bag-type-is-blob.db3", "a topic or type is bytes, no text"),
        ("bag-data-is-text.db3", "a message is str, no bytes"),
        ("bag-generated-900MB.db3", "column 'data' of messages is computed, as in no bag"),
        ("bag-newline-in-topic.db3", r"topic /\ntumble: error: all is well holds no messages"),
        ("overflow-v4.mat", "212 of 400 samples are what no sensor reads"),
    ],
)
def test_attacks_of_the_past_are_one_line(name, words):
    if not ATTACKS.is_dir():
        pytest.skip(f"{ATTACKS} is not there")
    with patient():
        done = typed("inspect", ATTACKS / name)
    assert (done.code, done.out) == (2, "")
    assert words in one_line(done.err)


def test_a_serial_that_is_no_text_is_read_escaped():
    if not ATTACKS.is_dir():
        pytest.skip(f"{ATTACKS} is not there")
    done = typed("inspect", ATTACKS / "parquet-serial-not-utf8.parquet")
    assert done.code == 0, done.err
    assert r"\xff" in done.out


def bag(path, *statements):
    """A bag of ROS 2 in which a database states more than rows."""
    with sqlite3.connect(path) as database:
        for each in (
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
            *statements,
        ):
            database.execute(each)
    database.close()
    return path


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        (
            ["CREATE TABLE rows(n)", "CREATE VIEW messages AS SELECT n AS id FROM rows"],
            "missing tables|has a view 'messages'",
        ),
        (
            [
                "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, "
                "data BLOB AS (zeroblob(900000000)) STORED)"
            ],
            "column 'data' of messages is computed",
        ),
        (
            [
                "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)",
                "CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM topics; END",
            ],
            "has a trigger 't'",
        ),
    ],
)
def test_a_database_that_computes_is_no_bag(tmp_path, statements, words):
    with pytest.raises(LogError, match=words):
        list_imus(bag(tmp_path / "bag.db3", *statements), ReadOptions())


def test_a_pipe_in_a_bag_is_never_read(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    os.mkfifo(folder / "metadata.yaml")
    assert "is a device or a pipe, not a part of a log" in refused(folder)
    (folder / "metadata.yaml").unlink()
    (folder / "metadata.yaml").write_text("[" * 100_000)
    assert "is nested more than 64 levels deep" in refused(folder)


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def matrix(name, rows):
    """A matrix of zeros of version 5."""
    parts = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", rows, 1))
    return element(14, parts + element(1, name) + element(9, bytes(8 * rows)))


HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"


@pytest.mark.parametrize("size", [1 << 22, 40 << 20])
def test_zeros_behind_the_variables_of_matlab_are_refused(tmp_path, size):
    path = tmp_path / "log.mat"
    path.write_bytes(HEAD + matrix(b"ax", 400))
    with path.open("r+b") as file:
        file.truncate(size)
    assert "no variable of MATLAB begins at byte" in refused(path)


def test_variables_of_matlab_unpack_within_a_budget(tmp_path, monkeypatch):
    path = tmp_path / "log.mat"
    packed = zlib.compress(matrix(b"ax", 8 << 20), 9)
    path.write_bytes(HEAD + 20 * (struct.pack("<II", 15, len(packed)) + packed))
    written = []
    real = tempfile.TemporaryFile
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **how: written.append(real(**how)) or written[-1])
    assert "its variables unpack to more than readings do" in refused(path)
    assert sum(os.fstat(each.fileno()).st_size for each in written) < 300 << 20


def test_chunks_of_hdf5_take_memory_within_a_budget(tmp_path):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        for name in ("time", "ax", "ay", "az", "gx", "gy", "gz"):
            made = file.create_dataset(name, (4 << 20,), float, chunks=(4 << 20,), compression="gzip")
            made[:] = np.zeros(4 << 20)
    assert path.stat().st_size < 1 << 20
    assert "its chunks take more memory than the readings of such a file" in refused(path)


def feather(path, *columns, packed="zstd"):
    """A Feather file of IMU columns in one batch, and of others."""
    names = [*CHANNELS, *(f"other_{number}" for number in range(len(columns) - len(CHANNELS)))]
    table = pa.table(list(columns), names)
    with pa.OSFile(str(path), "wb") as file:
        options = pa.ipc.IpcWriteOptions(compression=packed)
        with pa.ipc.new_file(file, table.schema, options=options) as writer:
            writer.write_table(table)
    return path


def test_batches_of_feather_take_memory_within_a_budget(tmp_path):
    zeros = pa.array(np.zeros(3_000_000))
    path = feather(tmp_path / "a.feather", *[zeros] * len(CHANNELS))
    assert path.stat().st_size < 100_000
    assert "a batch unpacks to" in refused(path)
    # Nothing is packed, and the file takes as much itself.
    path = feather(tmp_path / "b.feather", *[zeros] * len(CHANNELS), packed=None)
    assert largest_unpacked(path.open("rb")) < path.stat().st_size


@pytest.mark.parametrize("stated", [-5, 3 << 30, 1 << 40, 1 << 62])
def test_lengths_of_feather_that_lie_are_one_line(tmp_path, stated):
    path = feather(tmp_path / "a.feather", *[pa.array(np.zeros(5000))] * len(CHANNELS))
    whole = path.read_bytes()
    path.write_bytes(whole.replace(struct.pack("<q", 40_000), struct.pack("<q", stated)))
    assert path.read_bytes() != whole
    refused(path)


@contextmanager
def measured_pool():
    """Gives the pool from which pyarrow takes its memory while the block runs."""
    before = pa.default_memory_pool()
    pool = pa.proxy_memory_pool(before)
    pa.set_memory_pool(pool)
    try:
        yield pool
    finally:
        pa.set_memory_pool(before)


@pytest.mark.parametrize("kind", ["feather", "parquet"])
def test_a_text_that_stands_for_many_is_no_memory(tmp_path, kind):
    text = pa.DictionaryArray.from_arrays(pa.array(np.zeros(3000, np.int32)), pa.array(["x" * (1 << 18)]))
    columns = [pa.array(np.zeros(3000))] * (len(CHANNELS) - 1)
    path = tmp_path / f"a.{kind}"
    if kind == "feather":
        feather(path, text, *columns)
    else:
        pq.write_table(pa.table([text, *columns], list(CHANNELS)), path)
    with measured_pool() as pool:
        assert read_or_refuse(path) < MOST
    assert pool.max_memory() < MOST


@pytest.mark.parametrize("is_dictionary", [False, True])
def test_texts_of_parquet_take_memory_within_a_budget(tmp_path, is_dictionary):
    text = pa.array(["1" * (1 << 18)] * 1000)
    columns = [pa.array(np.zeros(1000))] * (len(CHANNELS) - 1)
    path = tmp_path / "a.parquet"
    table = pa.table([text, *columns], list(CHANNELS))
    pq.write_table(table, path, compression="zstd", use_dictionary=is_dictionary)
    assert path.stat().st_size < 400_000
    with measured_pool() as pool:
        assert read_or_refuse(path) < MOST
    assert pool.max_memory() < MOST


def test_pages_of_parquet_take_memory_within_a_budget(tmp_path):
    path = tmp_path / "a.parquet"
    count = 4 << 20
    column = pa.array(np.zeros(count))
    table = pa.table(dict.fromkeys(("time", *CHANNELS), column))
    options = {"use_dictionary": False, "write_statistics": False, "row_group_size": count}
    for one_page in ({"data_page_size": 1 << 30, "max_rows_per_page": count, "write_batch_size": count}, {}):
        pq.write_table(table, path, compression="zstd", **options, **one_page)
        assert path.stat().st_size < 1 << 18
        with measured_pool() as pool:
            if one_page:
                assert "pages unpack to more than 128 MiB; write smaller ones" in refused_when_read(path)
            else:
                read_or_refuse(path)
        assert pool.max_memory() < MOST


def test_texts_stated_by_their_difference_to_the_last_are_refused(tmp_path):
    path = tmp_path / "a.parquet"
    texts = ["1" * (1 << 20) + str(number) for number in range(100)]
    columns = [pa.array(np.zeros(100))] * (len(CHANNELS) - 1)
    table = pa.table([pa.array(texts), *columns], list(CHANNELS))
    coded = {"use_dictionary": False, "column_encoding": {CHANNELS[0]: "DELTA_BYTE_ARRAY"}}
    pq.write_table(table, path, compression="zstd", **coded)
    assert path.stat().st_size < 1 << 18
    assert "write it without DELTA_BYTE_ARRAY" in refused_when_read(path)


def refused_when_read(path):
    """The line in which the samples of a log are refused."""
    with pytest.raises(LogError) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_is_packed_in_bags_unpacks_within_a_budget(tmp_path):
    zstd = storage_mcap.zstd
    for size in (1 << 20, 1 << 30):
        small = zstd.compress(bytes(1 << 20))
        with pytest.raises(ValueError, match="unpacks to too much"):
            unpacked_zstd(small, (1 << 20) - 1)
        with pytest.raises(ValueError, match="no end, or unpacks"):
            unpacked_zstd(small[:-4], size)
    assert unpacked_zstd(zstd.compress(b"reading"), 7) == b"reading"
    assert unpacked_lz4(lz4.frame.compress(b"reading"), 7) == b"reading"
    with pytest.raises(ValueError, match="unpacks to too much"):
        unpacked_lz4(lz4.frame.compress(bytes(1 << 20)), 1000)
    bounded = BoundedZstd(zstd)
    assert bounded.decompress(zstd.compress(b"reading")) == b"reading"
    with pytest.raises(ValueError, match="unpacks to too much"):
        bounded.decompress(zstd.compress(bytes((1 << 24) + 1)))
    path = tmp_path / "bag.db3.zstd"
    path.write_bytes(zstd.compress(bytes(160 << 20)))
    with (
        path.open("rb") as file,
        bounded.open(file, "rb") as stream,
        pytest.raises(ValueError, match="readings"),
    ):
        shutil.copyfileobj(stream, (tmp_path / "unpacked").open("wb"))


def test_the_directory_of_an_archive_is_read_once_for_all_arrays(tmp_path, monkeypatch):
    path = tmp_path / "log.npz"
    np.savez(
        path, **{f"imu{number}_{triad}": np.ones((4, 3)) for number in range(50) for triad in ("acc", "gyro")}
    )
    opened = []
    whole = zipfile.ZipFile._RealGetContents
    monkeypatch.setattr(
        zipfile.ZipFile, "_RealGetContents", lambda archive: (opened.append(1), whole(archive))[1]
    )
    npy.list_imus(path, ReadOptions())
    assert len(opened) == 1


def test_the_words_of_a_library_on_a_damaged_file_are_bounded(tmp_path):
    path = tmp_path / "a.npy"
    head = b"(" * 3000 + b")" * 3000 + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head)
    assert len(refused(path)) < 500 + len(str(path))


def test_an_archive_with_an_array_twice_is_refused(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, acc=np.ones((4, 3)))
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("acc.npy", archive.read("acc.npy"))
    assert "holds 'acc.npy' twice" in refused(path)


def test_many_imus_of_a_table_are_found_in_time():
    with patient():
        found = find_imus(
            [f"i{number}_{channel}" for number in range(4000) for channel in CHANNELS], "log.csv"
        )
    assert len(found) == 4000


def test_damage_behind_the_beginning_of_any_log_is_one_line(tmp_path, monkeypatch):
    path = write_text(tmp_path / "log.csv", made_up(200), header="time,ax,ay,az,gx,gy,gz")
    log = csv.open_logged_imu(path, None, ReadOptions())

    def read(transform):
        yield next(log.read(transform))
        raise IndexError("what a library trips over")

    reader = SimpleNamespace(open_logged_imu=lambda *_: replace(log, read=read))
    monkeypatch.setattr(formats, "_reader_for", lambda _: reader)
    with pytest.raises(LogError, match=r"is damaged or cut short \(what a library trips over\)"):
        list(formats.open_logged_imu(path, None, ReadOptions()).read(lambda samples: samples))


def types_in(*bodies):
    """The definition of a message with the fields of an IMU, and of the types t0, t1, ... that it uses."""
    rows = ["geometry_msgs/Vector3 linear_acceleration", "geometry_msgs/Vector3 angular_velocity"]
    types = [("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z")]
    types += [(f"demo/T{number}", body) for number, body in enumerate(bodies[1:])]
    parts = [f"{bodies[0]}\n" + "\n".join(rows), *(f"MSG: {name}\n{body}" for name, body in types)]
    return ("\n" + "=" * 80 + "\n").join(parts).encode()


DOUBLED = [f"T{number + 1} a\nT{number + 1} b" for number in range(14)]
"""Types that each hold the next one twice."""
DEFINITIONS = {
    "a sequence of messages of no bytes": types_in("T0[] many", ""),
    "an array of messages of no bytes": types_in("T0[4000000000] many", ""),
    "arrays in one another": types_in("T0[1000] many", "T1[1000] many", "T2[1000] many", "uint8 one"),
    "an array of strings": types_in("string[2000000000] many"),
    "types that double": types_in("T0 a", *DOUBLED, ""),
    "elements of a sequence that hold none": types_in("T0[] many", "T1 a\nuint8 b", ""),
    "a type in itself": types_in("T0 a", "T1 b", "T0 a"),
    "types in a row": types_in("T0 a", *(f"T{number + 1} a" for number in range(2000)), "uint8 one"),
    "many fields": types_in("\n".join(f"float64 f{number}" for number in range(20_000))),
    "many lines": types_in("# a remark\n" * 500_000),
}
"""Definitions of a few bytes that stand for any number of values, and long ones of few values."""


@pytest.mark.parametrize("encoding", ["ros1", "cdr"])
@pytest.mark.parametrize("name", DEFINITIONS)
def test_a_definition_makes_no_more_than_its_messages_hold(tmp_path, name, encoding):
    schema = ("demo/Imu", {"ros1": "ros1msg", "cdr": "ros2msg"}[encoding], DEFINITIONS[name])
    # The count of a sequence, and vectors; those of CDR stand behind four bytes.
    data = bytes([0, 1, 0, 0]) * (encoding == "cdr") + b"\xff" * 4 + bytes(4 + 48)
    path = write_messages(tmp_path / "log.mcap", encoding, [(1, data), (2, data)], schema)
    assert "no topic holds sensor_msgs/Imu" in refused(path)


def test_a_definition_with_arrays_and_sequences_of_messages_is_read(tmp_path):
    chunk = made_up(400)
    schema = (
        "demo/Imu",
        "ros1msg",
        types_in("T0[3] some\nT1[] many\nT2 none", "uint8 one", "T2[2] two\nuint8 a", "uint8 b"),
    )
    rows = np.hstack([chunk.accelerometer, chunk.gyroscope])
    messages = [
        (round(1e9 * (1.0 + time)), bytes(3 + 4 + 1) + row.astype("<f8").tobytes())
        for time, row in zip(chunk.time, rows, strict=True)
    ]
    path = write_messages(tmp_path / "log.mcap", "ros1", messages, schema)
    np.testing.assert_array_equal(read(path).accelerometer, chunk.accelerometer)


def test_definitions_of_many_topics_are_parsed_within_a_budget(tmp_path):
    with (tmp_path / "log.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        for number in range(400):
            text = types_in(f"# {number}\n" * 1000)
            schema = writer.register_schema("demo/Imu", "ros1msg", text)
            channel = writer.register_channel(f"/t{number}", "ros1", schema)
            writer.add_message(channel, 1, bytes(48), 1)
        writer.finish()
    assert "copy the topic of the IMU into a bag of its own" in refused(tmp_path / "log.mcap")


def test_a_descriptor_that_holds_itself_names_no_more_than_it_has(tmp_path):
    own = descriptor_pb2.FileDescriptorProto(name="imu.proto", package="demo", syntax="proto3")
    imu = own.message_type.add(name="Imu")
    for number in range(1, 12):
        imu.field.add(name=f"acc_gyro_{number}", number=number, type=11, label=1, type_name=".demo.Imu")
    files = descriptor_pb2.FileDescriptorSet(file=[own])
    schema = ("demo.Imu", "protobuf", files.SerializeToString())
    path = write_messages(tmp_path / "log.mcap", "protobuf", [(1, b"")], schema)
    assert "no topic holds sensor_msgs/Imu" in refused(path)


def test_a_file_that_a_bag_names_twice_is_refused(tmp_path):
    path = write_ros2(tmp_path / "bag", {"/imu": made_up(100)})
    (file,) = path.glob("*.db3")
    metadata = path / "metadata.yaml"
    listed = f"- {file.name}"
    assert listed in metadata.read_text()
    for other in (file.name, f"elsewhere/{file.name}"):
        text = metadata.read_text()
        metadata.write_text(text.replace(listed, f"{listed}\n  - {other}", 1))
        assert f"it names the file {file.name} twice" in refused(path)
        metadata.write_text(text)


@pytest.mark.parametrize("version", ["5", "4"])
@pytest.mark.parametrize("name", ["acc", "gyro", "time"])
def test_a_variable_of_matlab_that_stands_twice_is_refused(tmp_path, name, version):
    chunk = made_up(100)
    variables = {"time": chunk.time, "acc": chunk.accelerometer, "gyro": chunk.gyroscope}
    path, other = tmp_path / "log.mat", tmp_path / "other.mat"
    scipy.io.savemat(path, variables, format=version)
    scipy.io.savemat(other, {name: variables[name] * 1.001}, format=version)
    head = len(HEAD) if version == "5" else 0
    path.write_bytes(path.read_bytes() + other.read_bytes()[head:])
    assert "twice; keep one of them, or rename it" in refused(path)


def test_two_arrays_that_are_one_column_are_refused(tmp_path):
    chunk = made_up(100)
    path = tmp_path / "log.npz"
    own = {"time": chunk.time, "acc": chunk.accelerometer, "gyro": chunk.gyroscope}
    np.savez(path, **own, **{"acc.x": chunk.accelerometer[:, 0] * 2.0})
    assert "'acc.x' twice" in refused(path)
