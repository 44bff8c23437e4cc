"""Arrays under names: NumPy, MATLAB, HDF5 and Feather, written by the libraries of the formats."""

from __future__ import annotations

import builtins
import importlib

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
from hypothesis import given

from hostile import MOST_BYTES, corrupted, few, for_long, read_or_refuse
from log_fixtures import made_up, read, refusal, same
from tumble.foundation.recording import Chunk
from tumble.logs import ReadOptions, list_imus, open_recording


def arrays_of(chunk):
    """Arrays of samples under the names of most programs."""
    return {"t": chunk.time, "acc": chunk.accelerometer, "gyr": chunk.gyroscope, "temp": chunk.temperature}


CHUNK = made_up(70_000)
"""More samples than a chunk has."""
ARRAYS = arrays_of(CHUNK)
SHORT = made_up(500)
"""For what is known by its first bytes, whatever its length."""
TURNED = ARRAYS | {"acc": CHUNK.accelerometer.T, "gyr": np.asfortranarray(CHUNK.gyroscope)}


def matlab_7_3(path, arrays, **options):
    """Writes as MATLAB does: HDF5 behind a header of its own, and every array turned round."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=np.atleast_2d(np.asarray(values).T), **options)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    data = bytearray(path.read_bytes())
    data[:19] = b"MATLAB 7.3 MAT-file"
    path.write_bytes(data)


def hdf5(path, arrays, **options):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values, **options)


def feather(path, arrays, **options):
    chunk = Chunk(arrays["t"], arrays["acc"], arrays["gyr"], arrays["temp"])
    names = [*(f"acc_{axis}" for axis in "xyz"), *(f"gyr_{axis}" for axis in "xyz")]
    table = pd.DataFrame(np.column_stack([chunk.accelerometer, chunk.gyroscope]), columns=names)
    table.insert(0, "t", chunk.time)
    table["temp"] = chunk.temperature
    table.to_feather(path, **options)


WRITERS = {
    "log.npz": lambda path, arrays: np.savez(path, **arrays),
    "packed.npz": lambda path, arrays: np.savez_compressed(path, **arrays),
    "four.mat": lambda path, arrays: scipy.io.savemat(path, arrays, format="4"),
    "five.mat": lambda path, arrays: scipy.io.savemat(path, arrays),
    "packed.mat": lambda path, arrays: scipy.io.savemat(path, arrays, do_compression=True),
    "structure.mat": lambda path, arrays: scipy.io.savemat(path, {"log": {"imu": arrays, "name": "drive"}}),
    "seven.mat": matlab_7_3,
    "log.h5": hdf5,
    "packed.hdf5": lambda path, arrays: hdf5(path, arrays, chunks=True, compression="gzip"),
    "log.feather": feather,
    "packed.feather": lambda path, arrays: feather(path, arrays, compression="zstd"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_float_comes_back_as_the_format_s_own_library_wrote_it(tmp_path, name):
    WRITERS[name](tmp_path / name, ARRAYS)
    assert same(read(tmp_path / name), CHUNK)


@pytest.mark.parametrize("name", [name for name in WRITERS if "feather" not in name])
def test_arrays_may_lie_either_way_round(tmp_path, name):
    WRITERS[name](tmp_path / name, TURNED)
    assert same(read(tmp_path / name), CHUNK)


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_is_known_by_what_is_in_it_whatever_its_name(tmp_path, name):
    WRITERS[name](tmp_path / name, arrays_of(SHORT))
    (tmp_path / name).rename(tmp_path / "log")
    assert same(read(tmp_path / "log"), SHORT)


def test_an_array_without_a_name_is_the_table_that_its_columns_make(tmp_path):
    table = np.column_stack([CHUNK.time, CHUNK.accelerometer, CHUNK.gyroscope])
    np.save(tmp_path / "seven.npy", table)
    np.save(tmp_path / "six.npy", np.asfortranarray(table[:, 1:]))
    seven, six = read(tmp_path / "seven.npy"), read(tmp_path / "six.npy", ReadOptions(rate=200.0))
    assert np.array_equal(seven.time, CHUNK.time)
    assert np.array_equal(seven.gyroscope, six.gyroscope)
    assert np.array_equal(six.accelerometer, CHUNK.accelerometer)


def test_fields_of_a_structured_array_are_columns_by_their_names(tmp_path):
    fields = [("t", "datetime64[us]"), ("acc", "f8", (3,)), ("gyro", [(axis, "f4") for axis in "xyz"])]
    table = np.zeros(len(CHUNK), fields)
    table["t"] = (1.7e9 * 1e6 + CHUNK.time * 1e6).astype(np.int64).view("datetime64[us]")
    table["acc"] = CHUNK.accelerometer
    for number, axis in enumerate("xyz"):
        table["gyro"][axis] = CHUNK.gyroscope[:, number]
    np.save(tmp_path / "log.npy", table)
    found = read(tmp_path / "log.npy")
    assert np.array_equal(found.accelerometer, CHUNK.accelerometer)
    assert np.array_equal(found.gyroscope, CHUNK.gyroscope.astype("f4").astype("f8"))
    assert np.allclose(found.time, 1.7e9 + CHUNK.time, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["log.npz", "log.h5", "five.mat"])
def test_rate_beside_the_arrays_serves_a_log_without_time(tmp_path, name):
    WRITERS[name](tmp_path / name, {"acc": CHUNK.accelerometer, "gyr": CHUNK.gyroscope, "fs": [[200.0]]})
    assert np.array_equal(read(tmp_path / name).time, np.arange(len(CHUNK)) / 200.0)
    assert "200 Hz" in "".join(open_recording(tmp_path / name).metadata.remarks)


def test_several_imus_of_a_file_are_named_by_their_groups(tmp_path):
    scipy.io.savemat(tmp_path / "log.mat", {"log": {"front": ARRAYS, "rear": ARRAYS}})
    hdf5(tmp_path / "log.h5", {f"{imu}/{key}": ARRAYS[key] for imu in ("front", "rear") for key in ARRAYS})
    np.savez(
        tmp_path / "log.npz", **{f"{imu}_{key}": ARRAYS[key] for imu in ("front", "rear") for key in ARRAYS}
    )
    for name in ("log.mat", "log.h5", "log.npz"):
        assert list_imus(tmp_path / name) == ("front", "rear")
        assert "holds 2 IMUs: name one" in refusal(tmp_path / name)
        assert same(read(f"{tmp_path / name}:rear"), CHUNK)


def test_units_that_attributes_state_hold(tmp_path):
    hdf5(tmp_path / "log.h5", ARRAYS | {"gyr": np.degrees(CHUNK.gyroscope)})
    with h5py.File(tmp_path / "log.h5", "a") as file:
        file["gyr"].attrs["units"] = "deg/s"
        file["acc"].attrs["units"] = "m/s^2"
    metadata = open_recording(tmp_path / "log.h5").metadata
    assert (metadata.gyroscope_unit.name, metadata.gyroscope_unit.reason) == ("deg/s", "attribute")
    assert np.allclose(read(tmp_path / "log.h5").gyroscope, CHUNK.gyroscope, rtol=0.0, atol=1e-15)


def test_an_array_of_objects_is_refused_and_not_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return (builtins.exec, (f"open({str(tmp_path / 'sprung')!r}, 'w')",))

    np.savez(tmp_path / "log.npz", acc=np.array([Trap()], object))
    assert "holds Python objects" in refusal(tmp_path / "log.npz")
    assert not (tmp_path / "sprung").exists()


def test_variables_of_different_lengths_are_named(tmp_path):
    np.savez(tmp_path / "log.npz", **ARRAYS | {"t": CHUNK.time[:100]})
    assert "t holds 100 samples, temp 70000" in refusal(tmp_path / "log.npz")


def test_a_file_without_an_imu_lists_its_variables(tmp_path):
    np.savez(tmp_path / "log.npz", position=CHUNK.accelerometer)
    assert "columns found: position#1, position#2, position#3" in refusal(tmp_path / "log.npz")


def test_archive_with_an_impossible_unpacked_size_is_refused(tmp_path):
    np.savez_compressed(tmp_path / "log.npz", acc=np.zeros((4_000_000, 3)), gyr=np.zeros((4_000_000, 3)))
    data = bytearray((tmp_path / "log.npz").read_bytes())
    size = (4_000_000 * 24 + 128).to_bytes(4, "little")
    assert data.count(size)
    (tmp_path / "log.npz").write_bytes(data.replace(size, b"\xfe\xff\xff\xff"))
    assert "which no archive of numbers does" in refusal(tmp_path / "log.npz")


def test_a_dataset_that_says_more_than_is_kept_of_it_is_refused(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.create_dataset("acc", (10**12, 3), "f8", chunks=(1000, 3))
        file["gyr"] = CHUNK.gyroscope
    assert "says shape (1000000000000, 3), and 0 bytes of it are there" in refusal(tmp_path / "log.h5")


def test_datasets_of_other_files_are_not_followed(tmp_path):
    hdf5(tmp_path / "secret.h5", ARRAYS)
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["imu"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/")
        file["note"] = np.zeros(5)
    assert "no column for" in refusal(tmp_path / "log.h5")


def test_tables_of_matlab_are_named_with_how_to_save_them(tmp_path):
    opaque = np.array([17, 0], "<u4").tobytes()
    element = np.array([6, 8], "<u4").tobytes() + opaque
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "log.mat").write_bytes(header + np.array([14, len(element)], "<u4").tobytes() + element)
    assert "table2struct" in refusal(tmp_path / "log.mat")


def test_a_missing_library_is_named_with_how_to_get_it(tmp_path, monkeypatch):
    hdf5(tmp_path / "log.h5", ARRAYS)
    real = importlib.import_module

    def without(name, *rest):
        if name.endswith("hdf5"):
            raise ModuleNotFoundError(name="h5py")
        return real(name, *rest)

    monkeypatch.setattr("tumble.logs.optional.import_module", without)
    message = refusal(tmp_path / "log.h5")
    assert "needs the Python package h5py" in message
    assert "python -m pip install 'tumble-imu[formats]'" in message


SMALL = made_up(40)
SMALL_ARRAYS = {
    "t": SMALL.time,
    "acc": SMALL.accelerometer,
    "gyr": SMALL.gyroscope,
    "temp": SMALL.temperature,
}


def small_file(tmp_path, name):
    WRITERS[name](tmp_path / name, SMALL_ARRAYS)
    return (tmp_path / name).read_bytes()


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_a_file_that_is_cut_short_is_refused_in_one_line(tmp_path, name, share):
    WRITERS[name](tmp_path / name, ARRAYS)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(share * len(data))])
    assert refusal(tmp_path / name)


def test_group_with_a_cyclic_index_is_read_or_refused_in_one_line(tmp_path):
    data = bytearray(small_file(tmp_path, "log.h5"))
    node = data.index(b"TREE\x00")
    data[node + 16 : node + 24] = node.to_bytes(8, "little")  # where it names its right neighbour
    (tmp_path / "round.h5").write_bytes(data)
    read_or_refuse(tmp_path / "round.h5")


@pytest.mark.parametrize("name", WRITERS)
def test_corrupt_file_claims_no_memory_for_its_stated_size(tmp_path, name):
    whole = small_file(tmp_path, name)

    @few
    @given(data=corrupted(whole))
    def check(data):
        path = tmp_path / f"corrupted_{name}"
        path.write_bytes(data)
        assert read_or_refuse(path) < MOST_BYTES

    for_long(check)
