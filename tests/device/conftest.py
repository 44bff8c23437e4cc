"""The order in which libraries are built."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="session")
def many_units() -> int:
    """Largest number of units for which a library can be built, instead of the default three."""
    return 8


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts tests of a library for many units last: in one folder cargo keeps only that built last."""
    items.sort(key=lambda item: "many_units" in getattr(item, "fixturenames", ()))
