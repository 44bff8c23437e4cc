"""Processor time of each folder of tests, its children's included, printed at the end of a run."""

from __future__ import annotations

import os
from collections import defaultdict
from pathlib import PurePosixPath

import pytest

SPENT = "processor seconds"
"""Name under which a report carries what its phase of a test took."""


def spent() -> float:
    """Returns the processor seconds of this process and of its children that have ended."""
    return sum(os.times()[:4])


class ProcessorTime:
    """Adds the processor time of every phase of a test to its folder."""

    def __init__(self) -> None:
        self._by_folder: dict[str, float] = defaultdict(float)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = yield
        report.user_properties.append((SPENT, spent() - item.stash[_BEGAN]))
        item.stash[_BEGAN] = spent()
        return report

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item):
        item.stash[_BEGAN] = spent()

    def pytest_runtest_logreport(self, report):
        name, seconds = report.user_properties[-1]
        if name == SPENT:
            folder = PurePosixPath(report.nodeid.partition("::")[0]).parent
            self._by_folder[str(folder)] += seconds

    def pytest_terminal_summary(self, terminalreporter):
        terminalreporter.section("processor seconds by folder")
        for folder, seconds in sorted(self._by_folder.items(), key=lambda each: -each[1]):
            terminalreporter.write_line(f"{seconds:8.1f}  {folder}")
        terminalreporter.write_line(f"{sum(self._by_folder.values()):8.1f}  together")


_BEGAN = pytest.StashKey[float]()
