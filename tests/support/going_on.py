"""Tests that go on where the one before ended: once one has failed, the rest of its file waits in vain."""

from __future__ import annotations

import pytest


class GoingOn:
    """Plugin that skips what goes on from a test that failed; the failure itself stays one."""

    def __init__(self) -> None:
        self._failed: dict[object, str] = {}
        """Name of the first test that failed, by its module."""

    def pytest_runtest_setup(self, item):
        """Skips a test whose module has one that failed."""
        if name := self._failed.get(item.getparent(pytest.Module)):
            pytest.skip(f"goes on from {name}, which failed")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        """Notes a failure among tests that go on from one another."""
        report = yield
        if report.failed and _goes_on(item):
            self._failed.setdefault(item.getparent(pytest.Module), item.name)
        return report


def _goes_on(item) -> bool:
    mark = item.get_closest_marker("random_order")
    return mark is not None and mark.kwargs.get("disabled", False)
