"""A server of a store of objects that never comes to an end is given up, by whatever it is asked."""

from __future__ import annotations

import asyncio

import fsspec
import pytest
from fsspec.asyn import AsyncFileSystem

from tumble.fleet.places import FileStore
from tumble.foundation import bounded_answer, stores
from tumble.foundation.errors import OutputError
from tumble.foundation.stores import StoreError
from tumble.laboratory.database import RegistryError
from tumble.laboratory.documents import Documents

DIGEST = "0" * 64


class EndlessStore(AsyncFileSystem):
    """A store whose answers never come to an end."""

    protocol = "endless"
    cachable = False

    async def _endless(self, *_given, **_named):
        await asyncio.sleep(3600.0)

    _ls = _info = _cat_file = _pipe_file = _makedirs = _rm_file = _endless


fsspec.register_implementation("endless", EndlessStore, clobber=True)


@pytest.fixture(params=["time", "memory"])
def bound(request, monkeypatch):
    """Words for the bound, of time or of memory, that is at its end."""
    monkeypatch.setattr(stores, "STORES", {"endless"})
    if request.param == "time":
        monkeypatch.setattr(stores, "ANSWERING", 0.0)
        return "sends no whole answer within 0 s"
    sizes = iter(range(0, 1 << 40, 1 << 31))
    monkeypatch.setattr(bounded_answer, "_memory_in_use", lambda: next(sizes))
    return "sends an answer of more than 1024 MiB"


@pytest.mark.parametrize(
    ("ask", "error"),
    [
        (lambda: list(Documents("endless://place").hashes()), RegistryError),
        (lambda: Documents("endless://place").raw(DIGEST), RegistryError),
        (lambda: Documents("endless://place").keep(b"content"), OutputError),
        (lambda: FileStore("endless://place").read("status.json"), StoreError),
        (lambda: FileStore("endless://place").write("status.json", b"{}", None), StoreError),
    ],
    ids=["listed", "read", "kept", "read by a fleet", "written by a fleet"],
)
def test_an_answer_without_end_is_given_up_in_one_line(bound, ask, error):
    with pytest.raises(error, match=bound) as refused:
        ask()
    assert "\n" not in str(refused.value)
