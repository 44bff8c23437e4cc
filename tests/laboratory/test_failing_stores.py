"""A store of documents whose library raises whatever it likes: each command is one line, or a fault."""

from __future__ import annotations

from typing import ClassVar

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from made_up_calibrations import made_up, save
from tumble.foundation import stores
from tumble.foundation.errors import OutputError
from tumble.laboratory.documents import Documents
from tumble.laboratory.registry import Registry
from turntable_sessions import one_line, typed

OPERATIONS = ("size", "cat_file", "ls", "makedirs", "pipe_file")
"""Those that a registry asks of a store."""


class OfLibraryError(Exception):
    """Error of a library's own, of no kind that Python knows."""


ERRORS = (OfLibraryError("a bucket\nof no name"), KeyError("x"), OSError(28, "no space"), RuntimeError())


class FailingStore(MemoryFileSystem):
    """A store of which some operations fail."""

    protocol = "failing"
    cachable = False
    fails: ClassVar[dict[str, Exception]] = {}

    @classmethod
    def _strip_protocol(cls, path):
        return MemoryFileSystem._strip_protocol(str(path).replace("failing://", "memory://"))


def _failing(name):
    def operation(self, *arguments, **options):
        if name in FailingStore.fails:
            raise FailingStore.fails[name]
        return getattr(super(FailingStore, self), name)(*arguments, **options)

    return operation


for _name in OPERATIONS:
    setattr(FailingStore, _name, _failing(_name))
fsspec.register_implementation("failing", FailingStore, clobber=True)


@pytest.fixture
def registry(tmp_path, monkeypatch):
    """A registry with a result, whose documents are in a store."""
    monkeypatch.setattr(FailingStore, "fails", {})
    monkeypatch.setattr(stores, "STORES", {"failing"})
    monkeypatch.setattr(MemoryFileSystem, "store", {})
    made = Registry.create(tmp_path / "lab.db", documents="failing://documents")
    made.add(save(tmp_path / "a", made_up()))
    assert made.verify().intact
    return made


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_whatever_a_store_raises_is_one_line(registry, tmp_path, error):
    results = save(tmp_path / "b", made_up(serial="2", log="2"))
    identity = registry.list()[0]["calibration"]
    commands = (
        ("add", results),
        ("verify",),
        ("show", identity, "-o", tmp_path / "shown"),
        ("backup", tmp_path / "copy"),
        ("equipment", "table", "--kind", "table", "--document", __file__),
    )
    for operation in OPERATIONS:
        FailingStore.fails.clear()
        FailingStore.fails[operation] = error
        for words in commands:
            done = typed("registry", *words, "--registry", tmp_path / "lab.db")
            assert done.code in (0, 2, 3), (operation, words)
            if done.code == 2:
                one_line(done.err)


@pytest.mark.parametrize("operation", ["makedirs", "pipe_file"])
def test_a_document_that_cannot_be_stored_is_named(registry, operation):
    FailingStore.fails[operation] = OfLibraryError("a bucket\nof no name")
    with pytest.raises(OutputError, match="cannot be written: a bucket of no name; check the address"):
        Documents("failing://documents").keep(b"another")
