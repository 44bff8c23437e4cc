"""Schema of a registry's database, held against what a registry is made of: no more, no less, not otherwise.

Whatever else lies in a schema can change or drop what is added, and leave a chain of hashes that is intact.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sqlalchemy import Connection, inspect, text

from tumble.foundation.files import make_file
from tumble.foundation.words import plain, quoted
from tumble.laboratory import tables
from tumble.laboratory.address import RegistryAddress
from tumble.laboratory.database import Database

_OF_CHAIN = [table.name for table in (tables.entry, *tables.OF_ENTRIES)]
"""Tables of which nothing is changed or removed."""
_STATISTICS = {
    ("table", "sqlite_stat1"): ("sqlite_stat1", "CREATE TABLE sqlite_stat1(tbl,idx,stat)", 1),
    ("table", "sqlite_stat4"): (
        "sqlite_stat4",
        "CREATE TABLE sqlite_stat4(tbl,idx,neq,nlt,ndlt,sample)",
        1,
    ),
}
"""Tables that ANALYZE of SQLite makes, which change no row; nothing else may bear such a name."""
_REFUSING_TRIGGERS = """
SELECT relname FROM pg_trigger JOIN pg_class ON pg_class.oid = tgrelid JOIN pg_proc ON pg_proc.oid = tgfoid
  JOIN pg_language ON pg_language.oid = prolang
WHERE relnamespace = current_schema()::regnamespace AND tgname = relname || '_unchanged'
  -- Before each statement that updates whatever column, deletes or truncates.
  AND tgtype = 58 AND tgattr::text = '' AND tgqual IS NULL AND tgenabled IN ('O', 'A') AND NOT tgisinternal
  AND proname = 'tumble_refuse_change' AND pronamespace = relnamespace AND lanname = 'plpgsql'
  AND prosrc = CAST(:refusing AS text) AND proconfig IS NULL
"""
"""Tables of PostgreSQL of which a trigger, and the function that it calls, refuse all changes."""
_OBJECTS_OF_POSTGRES = """
WITH own AS (
  SELECT oid FROM pg_namespace WHERE nspname = current_schema()
), part AS (
  SELECT classid, objid FROM pg_depend
  WHERE refclassid = 'pg_namespace'::regclass::oid AND refobjid IN (SELECT oid FROM own)
    OR refclassid = 'pg_class'::regclass::oid
    AND refobjid IN (SELECT oid FROM pg_class WHERE relnamespace IN (SELECT oid FROM own))
  -- The server's own schema stands before that of the registry.
  UNION SELECT 'pg_operator'::regclass::oid, oid FROM pg_operator
    WHERE oprnamespace = 'pg_catalog'::regnamespace::oid AND oid >= CAST(:first AS oid)
  UNION SELECT 'pg_proc'::regclass::oid, oid FROM pg_proc
    WHERE pronamespace = 'pg_catalog'::regnamespace::oid AND oid >= CAST(:first AS oid)
  UNION SELECT 'pg_cast'::regclass::oid, oid FROM pg_cast
    WHERE oid >= CAST(:first AS oid) AND castsource < CAST(:first AS oid) AND casttarget < CAST(:first AS oid)
)
SELECT found.type, coalesce(found.name, found.identity) FROM part
  LEFT JOIN pg_class ON part.classid = 'pg_class'::regclass::oid AND pg_class.oid = part.objid
  LEFT JOIN pg_type ON part.classid = 'pg_type'::regclass::oid AND pg_type.oid = part.objid
  LEFT JOIN pg_proc ON part.classid = 'pg_proc'::regclass::oid AND pg_proc.oid = part.objid
  LEFT JOIN pg_class AS row_of ON row_of.oid = pg_type.typrelid
  LEFT JOIN pg_constraint ON part.classid = 'pg_constraint'::regclass::oid AND pg_constraint.oid = part.objid
  LEFT JOIN pg_trigger ON part.classid = 'pg_trigger'::regclass::oid AND pg_trigger.oid = part.objid
  LEFT JOIN pg_class AS triggered ON triggered.oid = tgrelid
  LEFT JOIN pg_rewrite ON part.classid = 'pg_rewrite'::regclass::oid AND pg_rewrite.oid = part.objid
  LEFT JOIN pg_class AS viewed ON viewed.oid = ev_class,
  LATERAL pg_identify_object(part.classid, part.objid, 0) AS found
-- Of an extension, types and functions change no statement, but functions by the name of one of the server.
WHERE NOT (
    (pg_type.oid IS NOT NULL OR pg_proc.oid IS NOT NULL AND NOT EXISTS (
      SELECT FROM pg_proc AS known WHERE known.proname = pg_proc.proname AND known.oid < CAST(:first AS oid)))
    AND EXISTS (SELECT FROM pg_depend WHERE pg_depend.classid = part.classid
      AND pg_depend.objid = part.objid AND deptype = 'e'))
  -- Tables, indices and keys are held against the definition of a registry one by one.
  AND pg_class.relkind IS DISTINCT FROM 'i' AND pg_class.relkind IS DISTINCT FROM 't'
  AND NOT coalesce(pg_class.relkind = 'r' AND pg_class.relnamespace IN (SELECT oid FROM own), false)
  AND row_of.relkind IS DISTINCT FROM 'r'
  AND NOT coalesce(contype IN ('p', 'f', 'n'), false)
  AND NOT coalesce(tgisinternal OR tgname::text = triggered.relname::text || '_unchanged'::text
    AND triggered.relname::text = ANY(CAST(:tables AS text[])), false)
  AND NOT coalesce(pg_proc.proname = 'tumble_refuse_change' AND pg_proc.pronargs = CAST(0 AS int2)
    AND pg_proc.pronamespace IN (SELECT oid FROM own), false)
  -- What others made to read from a registry, or to plan queries, changes nothing of it.
  AND NOT coalesce(viewed.relkind = 'v' AND viewed.relnamespace NOT IN (SELECT oid FROM own), false)
  AND found.type NOT IN ('statistics object', 'publication relation', 'default value', 'default acl')
ORDER BY 1, 2
"""
"""Objects of PostgreSQL that no registry has, by their kind: whatever depends on the schema or its tables.

Each comparison is between values of one type, so that no operator or function of others fits it better.
"""
_FIRST_OF_OTHERS = 16384
"""Number from which on objects are made by users: FirstNormalObjectId of access/transam.h."""
_OF_LANGUAGE = ("operator", "function", "aggregate", "procedure", "cast")
"""Objects that change what a query means, among them those that compare the rest."""
_CHANGES_OF_POSTGRES = """
SELECT 'table', relname FROM pg_class WHERE relnamespace = current_schema()::regnamespace AND relkind = 'r'
  AND (relrowsecurity OR relforcerowsecurity OR relpersistence <> 'p')
UNION ALL SELECT 'index', relname FROM pg_index JOIN pg_class ON pg_class.oid = indexrelid
  WHERE relnamespace = current_schema()::regnamespace AND (indpred IS NOT NULL OR indexprs IS NOT NULL)
UNION ALL SELECT 'column', relname || '.' || attname FROM pg_attribute
  JOIN pg_class ON pg_class.oid = attrelid JOIN pg_type ON pg_type.oid = atttypid
  WHERE relnamespace = current_schema()::regnamespace AND relkind = 'r' AND attnum > 0
  AND NOT attisdropped AND attcollation <> typcollation
UNION ALL SELECT 'key', conname FROM pg_constraint
  WHERE connamespace = current_schema()::regnamespace AND NOT convalidated
UNION ALL SELECT DISTINCT 'key', conname FROM pg_trigger
  JOIN pg_constraint ON pg_constraint.oid = tgconstraint
  WHERE connamespace = current_schema()::regnamespace AND tgisinternal AND tgenabled NOT IN ('O', 'A')
ORDER BY 1, 2
"""
"""Parts of a registry that are not as it is made, in ways that its definition does not state."""


def schema_faults(connection: Connection) -> list[str]:
    """Returns what a database holds that a registry is not made of, and what it lacks."""
    of_engine = _file_faults if connection.dialect.name == "sqlite" else _server_faults
    return list(of_engine(connection))


def _file_faults(connection: Connection) -> Iterator[str]:
    """Hold tables, indices and triggers against those of a new registry; others can change what is added."""
    expected = dict(_of_new_file())
    found = _schema(connection)
    for name, times in sorted(Counter(name for name, _ in found).items()):
        if (name not in expected and name not in _STATISTICS) or times > 1:
            yield f"{plain(name[0])} {quoted(name[1])}: is none of a registry, and can change what is added"
    stated = dict(found)
    for name, definition in sorted((expected | _STATISTICS).items()):
        if name in stated and stated[name] != definition:
            yield f"{name[0]} {name[1]}: was changed: it is not as a registry is made"
        elif name not in stated and name not in _STATISTICS:
            yield f"{name[0]} {name[1]}: is missing"


@cache
def _of_new_file() -> tuple[tuple[tuple[str, str], tuple[object, ...]], ...]:
    """Return the schema of a new registry, which this process makes once: no other has another one."""
    with TemporaryDirectory() as folder:
        new = Database(RegistryAddress(Path(folder) / "new.db"))
        make_file(Path(folder) / "new.db")
        new.upgrade()
        with new.reading() as made:
            return tuple(_schema(made))


def _schema(connection: Connection) -> list[tuple[tuple[str, str], tuple[object, ...]]]:
    """Return kind and name of each object, with table, definition and whether it has pages."""
    chosen = text("SELECT type, name, tbl_name, sql, rootpage <> 0 FROM sqlite_master")
    return [((str(kind), str(name)), tuple(rest)) for kind, name, *rest in connection.execute(chosen)]


def _server_faults(connection: Connection) -> Iterator[str]:
    """Holds what a schema of PostgreSQL holds against what a registry is made of."""
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    from tumble.laboratory.migrations.versions.v1_first import REFUSING

    given = {"tables": _OF_CHAIN, "first": _FIRST_OF_OTHERS}
    others = connection.execute(text(_OBJECTS_OF_POSTGRES), given).all()
    for kind, name in others:
        yield f"{plain(kind)} {quoted(name)}: is none of a registry, and can change what is added"
    if any(kind in _OF_LANGUAGE for kind, _ in others):
        return
    told = {"compare_type": True, "compare_server_default": True}
    for difference in compare_metadata(MigrationContext.configure(connection, opts=told), tables.METADATA):
        yield _difference_in_words(difference)
    for kind, name in connection.execute(text(_CHANGES_OF_POSTGRES)):
        yield f"{kind} {plain(name)}: was changed: it is not as a registry is made"
    found = set(connection.execute(text(_REFUSING_TRIGGERS), {"refusing": REFUSING}).scalars())
    for name in _OF_CHAIN:
        if name not in found:
            yield f"{name}: the trigger {name}_unchanged that refuses changes is missing"
    inspector = inspect(connection)
    for table in tables.METADATA.sorted_tables:
        columns = inspector.get_pk_constraint(table.name)["constrained_columns"]
        if set(columns) != {column.name for column in table.primary_key}:
            yield f"table {table.name}: was changed: its rows are not told apart as in a registry"


def _difference_in_words(difference: Any) -> str:  # noqa: ANN401 - tuples of several forms, or a list of them
    """Describes a difference of a database from the tables of a registry, as alembic states it."""
    first = difference[0] if isinstance(difference, list) else difference
    word, *about = first
    what = next((each for each in about if hasattr(each, "name")), None)
    kind, name = word.partition("_")[2], getattr(what, "name", None)
    if word.startswith("remove_"):
        return f"{kind} {quoted(str(name))}: is none of a registry, and can change what is added"
    if word.startswith("add_"):
        return f"{kind} {name}: is missing"
    return (
        f"column {'.'.join(str(each) for each in first[2:4])}: was changed: it is not as a registry is made"
    )
