"""Files of arrays, JSON and protobuf messages, written and read bare by the libraries of their formats."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py  # type: ignore[import-untyped]
import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.feather  # type: ignore[import-untyped]
import scipy.io
from google.protobuf import (  # type: ignore[import-untyped]
    descriptor_pb2,
    descriptor_pool,
    message_factory,
)
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from tumble.foundation.recording import Chunk, FloatArray

Write = Callable[[Path, Chunk], Path]


def _arrays(chunk: Chunk) -> dict[str, FloatArray]:
    return {"t": chunk.time, "acc": chunk.accelerometer, "gyr": chunk.gyroscope}


def numpy_archive(*, packed: bool = False) -> Write:
    """Returns what writes `.npz`."""

    def write(folder: Path, chunk: Chunk) -> Path:
        save = np.savez_compressed if packed else np.savez
        save(folder / "log.npz", allow_pickle=False, **_arrays(chunk))
        return folder / "log.npz"

    return write


def read_archive(path: Path) -> object:
    """Loads all of `.npz`."""
    with np.load(path) as file:
        return {name: file[name] for name in file}


def numpy_array(folder: Path, chunk: Chunk) -> Path:
    """Writes `.npy` with seven columns."""
    np.save(folder / "log.npy", np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope]))
    return folder / "log.npy"


def matlab(*, packed: bool = False) -> Write:
    """Returns what writes `.mat` of version 5."""

    def write(folder: Path, chunk: Chunk) -> Path:
        scipy.io.savemat(folder / "log.mat", _arrays(chunk), do_compression=packed)
        return folder / "log.mat"

    return write


def hdf5(*, packed: bool = False) -> Write:
    """Returns what writes HDF5, packed in chunks of a fixed length."""
    options = {"chunks": True, "compression": "gzip"} if packed else {}

    def write(folder: Path, chunk: Chunk) -> Path:
        with h5py.File(folder / "log.h5", "w") as file:
            for name, values in _arrays(chunk).items():
                file.create_dataset(name, data=values, **options)
        return folder / "log.h5"

    return write


def read_hdf5(path: Path) -> object:
    """Loads all of HDF5."""
    with h5py.File(path) as file:
        return {name: file[name][()] for name in file}


def feather(folder: Path, chunk: Chunk) -> Path:
    """Writes Feather as pandas does."""
    triads = {"a": chunk.accelerometer, "g": chunk.gyroscope}
    columns = {
        f"{triad}{axis}": of[:, number] for triad, of in triads.items() for number, axis in enumerate("xyz")
    }
    pa.feather.write_feather(pa.table({"time": chunk.time, **columns}), folder / "log.feather")
    return folder / "log.feather"


def json_messages(folder: Path, chunk: Chunk) -> Path:
    """Writes MCAP with a message of JSON a sample."""
    path = folder / "log.mcap"
    stamps = np.rint(chunk.time * 1e9).astype(np.int64).tolist()
    triads = zip(stamps, chunk.accelerometer.tolist(), chunk.gyroscope.tolist(), strict=True)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/imu", "json", 0)
        for stamp, force, rate in triads:
            message = {
                "timestamp": dict(zip(("sec", "nsec"), divmod(stamp, 10**9), strict=True)),
                "linear_acceleration": dict(zip("xyz", force, strict=True)),
                "angular_velocity": dict(zip("xyz", rate, strict=True)),
            }
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def read_json(path: Path) -> object:
    """Reads all messages of JSON."""
    with path.open("rb") as file:
        return [json.loads(message.data) for _, _, message in make_reader(file).iter_messages()]


def _imu_file() -> descriptor_pb2.FileDescriptorProto:
    """Describes a message of a stamp, ns, and two vectors."""
    file = descriptor_pb2.FileDescriptorProto(name="imu.proto", package="demo", syntax="proto3")
    vector, imu = file.message_type.add(name="Vector3"), file.message_type.add(name="Imu")
    for number, name in enumerate("xyz", start=1):
        vector.field.add(name=name, number=number, type=1, label=1)
    imu.field.add(name="timestamp_ns", number=1, type=6, label=1)
    for number, name in enumerate(("linear_acceleration", "angular_velocity"), start=2):
        imu.field.add(name=name, number=number, type=11, label=1, type_name=".demo.Vector3")
    return file


def protobuf_messages(folder: Path, chunk: Chunk) -> Path:
    """Writes MCAP with a message of protocol buffers a sample."""
    path, file = folder / "log.mcap", _imu_file()
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.Imu"))
    stamps = np.rint(chunk.time * 1e9).astype(np.int64).tolist()
    triads = zip(stamps, chunk.accelerometer.tolist(), chunk.gyroscope.tolist(), strict=True)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        described = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
        schema = writer.register_schema("demo.Imu", "protobuf", described)
        channel = writer.register_channel("/imu", "protobuf", schema)
        for stamp, force, rate in triads:
            message = kind(
                timestamp_ns=stamp,
                linear_acceleration=dict(zip("xyz", force, strict=True)),
                angular_velocity=dict(zip("xyz", rate, strict=True)),
            )
            writer.add_message(channel, stamp, message.SerializeToString(), stamp)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def read_protobuf(path: Path) -> object:
    """Reads all messages of protocol buffers."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [message for *_, message in reader.iter_decoded_messages()]
