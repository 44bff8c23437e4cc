"""A place is a folder or one of a store of objects, read within bounds, whoever names it."""

import os
import shutil
from collections import namedtuple

import fsspec
import pytest
from fsspec.implementations.local import LocalFileSystem
from fsspec.implementations.memory import MemoryFile, MemoryFileSystem

from hostile_places import patient
from made_up_calibrations import made_up, save
from tumble.fleet.inputs import inputs_of
from tumble.fleet.job import FleetJob
from tumble.fleet.ledger import KIND
from tumble.fleet.parts import ENDING, FOLDER, part_tables
from tumble.fleet.places import FileStore
from tumble.foundation import file_reading, files, stores
from tumble.foundation.errors import TumbleError
from tumble.foundation.stores import STORES, Store, StoreError
from tumble.laboratory.documents import Documents
from tumble.laboratory.registry import Registry

OTHERS = sorted(set(fsspec.available_protocols()) - STORES - {"file", "local"})


@pytest.fixture
def opened(monkeypatch):
    """URLs that a library was asked to open."""
    urls = []
    monkeypatch.setattr(fsspec.core, "url_to_fs", lambda url, **_: urls.append(url))
    return urls


@pytest.mark.parametrize(
    "form", ["{}://a", "{}://a::file:///a", "file:///a::{}://b", "s3://a::{}://b", "{}://"]
)
def test_any_other_protocol_or_chain_is_refused_unopened(opened, form):
    for protocol in (*OTHERS, "nonsense", "", "S3 "):
        with pytest.raises(StoreError, match="is no protocol of a store"):
            Store(form.format(protocol))
    assert opened == []


def test_a_path_is_never_taken_apart(opened, tmp_path):
    for name in ("reference::a", "zip::file:", "simplecache::"):
        assert Store(str(tmp_path / name)).root == str(tmp_path / name)
    assert opened == []


def test_documents_are_sought_in_their_own_folders(monkeypatch):
    listed = []
    monkeypatch.setattr(LocalFileSystem, "ls", lambda _, path, **__: listed.append(path) or [])
    assert list(Documents("/").hashes()) == []
    assert listed == [f"//{number:02x}" for number in range(256)]


@pytest.mark.parametrize("protocol", ["", "file://"])
def test_a_pipe_in_a_place_is_one_line(tmp_path, protocol):
    os.mkfifo(tmp_path / "pipe.parquet")
    job = FleetJob(procedure="spin", inputs=f"{protocol}{tmp_path}/pipe.parquet", results=str(tmp_path))
    with pytest.raises(TumbleError, match="is a device or a pipe, and no manifest"):
        next(inputs_of(job))
    registry = Registry.create(tmp_path / "lab.db", documents=f"{protocol}{tmp_path}/documents")
    registry.add(save(tmp_path / "a", made_up()))
    kept = next(path for path in (tmp_path / "documents").rglob("*") if path.is_file())
    kept.unlink()
    os.mkfifo(kept)
    assert "is a device or a pipe, and no document" in " ".join(registry.verify().faults)


def test_a_pipe_or_device_among_results_is_one_line(tmp_path):
    part = tmp_path / FOLDER / "day=unknown" / f"00{ENDING}"
    part.parent.mkdir(parents=True)
    for make in (os.mkfifo, lambda path: path.symlink_to("/dev/zero")):
        make(part)
        with patient(), pytest.raises(StoreError, match="is a device or a pipe, and no part of results"):
            list(part_tables(FileStore(str(tmp_path)), None))
        part.unlink()


@pytest.fixture
def bucket(monkeypatch):
    """A store in memory, with all that lies in it."""
    content = {}
    monkeypatch.setattr(stores, "STORES", {"memory"})
    monkeypatch.setattr(MemoryFileSystem, "store", content)
    monkeypatch.setattr(MemoryFileSystem, "pseudo_dirs", [""])
    return content


def put(bucket, name, content=b"x"):
    bucket[name] = MemoryFile(None, name, content)


def test_a_folder_is_copied_with_all_in_it(bucket, tmp_path):
    for name in ("/day/unit/a.csv", "/day/unit/b/c.csv"):
        put(bucket, name, name.encode())
    place = Store("memory://day/unit").copy(tmp_path)
    copies = {path.relative_to(tmp_path): path.read_text() for path in place.rglob("*.csv")}
    assert {f"/day/{path}": text for path, text in copies.items()} == {name: name for name in bucket}
    assert Store("memory://day/unit/a.csv").copy(tmp_path / "unit").read_bytes() == b"/day/unit/a.csv"


@pytest.mark.parametrize("name", ["/day/../../../evil", "/day/a/../../../evil", "/day/a\\b", "/day/a\0"])
def test_a_name_in_a_store_leads_nowhere_else(bucket, tmp_path, name):
    put(bucket, "/day/good.csv")
    put(bucket, name)
    (tmp_path / "in").mkdir()
    with pytest.raises(StoreError, match="is no name of a file"):
        Store("memory://day").copy(tmp_path / "in")
    assert {path.name for path in tmp_path.rglob("*")} <= {"in", "day", "good.csv"}


def test_a_copy_is_bounded_before_it_begins(bucket, tmp_path, monkeypatch):
    put(bucket, "/day/a.csv", b"x" * 100)
    put(bucket, "/day/b.csv", b"x" * 100)
    usage = namedtuple("usage", "free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(399))
    with pytest.raises(StoreError, match="name a folder with room by TMPDIR"):
        Store("memory://day").copy(tmp_path)
    monkeypatch.setattr(stores, "_MOST_FILES", 1)
    with pytest.raises(StoreError, match="has more than 1 file"):
        Store("memory://day").copy(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("listed", [99, 101])
def test_a_file_of_another_length_than_was_listed_is_refused(bucket, tmp_path, monkeypatch, listed):
    put(bucket, "/day/a.csv", b"x" * 100)
    monkeypatch.setattr(MemoryFileSystem, "size", lambda _self, _path: listed)
    with pytest.raises(StoreError, match=f"was listed with {listed} bytes, and is not as long"):
        Store("memory://day/a.csv").copy(tmp_path)


def test_a_copy_ends_once_it_is_longer_than_was_listed(bucket, tmp_path, monkeypatch):
    put(bucket, "/day/a.csv", b"x" * 100)
    sent = []

    def endless(_self, _path, _place, callback):
        while True:
            sent.append(10)
            callback.relative_update(10)

    monkeypatch.setattr(MemoryFileSystem, "get_file", endless)
    with pytest.raises(StoreError, match="is not as long"):
        Store("memory://day/a.csv").copy(tmp_path)
    assert sum(sent) == 110


@pytest.mark.parametrize("written", [True, False], ids=["written", "removed"])
def test_a_file_that_comes_or_goes_while_it_is_read_is_no_error(tmp_path, monkeypatch, written):
    """A driver looks for `cancel` while another process writes it, and a status is replaced while read."""
    place, file = FileStore(str(tmp_path)), tmp_path / "cancel"

    def missed(path):
        file.write_text("x") if written else file.unlink(missing_ok=True)
        raise FileNotFoundError(path)

    monkeypatch.setattr(file_reading, "open_regular", missed)
    assert place.read("cancel") is None


def test_a_file_that_goes_while_it_is_replaced_or_removed_is_no_error(tmp_path, monkeypatch):
    place, file = FileStore(str(tmp_path)), tmp_path / "cancel"

    def missed(path):
        file.unlink()
        raise FileNotFoundError(path)

    monkeypatch.setattr(files, "open_regular", missed)
    for use in (lambda: place.write("cancel", b"y", KIND), lambda: place.remove("cancel", KIND)):
        file.write_text("x")
        use()
