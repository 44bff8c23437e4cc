"""Writers at once lose nothing and double nothing, killed at any moment; a full disk loses nothing either."""

from __future__ import annotations

import pytest

from made_up_calibrations import made_up, save
from registry_writers import compete
from repetitions import SOAK
from tumble.foundation.errors import TumbleError
from tumble.laboratory import documents
from tumble.laboratory.registry import Registry


def test_writers_killed_at_random_lose_nothing_and_double_nothing(registry, tmp_path):
    address = registry.address.url or registry.address.path
    place = address if registry.address.path else address.render_as_string(hide_password=False)
    place = str(place).replace("+psycopg", "")
    size = {"writers": 8, "results": 200, "kills": 200} if SOAK else {"writers": 3, "results": 8, "kills": 3}
    compete(place, tmp_path / "results", **size, seed=11)


def test_a_document_that_cannot_be_written_leaves_no_entry(tmp_path, monkeypatch):
    registry = Registry.create(tmp_path / "lab.db")
    results = save(tmp_path / "a", made_up())

    def full(*_arguments, **_named):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(documents, "replacing", full)
        with pytest.raises(TumbleError, match="No space left on device"):
            registry.add(results)
    assert len(registry.list()) == 0
    assert registry.verify().intact
    assert registry.add(results)[0].is_new


def test_a_full_database_leaves_no_half_of_a_result(tmp_path):
    from sqlalchemy import event

    registry = Registry.create(tmp_path / "lab.db")
    before = registry.verify()

    @event.listens_for(registry.database._engine, "connect")
    def small(connection, _record):
        pages = connection.execute("PRAGMA page_count").fetchone()[0]
        connection.execute(f"PRAGMA max_page_count = {pages}")

    results = save(tmp_path / "a", *(made_up(serial=str(n), log=str(n)) for n in range(20)))
    with pytest.raises(TumbleError, match="full"):
        registry.add(results)
    opened = Registry(tmp_path / "lab.db")
    assert opened.verify().head == before.head
    assert opened.verify().intact
    assert opened.verify().unreferenced > 0
    assert len(opened.add(results)) == 20
    assert opened.verify().unreferenced == 0
