"""The list of recordings of others: by reference, each with what makes it the very same file."""

from __future__ import annotations

import re

import pytest

import foreign
from log_fixtures import made_up, write_text

ROWS = foreign.rows_of(foreign.LIST)


def test_forty_different_files_of_others_are_listed():
    assert len({row["sha256"] for row in ROWS}) >= 40
    for row in ROWS:
        assert re.fullmatch(r"[0-9a-f]{40}", row["commit"]), row
        assert re.fullmatch(r"[0-9a-f]{64}", row["sha256"]), row
        assert row["reader"] in foreign.READERS


def test_a_file_that_differs_from_its_independent_reading_is_found(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(300, temperature=False))
    row = {"sha256": foreign.checksum(path), "reader": "table", "columns": [1, 2, 3, 4, 5, 6]}
    assert foreign.verdict(path, row)[2] == "equal"
    assert foreign.verdict(path, {**row, "columns": [1, 2, 3, 4, 6, 5]})[2].startswith("differs by")
    assert foreign.verdict(path, {**row, "sha256": "0" * 64})[2] == "another version"
    assert foreign.verdict(tmp_path / "none.csv", row)[2] == "absent"


@pytest.mark.parametrize("word", ["pyulog", "pymavlink", "mavutil", "rosbags", "table", "pair"])
def test_every_independent_reader_is_used(word):
    assert any(row["reader"] == word for row in ROWS)
