"""How tests are shared out when several processes run them."""

from __future__ import annotations

import pytest

DEVICE = {"firmware", "package", "test_capi.py", "test_benchmarks.py"}
"""What builds for the device does so in folders that it shares, so one process has all of it."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Keeps the tests of a file together, whose fixtures are dear, and all that build for the device.

    Before pytest-xdist looks for the groups.
    """
    for item in items:
        shares = DEVICE.intersection(item.path.parts)
        item.add_marker(pytest.mark.xdist_group("device" if shares else item.path.name))
