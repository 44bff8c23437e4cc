"""Processor time of each folder and of the longest tests, children included, printed at the end of a run."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import PurePosixPath

import pytest

SPENT = "processor seconds"
"""Name under which a report carries what its phase of a test took."""
LONGEST = 20
"""Number of tests that are printed."""


def spent() -> float:
    """Returns the processor seconds of this process and of its children that have ended."""
    return sum(os.times()[:4])


class ProcessorTime:
    """Adds the processor time of every phase of a test to its folder."""

    def __init__(self) -> None:
        self._by_folder: Counter[str] = Counter()
        self._by_test: Counter[str] = Counter()

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
        # A process that crashed reports its test without properties.
        seconds = dict(report.user_properties).get(SPENT, 0.0)
        folder = PurePosixPath(report.nodeid.partition("::")[0]).parent
        self._by_folder[str(folder)] += seconds
        self._by_test[report.nodeid] += seconds

    def pytest_terminal_summary(self, terminalreporter):
        terminalreporter.section("processor seconds of the longest tests, with what they set up")
        _print(terminalreporter, self._by_test.most_common(LONGEST))
        terminalreporter.section("processor seconds by folder")
        _print(terminalreporter, [*self._by_folder.most_common(), ("together", self._by_folder.total())])


def _print(terminalreporter, rows):
    for name, seconds in rows:
        terminalreporter.write_line(f"{seconds:8.1f}  {name}")


_BEGAN = pytest.StashKey[float]()
