"""The database below a registry: connections, transactions, and errors of drivers in one line.

A transaction that writes holds the whole registry (`BEGIN IMMEDIATE` of SQLite, an advisory lock of
PostgreSQL), so that entries follow one another; one that reads sees one state and holds nobody up.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Connection,
    Engine,
    ExceptionContext,
    bindparam,
    create_engine,
    event,
    inspect,
    text,
)
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import NullPool

from tumble.foundation.bounded_answer import ANSWERING, LARGEST_ANSWER, bounded_answer
from tumble.foundation.errors import TumbleError
from tumble.foundation.numbers import whole_number
from tumble.foundation.words import quoted
from tumble.laboratory.address import RegistryAddress
from tumble.laboratory.journals import refuse_unfit_journals
from tumble.laboratory.tables import METADATA

PATIENCE = 30.0
"""s to wait while another program writes."""
_CONNECTING = 10
"""s to wait for a server."""
_LOCK = 0x74756D626C65
"""Number of the advisory lock of PostgreSQL: `tumble` in ASCII."""
_LIMIT_OF_LENGTHS = 0
"""`SQLITE_LIMIT_LENGTH` of sqlite3.h."""
_LONGEST_VALUE = 1 << 24
"""Bytes of a value in a file: documents lie beside it, and all else is a name, a hash or a few numbers."""
_STEPS = 100_000
"""Instructions of SQLite between two looks at how many there were."""
_STEPS_A_BYTE = 64
"""Instructions for each byte of a file that a connection may take."""
_LEAST_STEPS = 5_000 * _STEPS
_DAMAGED = ("not a database", "malformed", "corrupt", "can't decode")
"""Words of errors of SQLite that mean a damaged file."""
HEAD = "1"
"""Version of the tables that this version of Tumble reads and writes."""


_COMPUTED = {
    "sqlite": text("""
SELECT name FROM sqlite_master WHERE type = 'view' AND lower(name) IN :tables
UNION ALL SELECT made.name FROM sqlite_master AS made, pragma_table_xinfo(made.name) AS part
  WHERE lower(made.name) IN :tables AND part.hidden <> 0
""").bindparams(bindparam("tables", expanding=True)),
    "postgresql": text("""
SELECT relname FROM pg_class WHERE relname = ANY(CAST(:tables AS name[]))
  AND relnamespace = current_schema()::regnamespace
  AND (relkind NOT IN ('r', 'i') OR relrowsecurity
    OR EXISTS (SELECT FROM pg_attribute WHERE attrelid = pg_class.oid AND attgenerated <> ''))
"""),
}
"""Find views, generated columns and policies in the place of a table."""


class RegistryError(TumbleError):
    """A registry cannot be reached, is locked or damaged, or of another version."""


class Database:
    """A registry's database; one process opens a connection for each transaction."""

    def __init__(self, address: RegistryAddress, *, patience: float = PATIENCE) -> None:
        self.address = address
        self._engine = _sqlite(address.path, patience) if address.path else _server(address, patience)

    @property
    def is_sqlite(self) -> bool:
        """Return True for a file of SQLite."""
        return self.address.path is not None

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """Open a transaction that sees one state; raises `RegistryError`."""
        with self._transaction(writes=False) as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """Open a transaction that no other writes beside, and commit it; raises `RegistryError`."""
        with self._transaction(writes=True) as connection:
            yield connection

    @contextmanager
    def _transaction(self, *, writes: bool) -> Iterator[Connection]:
        line: object = None
        try:
            with self._opened() as opened:
                line = opened.connection.driver_connection
                connection = opened.execution_options(writes=writes)
                if not self.is_sqlite and not writes:
                    connection = connection.execution_options(
                        isolation_level="REPEATABLE READ", postgresql_readonly=True
                    )
                with connection.begin():
                    if writes and not self.is_sqlite:
                        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
                    yield connection
        except (SQLAlchemyError, sqlite3.Error, UnicodeDecodeError) as error:
            raise_interruption(line, self.address, error)
            # SQLite repeats bytes of a damaged schema in messages that its driver cannot decode.
            raise self._in_one_line(error) from None

    def _opened(self) -> Connection:
        """Open a connection; SQLAlchemy then asks a server for its version, and relies on the answer."""
        try:
            return self._engine.connect()
        except (SQLAlchemyError, sqlite3.Error, UnicodeDecodeError, TumbleError):
            raise
        except Exception as error:
            raise _no_answer(self.address, error) from error

    def version(self, connection: Connection) -> int | None:
        """Return the version of the tables; None where there are none.

        Raises `RegistryError` for several, and for what is the version of no registry.
        """
        if not inspect(connection).has_table("alembic_version"):
            return None
        found = connection.execute(text("SELECT version_num FROM alembic_version LIMIT 2")).scalars().all()
        if len(found) != 1:
            raise RegistryError(
                f"{self.address}: states {'several versions' if found else 'no version'} of its tables, as "
                "no registry does; restore it from a backup"
            )
        stated = str(found[0])
        number = whole_number(stated)
        if not number or str(number) != stated:
            raise RegistryError(
                f"{self.address}: states version {quoted(stated)} of its tables, as no registry does; "
                "restore it from a backup"
            )
        return number

    def check_version(self, connection: Connection) -> None:
        """Raise `RegistryError` unless the tables are of this version."""
        found = self.version(connection)
        if found is None:
            raise RegistryError(
                f"{self.address}: is not a registry; type tumble registry init {self.address}"
            )
        if found == int(HEAD):
            self._refuse_computed(connection)
            return
        if found < int(HEAD):
            raise RegistryError(
                f"{self.address}: is a registry of version {found}, and needs to be {HEAD}; back it up and "
                f"type tumble registry init {self.address}"
            )
        raise RegistryError(
            f"{self.address}: is a registry of version {found}, made by a newer Tumble than this one "
            f"(version {HEAD}); upgrade Tumble"
        )

    def _refuse_computed(self, connection: Connection) -> None:
        """Raise `RegistryError` where rows of a table are computed as they are read, which may never end."""
        chosen = _COMPUTED[connection.dialect.name]
        table = connection.execute(chosen, {"tables": list(METADATA.tables)}).scalar()
        if table is not None:
            raise RegistryError(
                f"{self.address}: {table} is computed, as in no registry; restore it from a backup"
            )

    def upgrade(self) -> None:
        """Make the tables, or bring them to this version; raises `RegistryError`."""
        from alembic import command
        from alembic.config import Config

        config = Config()
        config.set_main_option(
            "script_location", str(Path(__file__).with_name("migrations")).replace("%", "%%")
        )
        with self.writing() as connection:
            found = self.version(connection) or 0
            if found > int(HEAD):
                self.check_version(connection)
            if found != int(HEAD):
                config.attributes["connection"] = connection
                command.upgrade(config, "head")
        if self.is_sqlite:
            self._keep_readers_apart()

    def _keep_readers_apart(self) -> None:
        """Have SQLite write ahead: who reads does not wait for who writes. The file remembers that."""
        try:
            with self._engine.connect() as connection:
                connection.connection.execute("PRAGMA journal_mode = WAL")
        except (SQLAlchemyError, sqlite3.Error) as error:
            raise self._in_one_line(error) from None

    def _in_one_line(self, error: Exception) -> RegistryError:
        cause = getattr(error, "orig", None) or error
        why = self.address.without_secrets(str(cause))
        low = why.lower()
        if "locked" in low and self.is_sqlite:
            remedy = "is locked by another program; wait until that has ended, and try again"
        elif "unable to open" in low:
            remedy = "cannot be opened; check the path and its permissions, or type tumble registry init"
        elif self.is_sqlite and any(word in low for word in _DAMAGED):
            remedy = f"is damaged, or is not a registry ({why}); restore it from a backup"
        elif self.is_sqlite:
            remedy = f"cannot be used: {why}; check it with tumble registry verify"
        else:
            remedy = f"the server does not answer as it should: {why}; check the address and the server"
        return RegistryError(remedy, about=str(self.address))


class _BoundedLine(sqlite3.Connection):
    """A connection to a file of which a statement ends, whatever its schema and its pages state."""

    steps_left = 0
    """Times, `_STEPS` of SQLite each, that this connection may still go on."""

    def bound(self, size: int) -> None:
        """Bounds the lengths of values, and all steps of this connection by what a whole file needs."""
        if hasattr(self, "setlimit"):  # Python 3.11
            self.setlimit(_LIMIT_OF_LENGTHS, _LONGEST_VALUE)
        self.steps_left = (_LEAST_STEPS + _STEPS_A_BYTE * size) // _STEPS
        self.set_progress_handler(self._is_over, _STEPS)

    def _is_over(self) -> bool:
        self.steps_left -= 1
        return self.steps_left < 0


def raise_interruption(line: object, about: object, error: Exception) -> None:
    """Raises what interrupted a statement of a file: Ctrl-C, or `RegistryError` beyond its bound of steps."""
    if not isinstance(line, _BoundedLine) or "interrupted" not in str(getattr(error, "orig", error)):
        return
    if line.steps_left >= 0:  # an exception ended the progress handler, which the driver drops
        raise KeyboardInterrupt from error
    raise RegistryError(
        "takes longer to read than its size explains; restore it from a backup", about=str(about)
    ) from error


def _sqlite(path: Path, patience: float) -> Engine:
    place = f"{path.as_uri()}?mode=rw"

    def connect() -> sqlite3.Connection:
        try:
            refuse_unfit_journals(path)
        except TumbleError as error:
            raise RegistryError(str(error)) from error
        # Transactions are begun by the listener below, not by the driver.
        made = sqlite3.connect(place, uri=True, timeout=patience, isolation_level=None, factory=_BoundedLine)
        made.bound(path.stat().st_size)
        made.execute("PRAGMA trusted_schema = OFF")
        made.execute("PRAGMA foreign_keys = ON")
        made.execute("PRAGMA synchronous = FULL")
        return made

    engine = create_engine("sqlite://", creator=connect, poolclass=NullPool, hide_parameters=True)

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _server(address: RegistryAddress, patience: float) -> Engine:
    assert address.url is not None
    # A longer wait for a lock is an error, as with SQLite.
    settings = f"-c lock_timeout={int(1000 * patience)} -c default_transaction_isolation=read\\ committed"
    options = {"connect_timeout": _CONNECTING, "options": settings, "application_name": "tumble"}
    stated = {name: value for name, value in options.items() if name not in address.url.query}
    engine = create_engine(address.url, connect_args=stated, poolclass=NullPool, hide_parameters=True)

    @event.listens_for(engine, "do_connect")
    def connect(_dialect: object, _record: object, places: Any, stated: Any) -> object:  # noqa: ANN401
        line = _limited_connection().connect(*places, **stated)
        _fix_search_path(line)
        return line

    @event.listens_for(engine, "handle_error")
    def explain(context: ExceptionContext) -> None:
        # A driver that cannot read a value raises an error of Python itself.
        if isinstance(error := context.original_exception, ValueError):
            raise _no_answer(address, error) from error

    return engine


def _fix_search_path(line: Any) -> None:  # noqa: ANN401 - psycopg is imported where it is needed
    """Has names mean the server's own first, then those in the schema of the registry, and no others.

    The path of a role may put functions, operators and tables of others before the server's.
    """
    from psycopg import sql

    (schema,) = line.execute("SELECT pg_catalog.current_schema()").fetchone()
    if schema is not None:
        # The server's own come first by not being named; temporary ones would without their name at the end.
        line.execute(sql.SQL("SET search_path = {}, pg_temp").format(sql.Identifier(schema)))
    line.commit()


def _no_answer(address: RegistryAddress, error: BaseException) -> RegistryError:
    why = address.without_secrets(str(error))[:200]
    return RegistryError(
        f"the server sent what is no answer: {why}; check the address and the server", about=str(address)
    )


def _limited_connection() -> Any:  # noqa: ANN401 - psycopg is imported where it is needed
    from psycopg import Connection as Line
    from psycopg import OperationalError

    class LimitedConnection(Line[Any]):
        """A connection on which an answer comes in time, of a bounded size, or is an error."""

        def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:  # noqa: ANN401
            if timeout is not None:
                return super().wait(gen, interval, timeout)
            try:
                return super().wait(bounded_answer(gen, ANSWERING, LARGEST_ANSWER), interval)
            except (TimeoutError, MemoryError) as error:
                # The server goes on with its answer, so that nothing more can be asked of it.
                self.pgconn.finish()
                raise OperationalError(str(error)) from error

    return LimitedConnection
