"""Registries on both engines: a file of SQLite, and a PostgreSQL server that the tests start."""

from __future__ import annotations

import os
from itertools import count

import pytest

import postgres
from tumble.foundation.files import make_file
from tumble.laboratory.address import parse_address
from tumble.laboratory.database import Database
from tumble.laboratory.registry import Registry

_NUMBERS = count()


@pytest.fixture(scope="session")
def server():
    """A running PostgreSQL; skips, and fails in CI, where it is not installed."""
    with postgres.running() as running:
        yield running


@pytest.fixture(scope="session")
def address_on(request):
    """Function that makes room for a registry, on an engine; a file is in the folder that it is given."""

    def address_on(engine, folder):
        if engine == "sqlite":
            return folder / "lab.db"
        return request.getfixturevalue("server").make(f"lab_{next(_NUMBERS)}")

    return address_on


@pytest.fixture(scope="session")
def tables_of(request, tmp_path_factory):
    """Function that returns a place with the tables of a registry and no row, on an engine.

    Migrations take longer than most tests take after them: copies of it need none.
    """
    made = {}

    def tables_of(engine):
        if engine not in made:
            path = tmp_path_factory.mktemp("tables") / "tables.db"
            if engine == "sqlite":
                make_file(path)
            else:
                request.getfixturevalue("server").make("tables")
            place = str(path) if engine == "sqlite" else request.getfixturevalue("server").url("tables")
            Database(parse_address(place)).upgrade()
            made[engine] = path if engine == "sqlite" else "tables"
        return made[engine]

    return tables_of


@pytest.fixture(scope="session", autouse=True)
def migrations_run_once(tables_of):
    """A new file gets the tables that migrations have made in another one."""
    tables, upgrade, own = tables_of("sqlite").read_bytes(), Database.upgrade, os.getpid()

    def copied(database):
        path = database.address.path
        # Stations are forks, several of which make one registry at a time.
        if os.getpid() == own and path is not None and path.is_file() and not path.stat().st_size:
            path.write_bytes(tables)
        upgrade(database)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Database, "upgrade", copied)
        yield


@pytest.fixture(params=["sqlite", "postgresql"])
def address(request, address_on, tables_of, tmp_path):
    """Address with room for a registry, on each engine; the tables are there where a test takes one."""
    if request.param == "sqlite" or "registry" not in request.fixturenames:
        return address_on(request.param, tmp_path)
    return request.getfixturevalue("server").make(f"lab_{next(_NUMBERS)}", tables_of(request.param))


@pytest.fixture
def registry(address, tmp_path):
    """An empty registry, on each engine."""
    return Registry.create(address, laboratory="Inertial laboratory", documents=str(tmp_path / "documents"))
