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


@pytest.fixture(params=["sqlite", "postgresql"])
def address(request, tmp_path):
    """Address with room for a registry, on each engine."""
    if request.param == "sqlite":
        return tmp_path / "lab.db"
    return request.getfixturevalue("server").make(f"lab_{next(_NUMBERS)}")


@pytest.fixture
def registry(address, tmp_path):
    """An empty registry, on each engine."""
    return Registry.create(address, laboratory="Inertial laboratory", documents=str(tmp_path / "documents"))
