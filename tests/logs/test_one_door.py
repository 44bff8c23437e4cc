"""Readers read the file that was named, whatever its name, and never wait for a pipe in its place."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import h5py
import numpy as np
import pandas
import pytest
import scipy.io

from bag_fixtures import write_ros1, write_ros2
from format_fixtures import WRITERS
from hostile_places import patient
from log_fixtures import join, made_up, read, same, write, write_text
from tumble.foundation.errors import TumbleError
from tumble.logs import open_recording

NAMES = {
    "drive%31": "drive1",
    "log#2": "log",
    "log?x=1": "log",
    "log%00": "log",
    "a b&c;d": "a b",
    "file:log": "log",
    "s3:log": "log",
    "\udcff\udcfe": "log",
}
"""Names, with what a library would open that takes a name for an address."""


def _arrays(chunk):
    return {"time": chunk.time, "accelerometer": chunk.accelerometer, "gyroscope": chunk.gyroscope}


def _hdf5(path, chunk):
    with path.open("w+b") as stream, h5py.File(stream, "w") as file:
        for name, values in _arrays(chunk).items():
            file[name] = values


def _feather(path, chunk):
    columns = [chunk.time, *chunk.accelerometer.T, *chunk.gyroscope.T]
    names = ("time", "ax", "ay", "az", "gx", "gy", "gz")
    with path.open("wb") as file:
        pandas.DataFrame(dict(zip(names, columns, strict=True))).to_feather(file)


def _to_file(save):
    def make(path, chunk):
        with path.open("wb") as file:
            save(file, chunk)

    return make


def _database(path, chunk):
    folder = path.with_name("made")
    write_ros2(folder, {"/imu": chunk})
    next(folder.glob("*.db3")).rename(path)
    for each in folder.iterdir():
        each.unlink()
    folder.rmdir()


KINDS = {
    ".csv": write_text,
    ".parquet": write,
    ".mcap": write,
    ".feather": _feather,
    ".h5": _hdf5,
    ".npz": _to_file(lambda file, chunk: np.savez(file, **_arrays(chunk))),
    ".mat": _to_file(lambda file, chunk: scipy.io.savemat(file, _arrays(chunk))),
    ".bag": lambda path, chunk: write_ros1(path, {"/imu": chunk}),
    ".db3": _database,
}
"""A writer for each library that reads logs."""


def _made(folder, kind, name, seed):
    """Writes a log by a plain name, then gives it its own."""
    plain = folder / f"plain{kind}"
    chunk = made_up(60, rate=100.0, start=1.7e9, seed=seed, temperature=False)
    KINDS[kind](plain, chunk)
    return plain.rename(folder / f"{name}{kind}"), chunk


@pytest.mark.parametrize("kind", KINDS)
def test_the_file_that_was_named_is_read(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(tmp_path)
    for number, (name, other) in enumerate(NAMES.items()):
        folder = Path(f"folder{number}")
        folder.mkdir()
        for decoy in {other, f"{other}{kind}"}:
            made, _ = _made(folder, kind, "decoy", 1)
            made.rename(folder / decoy)
        path, chunk = _made(folder, kind, name, 2)
        found = read(path)
        assert np.allclose(found.accelerometer, chunk.accelerometer, rtol=0.0, atol=1e-9), name


def test_a_table_below_a_folder_like_a_protocol_is_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind in (".parquet", ".feather"):
        inner = Path(f"file:{tmp_path}")
        inner.mkdir(parents=True, exist_ok=True)
        _made(tmp_path, kind, "log", 1)
        path, chunk = _made(inner, kind, "log", 2)
        assert np.allclose(read(path).gyroscope, chunk.gyroscope, rtol=0.0, atol=1e-9), kind


opened: list[tuple[str, bool, bool]] | None = None
"""Openings while a reader runs: the path, whether by the library of files, whether without waiting."""


def _note(event, arguments):
    if event == "open" and opened is not None and isinstance(arguments[0], str | bytes | os.PathLike):
        path, mode, flags = arguments
        opened.append((os.fsdecode(path), mode is not None, bool(flags & os.O_NONBLOCK)))


sys.addaudithook(_note)


def _waiting(folder, run):
    """Paths below a folder that are opened in a way that waits where a pipe stands there by then."""
    global opened
    opened = []
    try:
        run()
    finally:
        found, opened = opened, None
    below = [each for each in found if each[0].startswith(str(folder))]
    assert below, "nothing was opened"
    by_library = sorted(path for path, is_library, _ in below if is_library)
    without_waiting = sorted(path for path, is_library, free in below if free and not is_library)
    return [path for path in set(by_library) if by_library.count(path) > without_waiting.count(path)]


@pytest.mark.parametrize("kind", [*KINDS, *WRITERS])
def test_no_reader_opens_a_file_in_a_way_that_waits(tmp_path, kind):
    if kind in KINDS:
        source, options = _made(tmp_path, kind, "log", 1)[0], None
    else:
        source, options, _ = WRITERS[kind](tmp_path, made_up(200, rate=100.0, start=1.7e9))
    assert _waiting(tmp_path, lambda: join(list(open_recording(source, options).chunks()))) == []


def _outcome(source, options):
    """The line in which a log is refused; empty where it is read."""
    try:
        with patient():
            read(source, options)
    except TumbleError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("kind", WRITERS)
def test_a_pipe_among_the_files_of_a_log_ends_in_one_line(tmp_path, kind):
    source, options, _ = WRITERS[kind](tmp_path, made_up(200, rate=100.0, start=1.7e9))
    if not Path(source).is_dir():
        pytest.skip("one file, which test_hostile_places replaces")
    whole = read(source, options)
    files = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    for path in (*files[:2], *files[-2:]):
        aside = path.rename(tmp_path / "aside")
        os.mkfifo(path)
        line = _outcome(source, options)
        assert "\n" not in line
        if kind == "kitti" and path.parent.name == "data":
            assert line.startswith(f"{path}: is a device or a pipe")
        path.unlink()
        aside.rename(path)
    assert same(read(source, options), whole)
