"""`verify` finds one flipped bit anywhere: in a row, in the chain, in a document."""

from __future__ import annotations

import contextlib
import random
import signal
import sqlite3
from dataclasses import replace
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import text

from hostile_places import patient
from made_up_calibrations import made_up, save
from repetitions import repetitions
from simulated_clock import DATE
from tumble.foundation.errors import TumbleError
from tumble.laboratory import database
from tumble.laboratory.chain import Entry, next_entry
from tumble.laboratory.registry import Registry
from tumble.laboratory.schema_faults import schema_faults
from tumble.laboratory.tables import METADATA
from turntable_sessions import one_line, typed

LIMITS = {"accelerometer": {"bias": 0.5}}


@pytest.fixture
def filled(registry, tmp_path):
    """A registry with two results and their documents."""
    registry.add(save(tmp_path / "a", made_up(limits=LIMITS), made_up(serial="2", log="2")))
    assert registry.verify().intact
    return registry


@contextlib.contextmanager
def behind(registry):
    """A connection past the registry, with its triggers off."""
    if registry.address.path is None:
        url = registry.address.url.set(drivername="postgresql").render_as_string(hide_password=False)
        with psycopg.connect(url) as connection:
            connection.execute("SET session_replication_role = replica")
            yield connection
        return
    connection = sqlite3.connect(registry.address.path)
    made = connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
    for name, _ in made:
        connection.execute(f"DROP TRIGGER {name}")
    yield connection
    for _, sql in made:
        connection.execute(sql)
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    "change",
    ["INSERT INTO alembic_version VALUES ('0')", "DELETE FROM alembic_version"],
    ids=["more", "less"],
)
def test_a_row_beside_the_chain_is_one_line_everywhere(filled, change):
    with behind(filled) as connection:
        connection.execute(change)
    place = filled.database.address
    stated = place.path or place.url.render_as_string(hide_password=False)
    for words in (("verify", "--registry", stated), ("list", "--registry", stated), ("init", stated)):
        done = typed("registry", *words)
        assert done.code == 2, words
        assert "of its tables, as no registry does; restore it from a backup" in one_line(done.err)


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE parameter SET value = value + 1e-12 WHERE name = 'accelerometer bias x'",
        "UPDATE parameter SET u = NULL WHERE name = 'accelerometer bias y'",
        "UPDATE calibration SET verdict = 'pass'",
        "UPDATE unit SET serial = '0043' WHERE serial = '0042'",
        "UPDATE session SET operator = 'Eve'",
        "UPDATE decision SET why = 'x'",
        "UPDATE document SET size = size + 1",
        "UPDATE registry SET laboratory = 'Another'",
        "UPDATE entry SET date = '2020-01-01T00:00:00Z' WHERE number = 2",
        "UPDATE entry SET who = 'Eve' WHERE number = 3",
        "UPDATE entry SET previous = hash WHERE number = 2",
        "UPDATE entry SET hash = previous WHERE number = 3",
        "DELETE FROM parameter WHERE name = 'accelerometer scale z'",
        "DELETE FROM recording",
        "INSERT INTO equipment VALUES ('x', 2, '', '', '', '', '', '', '', '', '', NULL)",
        "INSERT INTO parameter (calibration, name, entry, unit, origin, measured) "
        "SELECT calibration, 'new', entry, unit, origin, measured FROM parameter "
        "WHERE name = 'accelerometer bias x'",
    ],
)
def test_a_change_behind_the_registry_is_found(filled, change):
    with behind(filled) as connection:
        connection.execute(change)
    found = filled.verify()
    assert not found.intact, change
    assert all("\n" not in fault for fault in found.faults)


@pytest.mark.parametrize("change", ["UPDATE entry SET who = 'Eve'", "DELETE FROM parameter"])
def test_the_engine_itself_refuses_changes(filled, change):
    with (
        pytest.raises(TumbleError, match="rows of the registry are never changed"),
        filled.database.writing() as connection,
    ):
        connection.execute(text(change))
    assert filled.verify().intact


def test_entries_cut_off_at_the_end_show_by_the_hash_noted_before(filled):
    head = filled.verify().head
    with behind(filled) as connection:
        tables = ("parameter", "decision", "calibration", "recording", "session", "document", "unit", "entry")
        for table in tables:
            connection.execute(f"DELETE FROM {table} WHERE {'number' if table == 'entry' else 'entry'} = 3")
    assert filled.verify().intact
    (fault,) = filled.verify(head=head).faults
    assert "entries at the end are missing" in fault


def test_a_trigger_that_was_dropped_is_found(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    with sqlite3.connect(tmp_path / "lab.db") as connection:
        connection.execute("DROP TRIGGER calibration_no_update")
    assert "calibration_no_update" in registry.verify().faults[0]


def test_one_flipped_bit_of_a_document_is_found(filled):
    folder = Path(filled.documents.place)
    drawn = random.Random(7)
    for path in sorted(folder.glob("??/*")):
        content = bytearray(path.read_bytes())
        place = drawn.randrange(8 * len(content))
        content[place // 8] ^= 1 << place % 8
        whole = path.read_bytes()
        path.write_bytes(content)
        (fault,) = filled.verify().faults
        assert path.name in fault
        with pytest.raises(TumbleError, match="was changed since it was stored"):
            filled.document(path.name)
        path.write_bytes(whole)
    path.unlink()
    assert "document is missing" in filled.verify().faults[0]


def contents(path):
    """All rows of all tables, as the driver reads them."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.text_factory = bytes
        names = [
            name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        ]
        return {
            name: sorted(map(repr, connection.execute(f"SELECT * FROM {name.decode()}"))) for name in names
        }


@pytest.mark.parametrize("seed", range(repetitions(8)))
def test_one_flipped_bit_of_the_file_is_found_or_changes_no_row(tmp_path, seed):
    path = tmp_path / "lab.db"
    registry = Registry.create(path)
    registry.add(save(tmp_path / "a", made_up(limits=LIMITS)))
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    whole, before = path.read_bytes(), contents(path)
    drawn = random.Random(seed)
    print("seed", seed)
    for _ in range(40):
        place = drawn.randrange(8 * len(whole))
        content = bytearray(whole)
        content[place // 8] ^= 1 << place % 8
        path.write_bytes(content)
        for beside in tmp_path.glob("lab.db-*"):
            beside.unlink()
        if found_intact(path):
            assert contents(path) == before, place


def found_intact(path):
    """True if the registry opens and nothing is found wrong with it."""
    try:
        return Registry(path).verify().intact
    except TumbleError:
        return False


def test_a_registry_with_a_fault_ends_the_command_with_3(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    assert typed("registry", "verify", "--registry", tmp_path / "lab.db").code == 0
    with behind(registry) as connection:
        connection.execute("UPDATE session SET station = 'x'")
    done = typed("registry", "verify", "--registry", tmp_path / "lab.db")
    assert done.code == 3
    assert "fault: entry 2" in done.out


@pytest.mark.parametrize(
    ("statement", "fault"),
    [
        ("CREATE TABLE extra(n)", "table 'extra': is none of a registry, and can change what is added"),
        (
            "CREATE TRIGGER t AFTER INSERT ON entry BEGIN SELECT 1; END",
            "trigger 't': is none of a registry, and can change what is added",
        ),
        (
            'CREATE VIEW "v\n[31m" AS SELECT 1',
            r"view 'v\n[31m': is none of a registry, and can change what is added",
        ),
        ("DROP INDEX ix_document_entry", "index ix_document_entry: is missing"),
    ],
)
def test_what_a_registry_is_not_made_of_is_found(tmp_path, statement, fault):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    with contextlib.closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        connection.execute(statement)
        connection.commit()
    assert registry.verify().faults == (fault,)
    done = typed("registry", "verify", "--registry", tmp_path / "lab.db")
    assert (done.code, done.err) == (3, "")
    assert fault in done.out


@pytest.mark.parametrize("name", ["t", "sqlite_x", "sqlite_stat1", "sqlite_stat4", "SQLITE_STAT1", "unit"])
def test_a_trigger_that_drops_rows_is_found_by_any_name(tmp_path, name):
    registry = Registry.create(tmp_path / "lab.db")
    known = {table.name for table in METADATA.sorted_tables}
    hide = "INSERT INTO sqlite_master (type, name, tbl_name, rootpage, sql) VALUES ('trigger', ?, ?, 0, ?)"
    with contextlib.closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        connection.execute("PRAGMA writable_schema = ON")
        for number, table in enumerate(sorted(known)):
            own = f"{name}{number}" if number else name
            drops = f"CREATE TRIGGER {own} BEFORE INSERT ON {table} BEGIN SELECT RAISE(IGNORE); END"
            connection.execute(hide, (own, table, drops))
        connection.commit()
    registry.add(save(tmp_path / "a", made_up()))
    assert list(registry.list()) == []
    found = [each for each in registry.verify().faults if "is none of a registry" in each]
    assert len(found) == len(known)


ENDLESS = "instr(zeroblob(8000000), CAST(zeroblob(4000000) || x'31' AS BLOB)) IS NOT 7"
"""Expression of one instruction that takes hours, which no look at a clock ends."""


@pytest.mark.parametrize(
    "expression",
    [
        f"CHECK ({ENDLESS})",
        "CHECK (instr(replace(hex(zeroblob(999999)), '00', 'aaaa'), hex(zeroblob(999999)) || 'b') IS NOT 7)",
        f"DEFAULT ({ENDLESS}) CHECK ({ENDLESS})",
    ],
)
def test_no_expression_of_a_changed_schema_is_evaluated(tmp_path, expression):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    with contextlib.closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute(
            "UPDATE sqlite_master SET sql = replace(sql, 'station TEXT NOT NULL', ?) WHERE name = 'session'",
            (f"station TEXT NOT NULL {expression}",),
        )
        connection.commit()
    with patient():
        assert registry.verify().faults == ("table session: was changed: it is not as a registry is made",)


def test_a_statement_without_end_is_given_up(filled, monkeypatch):
    if not filled.database.is_sqlite:
        pytest.skip("of a server the answer is bounded")
    monkeypatch.setattr(database, "_LEAST_STEPS", 10 * database._STEPS)
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT max(i) FROM n"
    refused = pytest.raises(TumbleError, match="takes longer to read than its size explains; restore it")
    with refused, filled.database.reading() as connection:
        connection.execute(text(endless))
    assert filled.verify().intact


def test_control_c_ends_a_statement_of_a_file(filled):
    if not filled.database.is_sqlite:
        pytest.skip("the driver of a server heeds it")
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT max(i) FROM n"

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(KeyboardInterrupt), filled.database.reading() as connection:
            connection.execute(text(endless))
    finally:
        signal.signal(signal.SIGALRM, before)


def test_statistics_of_queries_are_no_fault(filled):
    with filled.database.writing() as connection:
        connection.execute(text("ANALYZE"))
    assert filled.verify().intact


def test_an_entry_before_its_predecessor_is_found(tmp_path, monkeypatch):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    first, second = _entries(tmp_path / "lab.db")[:2]
    with contextlib.closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        connection.execute("DROP TRIGGER entry_no_update")
        earlier = next_entry(first, first.date, second.who, second.what, {})
        row = replace(earlier, date="2001-01-01T00:00:00Z", content=second.content)
        connection.execute(
            "UPDATE entry SET date = ?, hash = ? WHERE number = 2", (row.date, row.expected_hash)
        )
        connection.commit()
    faults = registry.verify().faults
    assert f"entry 2: is of 2001-01-01T00:00:00Z, before the entry before it, of {first.date}" in faults


def test_a_clock_that_is_set_back_dates_no_entry_before_another(tmp_path, monkeypatch):
    registry = Registry.create(tmp_path / "lab.db")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(DATE - 86_400))
    registry.add(save(tmp_path / "a", made_up()))
    dates = [each.date for each in _entries(tmp_path / "lab.db")]
    assert len(dates) > 1
    assert dates == sorted(dates)
    assert registry.verify().intact


def _entries(path):
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        found = connection.execute("SELECT * FROM entry ORDER BY number").fetchall()
    return [Entry(**dict(row)) for row in found]


def test_one_bit_in_the_schema_is_found_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    path = tmp_path / "lab.db"
    Registry.create(path).add(save(tmp_path / "a", made_up()))
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        definitions = [
            row[0].encode() for row in connection.execute("SELECT sql FROM sqlite_master") if row[0]
        ]
    whole = path.read_bytes()
    drawn = random.Random(5)
    for _ in range(repetitions(160)):
        definition = drawn.choice(definitions)
        place = whole.index(definition) + drawn.randrange(len(definition))
        changed = bytearray(whole)
        changed[place] ^= 1 << drawn.randrange(8)
        path.write_bytes(changed)
        for rest in path.parent.glob("lab.db-*"):
            rest.unlink()
        done = typed("registry", "verify", "--registry", path)
        assert done.code in (2, 3), f"byte {place}"
        assert done.err.count("\n") == (done.code == 2), done.err


OTHERS = (
    ("CREATE TABLE extra(n int)", "table 'extra': is none of a registry, and can change what is added"),
    ("CREATE VIEW v AS SELECT 1", "view 'v': is none of a registry, and can change what is added"),
    (
        "CREATE RULE r AS ON INSERT TO unit DO INSTEAD NOTHING",
        "rule 'r on public.unit': is none",
    ),
    ("CREATE TABLE heir () INHERITS (parameter)", "table 'heir': is none of a registry"),
    (
        "CREATE FUNCTION lower(text) RETURNS text LANGUAGE sql AS $$ SELECT $1 $$",
        "function 'public.lower(",
    ),
    ("CREATE POLICY p ON entry USING (false)", "policy 'p on public.entry': is none of a registry"),
    ("CREATE SEQUENCE s", "sequence 's': is none of a registry"),
    ("DROP INDEX ix_document_entry", "index ix_document_entry: is missing"),
    ("CREATE INDEX i ON unit (owner)", "index 'i': is none of a registry"),
    ("ALTER TABLE unit ADD COLUMN more int", "column 'more': is none of a registry"),
    ("ALTER TABLE unit ALTER COLUMN owner SET DEFAULT 'Eve'", "column unit.owner: was changed"),
    ("ALTER TABLE parameter ALTER COLUMN value TYPE real", "column parameter.value: was changed"),
    ("ALTER TABLE unit DISABLE TRIGGER unit_unchanged", "unit: the trigger unit_unchanged that refuses"),
    (
        "CREATE OR REPLACE FUNCTION tumble_refuse_change() RETURNS trigger LANGUAGE plpgsql AS "
        "$$ BEGIN RETURN NULL; END $$",
        "entry: the trigger entry_unchanged that refuses changes is missing",
    ),
    (
        "CREATE TRIGGER t BEFORE INSERT ON unit FOR EACH ROW EXECUTE FUNCTION tumble_refuse_change()",
        "trigger 't on public.unit': is none of a registry, and can change what is added",
    ),
    (
        "CREATE OR REPLACE FUNCTION tumble_refuse_change() RETURNS trigger LANGUAGE plpgsql AS "
        "$$ BEGIN RAISE EXCEPTION 'no'; EXCEPTION WHEN OTHERS THEN RETURN NULL; END $$",
        "unit: the trigger unit_unchanged that refuses changes is missing",
    ),
    (
        "DROP TRIGGER unit_unchanged ON unit; CREATE TRIGGER unit_unchanged BEFORE UPDATE OF entry OR DELETE "
        "OR TRUNCATE ON unit EXECUTE FUNCTION tumble_refuse_change()",
        "unit: the trigger unit_unchanged that refuses changes is missing",
    ),
    (
        "ALTER TRIGGER unit_unchanged ON unit RENAME TO x; CREATE TRIGGER unit_unchanged BEFORE UPDATE OR "
        "DELETE OR TRUNCATE ON alembic_version EXECUTE FUNCTION tumble_refuse_change()",
        "trigger 'unit_unchanged on public.alembic_version': is none of a registry",
    ),
    ("ALTER TABLE unit ADD CHECK (lower(serial) <> 'x')", "table constraint 'unit_serial_check"),
    ("ALTER TABLE unit ADD EXCLUDE USING btree (owner WITH =)", "table constraint 'unit_owner_excl"),
    ("CREATE DOMAIN d AS text CHECK (value <> 'x')", "type 'd': is none of a registry"),
    (
        "CREATE SCHEMA s; CREATE FUNCTION s.f(text, varchar) RETURNS boolean LANGUAGE sql AS 'SELECT true'; "
        "CREATE OPERATOR = (LEFTARG = text, RIGHTARG = varchar, FUNCTION = s.f)",
        "operator 'public.=(pg_catalog.text,character varying)': is none of a registry",
    ),
    (
        "CREATE SCHEMA s; CREATE TABLE s.heir () INHERITS (parameter)",
        "table 'heir': is none of a registry",
    ),
    (
        "DROP INDEX unit_name; CREATE INDEX unit_name ON unit (name) WHERE lower(name) <> 'x'",
        "index unit_name: was changed",
    ),
    ("ALTER TABLE unit ENABLE ROW LEVEL SECURITY", "table unit: was changed"),
    ("ALTER TABLE parameter SET UNLOGGED", "table parameter: was changed"),
    ('ALTER TABLE unit ALTER COLUMN owner TYPE text COLLATE "C"', "column unit.owner: was changed"),
    ("ALTER TABLE unit DROP CONSTRAINT unit_pkey", "table unit: was changed"),
    (
        "ALTER TABLE decision DROP CONSTRAINT decision_entry_fkey; ALTER TABLE decision ADD CONSTRAINT "
        "decision_entry_fkey FOREIGN KEY (entry) REFERENCES entry NOT VALID",
        "key decision_entry_fkey: was changed",
    ),
    (
        "SET session_replication_role = replica; ALTER TABLE unit DISABLE TRIGGER ALL",
        "key unit_entry_fkey: was",
    ),
)
"""Statements for PostgreSQL, and the fault that each is."""


BOOLEAN = "(text, varchar) RETURNS boolean LANGUAGE sql AS 'SELECT true'"
OF_EXTENSIONS = (
    (f"CREATE FUNCTION lower{BOOLEAN}", "FUNCTION lower(text, varchar)", "function"),
    (
        "CREATE FUNCTION count(text) RETURNS int LANGUAGE sql AS 'SELECT 1'",
        "FUNCTION count(text)",
        "function",
    ),
    (
        "CREATE FUNCTION s.f(text, varchar) RETURNS text LANGUAGE sql AS 'SELECT $1'; "
        "CREATE AGGREGATE max(varchar) (SFUNC = s.f, STYPE = text)",
        "AGGREGATE max(varchar)",
        "aggregate",
    ),
    (
        f"CREATE FUNCTION s.f{BOOLEAN}; "
        "CREATE OPERATOR = (LEFTARG = text, RIGHTARG = varchar, FUNCTION = s.f)",
        "OPERATOR = (text, varchar)",
        "operator",
    ),
    (
        "CREATE FUNCTION s.f(oid, regclass) RETURNS boolean LANGUAGE sql AS 'SELECT false'; "
        "CREATE OPERATOR = (LEFTARG = oid, RIGHTARG = regclass, FUNCTION = s.f)",
        "OPERATOR = (oid, regclass)",
        "operator",
    ),
    (
        "CREATE FUNCTION s.f(name, text) RETURNS text LANGUAGE sql AS $$ SELECT '' $$; "
        "CREATE OPERATOR || (LEFTARG = name, RIGHTARG = text, FUNCTION = s.f)",
        "OPERATOR || (name, text)",
        "operator",
    ),
    (
        "CREATE FUNCTION s.f(varchar) RETURNS int LANGUAGE sql AS 'SELECT 1'; "
        "CREATE CAST (varchar AS int) WITH FUNCTION s.f(varchar) AS IMPLICIT",
        "CAST (varchar AS int)",
        "cast",
    ),
    ("CREATE VIEW v AS SELECT 1", "VIEW v", "view"),
    ("CREATE SEQUENCE q", "SEQUENCE q", "sequence"),
    ("CREATE TABLE more ()", "TABLE more", "table"),
    ("CREATE TABLE s.heir () INHERITS (parameter)", "TABLE s.heir", "table"),
    ("CREATE OPERATOR FAMILY f USING btree", "OPERATOR FAMILY f USING btree", "operator family"),
)
"""Statements that make objects, their names for an extension to take them, and their kinds."""
HARMLESS = (
    ("CREATE FUNCTION digest(text) RETURNS text LANGUAGE sql AS 'SELECT $1'", "FUNCTION digest(text)"),
    ("CREATE TYPE hue AS ENUM ('red')", "TYPE hue"),
    (
        "CREATE FUNCTION s.lower(varchar) RETURNS text LANGUAGE sql AS 'SELECT $1'",
        "FUNCTION s.lower(varchar)",
    ),
    ("CREATE TYPE s.hue AS (x int)", "TYPE s.hue"),
)
"""The same of objects that no statement of a registry can take for others."""


IN_THE_SERVER_S_OWN = (
    (
        "CREATE FUNCTION pg_catalog.lower(varchar) RETURNS text LANGUAGE sql AS 'SELECT NULL::text'",
        "function",
    ),
    (
        f"CREATE FUNCTION s.f{BOOLEAN}; "
        "CREATE OPERATOR pg_catalog.= (LEFTARG = text, RIGHTARG = varchar, FUNCTION = s.f)",
        "operator",
    ),
)


class _RollBackError(Exception):
    """Ends a transaction that changes nothing."""


@pytest.mark.parametrize("address", ["postgresql"], indirect=True)
def test_what_a_registry_on_a_server_is_not_made_of_is_found(registry):
    assert registry.verify().faults == ()
    for statement, fault in OTHERS:
        with contextlib.suppress(_RollBackError), registry.database.writing() as connection:
            connection.execute(text(statement))
            found = schema_faults(connection)
            assert [each for each in found if each.startswith(fault)], (statement, found)
            raise _RollBackError
    with registry.database.writing() as connection:
        connection.execute(text(OTHERS[0][0]))
    assert registry.verify().faults == (OTHERS[0][1],)


@pytest.mark.parametrize("address", ["postgresql"], indirect=True)
def test_an_extension_hides_nothing_in_the_schema_of_a_registry(registry):
    def faults(*statements):
        found = []
        with contextlib.suppress(_RollBackError), registry.database.writing() as connection:
            for statement in ("CREATE SCHEMA s", *statements):
                connection.execute(text(statement))
            found = schema_faults(connection)
            raise _RollBackError
        return found

    for statement, name, kind in OF_EXTENSIONS:
        for statements in ((statement,), (statement, f"ALTER EXTENSION plpgsql ADD {name}")):
            found = faults(*statements)
            assert any(each.startswith(f"{kind} '") for each in found), (statements, found)
    for statement, kind in IN_THE_SERVER_S_OWN:
        found = faults(statement)
        assert [each.startswith(f"{kind} 'pg_catalog.") for each in found] == [True], (statement, found)
    for statement, name in HARMLESS:
        assert faults(statement, f"ALTER EXTENSION plpgsql ADD {name}") == [], statement


@pytest.mark.parametrize("address", ["postgresql"], indirect=True)
def test_the_path_of_a_role_hides_nothing(registry):
    """A schema of others stands before the server's own, as whoever owns a role can have it."""
    url = registry.address.url.set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(url) as connection:
        (role, schema) = connection.execute("SELECT current_user, current_schema()").fetchone()
        for statement in (
            "CREATE SCHEMA evil",
            "CREATE FUNCTION evil.pg_identify_object(oid, oid, integer, OUT type text, OUT schema text, "
            "OUT name text, OUT identity text) RETURNS SETOF record LANGUAGE sql AS "
            "$$ SELECT NULL::text, NULL::text, NULL::text, NULL::text WHERE false $$",
            f'ALTER ROLE "{role}" SET search_path = "{schema}", evil, pg_catalog',
            "CREATE RULE sneaky AS ON INSERT TO equipment DO ALSO NOTHING",
        ):
            connection.execute(statement)
    try:
        faults = registry.verify().faults
        with registry.database.reading() as connection:
            assert connection.execute(text("SHOW search_path")).scalar() == f"{schema}, pg_temp"
    finally:
        with psycopg.connect(url) as connection:
            connection.execute(f'ALTER ROLE "{role}" RESET search_path')
    assert [each for each in faults if each.startswith("rule 'sneaky on")], faults
