"""Files beside a registry reach no other file, and keep nobody waiting."""

import os
import sqlite3

import pytest

from made_up_calibrations import made_up, save
from sqlite_journals import journal_that_names
from tumble.laboratory.registry import Registry
from turntable_sessions import one_line, typed

ENDINGS = ("-journal", "-wal", "-shm")


@pytest.fixture
def place(tmp_path):
    """A registry with a result, and no journal beside it."""
    path = tmp_path / "lab.db"
    Registry.create(path).add(save(tmp_path / "a", made_up()))
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    assert not [ending for ending in ENDINGS if (tmp_path / f"lab.db{ending}").exists()]
    return path


def test_a_journal_removes_no_other_file(place, tmp_path):
    victim = tmp_path / "thesis.txt"
    content = journal_that_names(victim, place)
    victim.write_text("a thesis")
    (tmp_path / "lab.db-journal").write_bytes(content)
    assert "names a file that SQLite would remove" in one_line(listed(place))
    assert victim.exists()


def listed(place):
    done = typed("registry", "list", "--registry", place)
    assert done.code == 2
    return done.err


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_stands_for_a_journal_is_one_line(place, tmp_path, ending):
    journal = tmp_path / f"lab.db{ending}"
    victim = tmp_path / "thesis.txt"
    victim.write_text("a thesis")
    for make in (os.mkfifo, lambda path: path.hardlink_to(victim), lambda path: path.symlink_to(victim)):
        make(journal)
        assert str(journal) in one_line(listed(place))
        journal.unlink()
    assert victim.read_text() == "a thesis"
    assert typed("registry", "list", "--registry", place).code == 0
