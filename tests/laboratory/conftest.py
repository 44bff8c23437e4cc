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
def tables(tmp_path_factory):
    """Contents of a file with the tables of a registry: migrations take longer than most tests after them."""
    path = tmp_path_factory.mktemp("tables") / "tables.db"
    make_file(path)
    Database(parse_address(str(path))).upgrade()
    return path.read_bytes()


@pytest.fixture(scope="session")
def template(server):
    """Name of a database on the server with the tables of a registry and no row."""
    name = "tables"
    Database(parse_address(server.make(name))).upgrade()
    return name


@pytest.fixture(scope="session", autouse=True)
def migrations_run_once(tables):
    """A new file gets the tables that migrations have made in another one."""
    upgrade, own = Database.upgrade, os.getpid()

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
def address(request, address_on, tmp_path):
    """Address with room for a registry, on each engine; the tables are there where a test takes one."""
    if request.param == "sqlite" or "registry" not in request.fixturenames:
        return address_on(request.param, tmp_path)
    return request.getfixturevalue("server").make(
        f"lab_{next(_NUMBERS)}", request.getfixturevalue("template")
    )


@pytest.fixture
def registry(address, tmp_path):
    """An empty registry, on each engine."""
    return Registry.create(address, laboratory="Inertial laboratory", documents=str(tmp_path / "documents"))
