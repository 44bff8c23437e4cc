"""Registries on both engines: a file of SQLite, and a PostgreSQL server that the tests start."""

from __future__ import annotations

from itertools import count

import pytest

import postgres
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


@pytest.fixture(params=["sqlite", "postgresql"])
def address(request, address_on, tmp_path):
    """Address with room for a registry, on each engine."""
    return address_on(request.param, tmp_path)


@pytest.fixture
def registry(address, tmp_path):
    """An empty registry, on each engine."""
    return Registry.create(address, laboratory="Inertial laboratory", documents=str(tmp_path / "documents"))
