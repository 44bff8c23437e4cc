"""Wrong addresses, files that are none, locks and passwords: one line, and nothing secret in it."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import text

from made_up_calibrations import made_up, save
from postgres import PASSWORD
from tumble.cli.commands import _SUBCOMMANDS
from tumble.foundation.errors import TumbleError
from tumble.laboratory.address import parse_address
from tumble.laboratory.command import registry_app
from tumble.laboratory.registry import Registry
from turntable_sessions import one_line, typed


def refusal(*words):
    done = typed("registry", *words)
    assert (done.code, done.out) == (2, "")
    return one_line(done.err)


def test_a_missing_library_is_named_with_how_to_get_it(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("tumble.laboratory")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "sqlalchemy", None)
    message = refusal("list", "--registry", "lab.db")
    assert "the registry needs the Python package sqlalchemy" in message
    assert "'tumble-imu[laboratory]'" in message


def test_without_a_registry_a_command_says_how_to_set_one():
    assert "set TUMBLE_REGISTRY" in refusal("list")


@pytest.mark.parametrize(
    "content", [b"", b"no database at all\n" * 100, b"SQLite format 3\x00" + b"\xff" * 200]
)
def test_a_file_that_is_no_registry_is_refused(tmp_path, content):
    path = tmp_path / "lab.db"
    path.write_bytes(content)
    assert str(path) in refusal("list", "--registry", path)
    assert path.read_bytes() == content


def test_a_missing_registry_is_not_made_by_looking(tmp_path):
    assert "type tumble registry init" in refusal("list", "--registry", tmp_path / "lab.db")
    assert not (tmp_path / "lab.db").exists()


def test_a_locked_registry_is_refused_after_a_wait(tmp_path):
    Registry.create(tmp_path / "lab.db")
    results = save(tmp_path / "a", made_up())
    holder = sqlite3.connect(tmp_path / "lab.db", isolation_level=None)
    holder.execute("BEGIN IMMEDIATE")
    with pytest.raises(TumbleError, match="is locked by another program"):
        Registry(tmp_path / "lab.db", patience=0.1).add(results)
    assert len(Registry(tmp_path / "lab.db").list()) == 0
    holder.execute("ROLLBACK")
    holder.close()
    assert Registry(tmp_path / "lab.db").add(results)[0].is_new


def test_a_silent_server_is_one_line_without_the_password():
    address = "postgresql://ann:sesame%40@127.0.0.1:1/lab?password=sesame%40"
    message = refusal("list", "--registry", address)
    assert "sesame" not in message
    assert "postgresql://ann:***@127.0.0.1:1/lab" in message


def test_a_wrong_password_and_a_missing_database_name_no_password(server):
    for address in (server.url("nowhere"), server.url("postgres").replace("word", "wrong")):
        message = refusal("list", "--registry", address)
        assert PASSWORD not in message
        assert "word" not in message.replace("password authentication", "")


@pytest.mark.parametrize(
    "address",
    [
        "postgresql://ann:secret/word@host/lab",
        "postgresql://ann:secret@host:port/lab",
        "postgresql://ann:secret@host",
        "postgresql://ann:secret",
        "mysql://ann:secret@host/lab",
        "postgresql://ann:secret@[host/lab",
        "postgres://ann@host/lab?password=secret&connect_timeout=x",
    ],
)
def test_a_malformed_url_is_refused_without_its_password(address):
    message = refusal("list", "--registry", address)
    assert "secret" not in message


@given(st.text(st.characters(codec="ascii"), min_size=6, max_size=30).filter(lambda text: "ann" not in text))
def test_no_password_shows_in_an_address(password):
    from urllib.parse import quote

    if password in "postgresql://ann:***@host:5432/lab":
        return
    address = parse_address(f"postgresql://ann:{quote(password, safe='')}@host:5432/lab")
    assert str(address) == "postgresql://ann:***@host:5432/lab"
    assert password not in address.without_secrets(f"connection of {password} refused")
    assert password not in repr(address)


def test_text_of_others_is_shown_escaped(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    odd = made_up(name="\x1b[31mred\u202e", serial="[bold]9[/bold]")
    registry.add(save(tmp_path / "a", odd))
    for words in (("list",), ("show", "[bold]9[/bold]")):
        done = typed("registry", *words, "--registry", tmp_path / "lab.db")
        assert done.code == 0
        assert "\x1b" not in done.out
        assert "\u202e" not in done.out
        assert "[bold]9[/bold]" in done.out


@pytest.mark.parametrize("wanted", ["nobody", "", "'; DROP TABLE unit; --", "%", "a"])
def test_a_result_that_nobody_knows_is_said_in_one_line(tmp_path, wanted):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    if wanted and registry.list()[0]["calibration"].startswith(wanted):
        return
    assert "see tumble registry list" in refusal("show", wanted, "--registry", tmp_path / "lab.db")
    assert registry.verify().intact


def test_a_registry_in_a_folder_with_an_odd_name_is_one(tmp_path):
    folder = tmp_path / os.fsdecode(b"caf\xe9 %41?mode=memory#x")
    folder.mkdir()
    registry = Registry.create(folder / "lab.db")
    registry.add(save(folder / "a", made_up()))
    done = typed("registry", "verify", "--registry", folder / "lab.db")
    assert (done.code, done.err) == (0, "")
    assert sorted(path.name for path in folder.iterdir() if path.is_file()) == ["lab.db"]


def test_each_command_of_the_registry_has_settings_of_the_project():
    assert {each.name for each in registry_app.registered_commands} == {*_SUBCOMMANDS, "add"}


@pytest.mark.parametrize(
    "statement",
    [
        "ALTER TABLE parameter RENAME TO kept; CREATE VIEW parameter AS WITH RECURSIVE more(x) AS "
        "(SELECT 1 UNION ALL SELECT x + 1 FROM more) SELECT kept.* FROM kept, more",
        "ALTER TABLE parameter ADD COLUMN more BLOB AS (zeroblob(900000000))",
    ],
    ids=["view", "column"],
)
def test_a_registry_that_computes_is_refused_unread(tmp_path, statement):
    path = tmp_path / "lab.db"
    Registry.create(path)
    with sqlite3.connect(path) as database:
        database.executescript(
            f"DROP TRIGGER parameter_no_update; DROP TRIGGER parameter_no_delete; {statement}"
        )
    database.close()
    for words in (("list",), ("verify",), ("export", "rows.csv"), ("backup", "copy")):
        assert "parameter is computed, as in no registry" in refusal(*words, "--registry", path)


ENDLESS = "SELECT parameter_real.* FROM parameter_real, generate_series(1, 1000000000000)"
COMPUTED = (
    f"ALTER TABLE parameter RENAME TO parameter_real; CREATE VIEW parameter AS {ENDLESS}",
    "ALTER TABLE parameter RENAME TO parameter_real; CREATE MATERIALIZED VIEW parameter AS "
    "SELECT * FROM parameter_real",
    "ALTER TABLE parameter DROP COLUMN origin; ALTER TABLE parameter ADD COLUMN origin text "
    "GENERATED ALWAYS AS (repeat('x', 1000000000)) STORED",
    "ALTER TABLE parameter ENABLE ROW LEVEL SECURITY; ALTER TABLE parameter FORCE ROW LEVEL SECURITY; "
    "CREATE POLICY p ON parameter USING (pg_sleep(1000000) IS NULL)",
)
"""Statements that make each row of a table on a server take as long as whoever made them likes."""


@pytest.mark.parametrize("address", ["postgresql"], indirect=True)
@pytest.mark.parametrize("statements", COMPUTED)
def test_a_table_on_a_server_that_is_computed_is_refused(registry, statements):
    with registry.database.writing() as connection:
        connection.execute(text(statements))
    address = registry.address.url.set(drivername="postgresql").render_as_string(hide_password=False)
    for words in (("list",), ("verify",), ("export", "rows.csv"), ("backup", "copy")):
        assert "parameter is computed, as in no registry" in refusal(*words, "--registry", address)


def test_a_place_of_documents_that_is_none_is_a_fault(tmp_path):
    path = tmp_path / "lab.db"
    Registry.create(path)
    with sqlite3.connect(path) as database:
        database.executescript("DROP TRIGGER registry_no_update; UPDATE registry SET documents = char(0)")
    database.close()
    done = typed("registry", "verify", "--registry", path)
    assert (done.code, done.err) == (3, "")
    assert "cannot be read: embedded null byte" in done.out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("UPDATE session SET options = '['", ("show", "0042", "--json")),
        ("UPDATE unit SET identities = '{'", ("show", "0042", "--json")),
        ("UPDATE calibration SET session = 'none'", ("show", "0042")),
        ("UPDATE parameter SET measured = '9999-12-31T23:59:59Z'", ("history", "0042")),
        ("UPDATE decision SET limits = (SELECT document FROM calibration)", ("history", "0042")),
    ],
)
def test_a_row_that_was_changed_ends_no_command_with_a_trace(tmp_path, change, words):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up(limits={"accelerometer": {"bias": 0.5}})))
    with contextlib.closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
            connection.execute(f"DROP TRIGGER {name}")
        connection.execute(change)
        connection.commit()
    done = typed("registry", *words, "--registry", tmp_path / "lab.db")
    assert done.code in (0, 2)
    if done.code == 2:
        assert "check it with tumble registry verify" in one_line(done.err)
    assert not registry.verify().intact
