"""Pages and screens of all procedures, made once for the tests of a process."""

from __future__ import annotations

import pytest

import dated_logs


@pytest.fixture(scope="session")
def dated_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("dated")


@pytest.fixture(scope="session")
def shown(dated_folder):
    """Output of every procedure on dated logs, by the word it is called by."""
    return dated_logs.shown_by_all(dated_folder)
