"""The registry: a laboratory's record of units, equipment, runs, results and decisions.

Every addition is an entry of the chain. Nothing is changed or deleted: what is newer supersedes.
"""

from __future__ import annotations

import getpass
import json
import socket
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeAlias

from sqlalchemy import Connection, Select, Table, exists, func, insert, or_, select

from tumble.calibration.decision import rule_in_words
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.days import mistake_in_date
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_status import expanded, is_file, is_folder
from tumble.foundation.files import make_file
from tumble.foundation.names import normal_name
from tumble.foundation.provenance import date_now
from tumble.foundation.results import Row, Tabular
from tumble.foundation.words import quoted
from tumble.laboratory import tables
from tumble.laboratory.address import RegistryAddress, parse_address
from tumble.laboratory.chain import Entry, Record, Value, next_entry, sha256_of_json, stored
from tumble.laboratory.database import PATIENCE, Database, RegistryError
from tumble.laboratory.documents import Documents, documents_beside
from tumble.laboratory.results import (
    SIMPLE,
    Result,
    beyond_limits,
    limits_document,
    read_results,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from tumble.calibration.document import Calibration
    from tumble.calibration.limits import Limits
    from tumble.laboratory.history import Lot, UnitHistory
    from tumble.laboratory.verification import Verification

SHORT = 12
"""Letters of an identity that commands print; more are needed only where two begin alike."""
IN_SERVICE = "in service"
CONDITIONS = ("", "as found", "as left")
"""States of a unit in which a result may have been found; the first is not stated."""
NewRows: TypeAlias = dict[str, list[dict[str, Value]]]
"""Rows to add, by table."""
_MOST_LISTED = 1000
_LARGEST_NUMBER = (1 << 63) - 1
"""Largest integer of SQLite and PostgreSQL."""
_BATCH = 25
"""Results of one transaction: others wait no longer than these take."""


@dataclass(frozen=True, slots=True)
class UnitFacts:
    """Statements about a unit that its calibration file does not hold; what is empty is not stated."""

    manufacturer: str = ""
    model: str = ""
    lot: str = ""
    owner: str = ""
    identities: tuple[str, ...] = ()
    """Such as device ids of an autopilot."""

    def __post_init__(self) -> None:
        """Brings names into their one form; raises `TumbleError` where one is longer than any."""
        for name in ("manufacturer", "model", "lot", "owner"):
            object.__setattr__(self, name, name_of(getattr(self, name), name))
        object.__setattr__(self, "identities", tuple(name_of(each, "identity") for each in self.identities))


@dataclass(frozen=True, slots=True)
class Added:
    """A result that was handed over."""

    identity: str
    name: str
    serial: str
    is_new: bool
    """False where the registry held it before."""


@dataclass(frozen=True, slots=True)
class _Statement:
    """Statements of whoever adds results."""

    facts: UnitFacts
    condition: str
    supersedes: str | None
    who: str


class Listing(Tabular, Sequence[Row]):
    """Rows of a table, the columns of all alike."""

    def __init__(self, found: Iterable[Row]) -> None:
        self._rows = list(found)

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: Any) -> Any:  # noqa: ANN401 - a row, or a list of rows for a slice
        return self._rows[place]

    def rows(self) -> Iterator[Row]:
        """Yield the rows."""
        return iter(self._rows)

    def __repr__(self) -> str:
        return f"Listing({len(self)} rows)"


@dataclass(frozen=True, slots=True)
class Shown(Tabular):
    """A result as the registry holds it."""

    calibration: Row
    unit: Row
    session: Row
    recordings: tuple[Row, ...]
    parameters: tuple[Row, ...]
    decisions: tuple[Row, ...]
    superseded_by: tuple[str, ...]

    def rows(self) -> Iterator[Row]:
        """Yield the parameters."""
        return iter(self.parameters)


class Registry:
    """A registry that is open; `Registry.create` makes one.

    >>> import tumble
    >>> registry = tumble.Registry("lab.db")  # doctest: +SKIP
    >>> registry.list(serial="0042").to_pandas()  # doctest: +SKIP
    """

    def __init__(self, address: str | Path, *, patience: float = PATIENCE) -> None:
        """Open a registry: a file, or `postgresql://USER@HOST/DATABASE`.

        `patience` is how long to wait, s, while others write. Raises `TumbleError` in one line.
        """
        self.address: RegistryAddress = parse_address(address)
        self.database = Database(self.address, patience=patience)
        if self.address.path is not None and not is_file(self.address.path):
            raise RegistryError(f"{self.address}: no such registry; type tumble registry init {self.address}")
        with self.database.reading() as connection:
            self.database.check_version(connection)
            row = connection.execute(select(tables.registry)).mappings().one_or_none()
        if row is None:
            raise RegistryError(f"{self.address}: holds no registry; restore it from a backup")
        self.identifier: str = row["identifier"]
        self.laboratory: str = row["laboratory"]
        self.documents = _documents(row["documents"], self.address.path)

    @classmethod
    def create(
        cls, address: str | Path, *, laboratory: str = "", documents: str = "", who: str = ""
    ) -> Registry:
        """Make a registry, or bring an older one to this version; one that is up to date stays as it is.

        `documents` is a folder, or a URL that fsspec knows; of a file it is by default a folder beside it.
        """
        place = parse_address(address)
        database = Database(place)
        if place.path is None and not documents:
            documents = cls._documents_of(database)
        laboratory = name_of(laboratory, "laboratory")
        if place.path is not None:
            documents = documents or documents_beside(place.path).name
            # Nothing is made whose documents have no place.
            _documents(documents, place.path)
            make_file(place.path)
        elif "://" not in documents:
            documents = str(expanded(documents).absolute())
        database.upgrade()
        with database.writing() as connection:
            if connection.execute(select(func.count()).select_from(tables.registry)).scalar():
                return cls(address)
            row: dict[str, Value] = {
                "identifier": str(uuid.uuid4()),
                "laboratory": laboratory,
                "documents": documents,
            }
            _append(connection, {"registry": [row]}, "registry made", who)
        return cls(address)

    @classmethod
    def _documents_of(cls, database: Database) -> str:
        """Return the place of documents of a registry on a server; raises where there is none yet."""
        with database.reading() as connection:
            if database.version(connection) is not None:
                found = connection.execute(select(tables.registry.c.documents)).scalar()
                if found:
                    return str(found)
        raise RegistryError(
            f"{database.address}: a registry on a server needs a place for documents that all stations "
            "reach; give --documents FOLDER or URL"
        )

    def __enter__(self) -> Registry:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Close nothing: a connection ends with its transaction."""

    def __repr__(self) -> str:
        return f"Registry({str(self.address)!r})"

    # Adding

    def add(
        self,
        *places: Path | str,
        facts: UnitFacts | None = None,
        condition: str = "",
        supersedes: str = "",
        who: str = "",
    ) -> list[Added]:
        """Add the results in folders and files; one that is there already stays as it is.

        `condition` is `as found` or `as left`; `supersedes` is the identity of the result that one new result
        takes the place of. Raises `TumbleError`; what was added before stays.
        """
        if condition not in CONDITIONS:
            raise TumbleError(f"condition {quoted(condition)}: give {' or '.join(CONDITIONS[1:])}")
        found = list(read_results(places))
        for result in found:
            result.refuse_false_dates()
        if supersedes and len(found) != 1:
            raise TumbleError(f"--supersedes: {len(found)} results are given; give the one that supersedes")
        added: list[Added] = []
        for start in range(0, len(found), _BATCH):
            added += self._add_batch(
                found[start : start + _BATCH], facts or UnitFacts(), condition, supersedes, who
            )
        return added

    def _add_batch(
        self, found: Sequence[Result], facts: UnitFacts, condition: str, supersedes: str, who: str
    ) -> list[Added]:
        identities = [result.identity for result in found]
        with self.database.reading() as connection:
            known = set(self._known(connection, identities))
        # Documents come first: one that no row refers to does no harm, a row without its document would.
        hashes = {
            identity: self._keep_documents(result)
            for identity, result in zip(identities, found, strict=True)
            if identity not in known
        }
        added: list[Added] = []
        with self.database.writing() as connection:
            known = set(self._known(connection, identities))
            before = self._whole_identity(connection, supersedes) if supersedes else None
            stated = _Statement(facts, condition, before, who)
            for identity, result in zip(identities, found, strict=True):
                is_new = identity not in known
                if is_new:
                    known.add(identity)
                    self._add_result(connection, identity, result, hashes[identity], stated)
                else:
                    self._describe(connection, identity, stated)
                calibration = result.calibration
                added.append(Added(identity, calibration.name, calibration.serial, is_new))
        return added

    def _describe(self, connection: Connection, identity: str, stated: _Statement) -> None:
        """Enter what is stated of the unit of a result that was there already, and was not known of it."""
        c = tables.calibration.c
        key = connection.execute(select(c.unit).where(c.calibration == identity)).scalar_one()
        unit = only_row(current_units(connection, tables.unit.c.unit == key), "unit")
        new = {column: value for column, value in _stated(stated.facts).items() if unit[column] in ("", "[]")}
        if new:
            kept: dict[str, Value] = {column: value for column, value in unit.items() if column != "entry"}
            _append(connection, {"unit": [kept | new]}, "unit described", stated.who)

    def _known(self, connection: Connection, identities: Sequence[str]) -> Iterator[str]:
        column = tables.calibration.c.calibration
        yield from connection.execute(select(column).where(column.in_(identities))).scalars()

    def _keep_documents(self, result: Result) -> dict[str, tuple[str, int]]:
        """Store the documents of a result, and return hash and size of each by its kind."""
        contents = {"calibration": result.document}
        if result.page is not None:
            contents["page"] = result.page
        if result.calibration.limits is not None:
            contents["limits"] = limits_document(result.calibration.limits)
        return {kind: (self.documents.keep(content), len(content)) for kind, content in contents.items()}

    def _add_result(
        self,
        connection: Connection,
        identity: str,
        result: Result,
        documents: Mapping[str, tuple[str, int]],
        stated: _Statement,
    ) -> None:
        date = result.run.date or date_now()
        calibration = result.calibration
        unit, unit_rows = self._unit_rows(connection, calibration.name, calibration.serial, stated.facts)
        rows: NewRows = {
            "unit": unit_rows,
            "document": self._document_rows(connection, documents),
            "calibration": [
                {
                    "calibration": identity,
                    "unit": unit,
                    "session": result.session,
                    "date": date,
                    "verdict": result.run.verdict,
                    "condition": stated.condition,
                    "temperature": calibration.temperature.mean if calibration.temperature else None,
                    "document": documents["calibration"][0],
                    "page": documents["page"][0] if "page" in documents else None,
                    "supersedes": stated.supersedes,
                }
            ],
            "parameter": list(_parameter_rows(identity, result, date)),
        }
        if not self._has(connection, tables.session, "session", result.session):
            rows |= _session_rows(result, date)
        if "limits" in documents:
            rows["decision"] = [_decision_row(identity, result, documents["limits"][0])]
        _append(connection, rows, "result added", stated.who or result.run.operator)

    def _document_rows(
        self, connection: Connection, documents: Mapping[str, tuple[str, int]]
    ) -> list[dict[str, Value]]:
        return [
            {"sha256": digest, "kind": kind, "size": size}
            for kind, (digest, size) in documents.items()
            if not self._has(connection, tables.document, "sha256", digest)
        ]

    def _has(self, connection: Connection, table: Table, key: str, value: str) -> bool:
        return connection.execute(select(table.c.entry).where(table.c[key] == value)).first() is not None

    def _unit_rows(
        self, connection: Connection, name: str, serial: str, facts: UnitFacts
    ) -> tuple[str, list[dict[str, Value]]]:
        """Find the unit that a result is of; return its key, and its row where that is new or knows more."""
        current = self._unit_named(connection, name, serial, facts)
        stated = _stated(facts)
        if current is None:
            key = sha256_of_json([facts.manufacturer, facts.model, serial or ["name", name]])[:32]
            empty = dict.fromkeys(("manufacturer", "model", "lot", "owner"), "") | {"identities": "[]"}
            first: dict[str, Value] = {"unit": key, "name": name, "serial": serial, "state": IN_SERVICE}
            return key, [{**empty, **first, **stated}]
        key = str(current["unit"])
        if all(current[column] == value for column, value in stated.items()):
            return key, []
        kept: dict[str, Value] = {column: value for column, value in current.items() if column != "entry"}
        return key, [kept | stated]

    def _unit_named(
        self, connection: Connection, name: str, serial: str, facts: UnitFacts
    ) -> Mapping[str, Any] | None:
        """Find a unit by its serial, or its name where it has none, among those of that make and model."""
        column, value = (tables.unit.c.serial, serial) if serial else (tables.unit.c.name, name)
        found = [
            unit
            for unit in current_units(connection, column == stored(value))
            if (unit["serial"] == stored(serial))
            and all(not ours or not theirs or ours == theirs for ours, theirs in _kinds(facts, unit))
        ]
        if len(found) > 1:
            exact = [unit for unit in found if all(ours == theirs for ours, theirs in _kinds(facts, unit))]
            if len(exact) == 1:
                return exact[0]
            models = ", ".join(sorted(quoted(unit["model"]) for unit in found))
            raise TumbleError(
                f"{serial or name}: units of several models bear this serial ({models}); give --model"
            )
        return found[0] if found else None

    # Looking

    def list(
        self,
        *,
        serial: str | None = None,
        model: str | None = None,
        lot: str | None = None,
        procedure: str | None = None,
        most: int = _MOST_LISTED,
    ) -> Listing:
        """Return results, the latest first, of a unit (serial or name), model, lot or procedure."""
        c, u, s = tables.calibration, _latest_units(), tables.session
        chosen = (
            select(
                c.c.calibration, c.c.date, u.c.name, u.c.serial, u.c.manufacturer, u.c.model, u.c.lot,
                s.c.procedure, c.c.verdict,
                c.c.condition, s.c.operator, s.c.station, c.c.supersedes,
            )
            .join(u, u.c.unit == c.c.unit)
            .join(s, s.c.session == c.c.session)
            .order_by(c.c.date.desc(), c.c.entry.desc())
            .limit(most)
        )  # fmt: skip
        for column, value in ((u.c.model, model), (u.c.lot, lot), (s.c.procedure, procedure)):
            if value is not None:
                chosen = chosen.where(column == stored(name_of(value, column.name)))
        with self.database.reading() as connection:
            if serial is not None:
                units = [unit["unit"] for unit in units_called(connection, serial)]
                chosen = chosen.where(c.c.unit.in_(units))
            return Listing(_rows(connection, chosen))

    def show(self, identity: str) -> Shown:
        """Return a result by its identity, or the beginning of it, or the latest one of a serial or name."""
        with self.database.reading() as connection:
            whole = self._whole_identity(connection, identity)
            c = tables.calibration
            calibration = only_row(_rows(connection, select(c).where(c.c.calibration == whole)), "result")
            unit = only_row(current_units(connection, tables.unit.c.unit == calibration["unit"]), "unit")
            key = calibration["session"]
            of_key = select(tables.session).where(tables.session.c.session == key)
            session = only_row(_rows(connection, of_key), "session")
            return Shown(
                calibration=calibration,
                unit=dict(unit),
                session=session,
                recordings=_of(connection, tables.recording, "session", key, "role"),
                parameters=_of(connection, tables.parameter, "calibration", whole, "entry"),
                decisions=_of(connection, tables.decision, "calibration", whole, "entry"),
                superseded_by=tuple(
                    connection.execute(select(c.c.calibration).where(c.c.supersedes == whole)).scalars()
                ),
            )

    def document(self, digest: str) -> bytes:
        """Return a document by its hash; raises `TumbleError` where it is missing or was changed."""
        return self.documents.read(digest)

    def calibration(self, identity: str) -> Calibration:
        """Returns the calibration of a result; raises `TumbleError` where it is missing or was changed."""
        from yaml import YAMLError

        from tumble.calibration.document import Calibration
        from tumble.foundation.bounded_yaml import parse

        content = self.document(str(self.show(identity).calibration["document"]))
        try:
            return Calibration.model_validate(parse(content.decode("utf-8-sig"))[1])
        except (ValueError, YAMLError) as error:
            raise damaged("numbers of the result", " ".join(str(error).split())[:200]) from error

    def units(self, *, model: str | None = None, lot: str | None = None) -> Listing:
        """Return the units, of a model or lot where one is given."""
        u = _latest_units()
        chosen = select(u).order_by(u.c.serial, u.c.name)
        for column, value in ((u.c.model, model), (u.c.lot, lot)):
            if value is not None:
                chosen = chosen.where(column == stored(name_of(value, column.name)))
        with self.database.reading() as connection:
            return Listing(_rows(connection, chosen))

    def entries(self) -> Listing:
        """Return the chain: who added what, and when."""
        with self.database.reading() as connection:
            return Listing(_rows(connection, select(tables.entry).order_by(tables.entry.c.number)))

    def _whole_identity(self, connection: Connection, identity: str) -> str:
        """Complete the beginning of an identity; of a serial or name take the latest result."""
        c = tables.calibration
        wanted = str(stored(name_of(identity, "unit")))
        if wanted and set(wanted) <= set("0123456789abcdef"):
            column = c.c.calibration
            chosen = select(column).where(column >= wanted, column < f"{wanted}g").limit(2)
            found = list(connection.execute(chosen).scalars())
            if len(found) == 1:
                return str(found[0])
        units = [unit["unit"] for unit in units_called(connection, wanted)]
        chosen = select(c.c.calibration).where(c.c.unit.in_(units))
        latest = connection.execute(chosen.order_by(c.c.date.desc(), c.c.entry.desc()).limit(1)).scalar()
        if latest is None:
            raise TumbleError(
                f"{quoted(wanted)}: no result of the registry begins like that, and no unit is called so; "
                "see tumble registry list"
            )
        return str(latest)

    @contextmanager
    def appending(self, what: str, who: str) -> Iterator[tuple[Connection, NewRows]]:
        """Open a transaction; the rows that the block lays into the mapping become one entry."""
        rows: NewRows = {}
        with self.database.writing() as connection:
            yield connection, rows
            _append(connection, rows, what, who)

    # Checking and copying; these rooms know the registry, not the other way round.

    def verify(self, *, head: str = "") -> Verification:
        """Recompute all hashes; `head` is the hash of the last entry as an earlier check returned it."""
        from tumble.laboratory.verification import verify

        return verify(self, head=head)

    def export(self, path: Path | str, **chosen: str | None) -> int:
        """Write parameters into a `.csv` or `.json` file; `chosen` may be serial, model and lot."""
        from tumble.laboratory.export import export

        return export(self, Path(path), **chosen)

    def backup(self, folder: Path | str) -> Verification:
        """Copy the registry and its documents into a new folder, and verify the copy."""
        from tumble.laboratory.backup import backup

        return backup(self, Path(folder))

    def history(self, unit: str, limits: Limits | None = None) -> UnitHistory:
        """Return a unit, by serial or name, over time, with its drift and due date.

        Without `limits` those hold that it was last checked against.
        """
        from tumble.laboratory.history import history_of

        return history_of(self, unit, limits)

    def due(self, unit: str, limits: Limits | None = None) -> str:
        """Return the date on which a unit is due, as in `2027-06-30`; empty where there is none."""
        return self.history(unit, limits).due

    def lot(self, *, lot: str = "", model: str = "", limits: Limits | None = None) -> Lot:
        """Return the capability of a lot or model, and how well its units are measured again."""
        from tumble.laboratory.history import lot_of

        return lot_of(self, lot=lot, model=model, limits=limits)

    def equipment(self) -> Listing:
        """Return references, tables and chambers with the dates at which they are due."""
        from tumble.laboratory.equipment import listed

        return listed(self)

    def to_pandas(self) -> DataFrame:
        """Return all results as a data frame; raises `TumbleError` where pandas is not installed."""
        return self.list(most=1 << 31).to_pandas()


def name_of(text: str, what: str) -> str:
    """Return a name in its one form; raises `TumbleError` where it is longer than any. `what` names it."""
    try:
        return normal_name(text)
    except ValueError as error:
        raise TumbleError(f"{what}: {error}; give a shorter one") from error


def _stated(facts: UnitFacts) -> dict[str, Value]:
    """Return what is stated of a unit, by column."""
    columns: dict[str, Value] = {
        "manufacturer": facts.manufacturer,
        "model": facts.model,
        "lot": facts.lot,
        "owner": facts.owner,
        "identities": json.dumps(list(facts.identities)) if facts.identities else "",
    }
    return {column: stored(value) for column, value in columns.items() if value}


def _parameter_rows(identity: str, result: Result, date: str) -> Iterator[dict[str, Value]]:
    for each in result.parameters:
        yield {
            "calibration": identity,
            "name": each.name,
            "value": each.value,
            "u": each.u,
            "common": each.common,
            "unit": each.unit,
            "origin": each.origin,
            "measured": each.measured or date,
        }


def _decision_row(identity: str, result: Result, limits: str) -> dict[str, Value]:
    decision = result.calibration.decision
    return {
        "calibration": identity,
        "limits": limits,
        "rule": SIMPLE if decision is None else rule_in_words(decision),
        "verdict": result.run.verdict,
        "why": "; ".join(beyond_limits(result) if decision is None else decision.not_passed()),
    }


def _session_rows(result: Result, date: str) -> dict[str, list[dict[str, Value]]]:
    content, run = result.content, result.run
    row: dict[str, Value] = {
        "session": result.session,
        "procedure": run.procedure,
        "station": run.station,
        "operator": run.operator,
        "software": run.software,
        "options": json.dumps(run.options, sort_keys=True),
        "began": date,
        "gravity": content.get("gravity", {}).get("value"),
        "temperature": content.get("temperature", {}).get("mean"),
        "humidity": None,
    }
    recordings: dict[tuple[str, str], dict[str, Value]] = {}
    for role, log in result.recordings():
        # A log without a hash was never a file: its name distinguishes it.
        digest = log.get("sha256") or f"name {log['file']}"
        recordings[digest, role] = {
            "session": result.session,
            "sha256": digest,
            "role": role,
            "file": log["file"],
            "format": None,
            "rate": None,
            "duration": log.get("duration"),
        }
    return {"session": [row], "recording": list(recordings.values())}


def _append(
    connection: Connection, rows: Mapping[str, Sequence[Mapping[str, Value]]], what: str, who: str
) -> Entry | None:
    """Append an entry with its rows to the chain; nothing where there are none."""
    if not any(rows.values()):
        return None
    e = tables.entry
    last = connection.execute(select(e).order_by(e.c.number.desc()).limit(1)).mappings().one_or_none()
    number = 1 if last is None else last["number"] + 1
    if number > _LARGEST_NUMBER:
        raise damaged("numbers of entries", f"{number - 1} is the largest that can be stored")
    whole: dict[str, list[Record]] = {
        table: [{**{key: stored(value) for key, value in row.items()}, "entry": number} for row in found]
        for table, found in rows.items()
    }
    author = str(stored(name_of(who or _user(), "who adds")))
    date = date_now()
    if mistake := mistake_in_date(date):
        raise TumbleError(f"the date of the entry, {date}, {mistake}")
    entry = next_entry(None if last is None else Entry(**last), date, author, what, whole)
    connection.execute(insert(e).values(asdict(entry)))
    for table in tables.OF_ENTRIES:
        if found := whole.get(table.name):
            connection.execute(insert(table), [dict(row) for row in found])
    return entry


def _documents(stated: str, path: Path | None) -> Documents:
    """Return the documents of a registry: those beside its file before those that it states.

    A copy has them beside it, and states the place that the registry had which it was copied from.
    """
    if path is None:
        return Documents(stated)
    beside = documents_beside(path)
    return Documents(beside.name if is_folder(beside) else stated, path.parent)


def _user() -> str:
    try:
        name = getpass.getuser()
    except (OSError, KeyError):
        name = "somebody"
    return f"{name}@{socket.gethostname()}"


def only_row(rows: Iterable[Mapping[str, Any]], what: str) -> dict[str, Any]:
    """Return the one row; raises `RegistryError` where a registry that was damaged has none, or several."""
    found = [dict(row) for row in rows]
    if len(found) != 1:
        raise RegistryError(f"holds {len(found)} rows of one {what}; check it with tumble registry verify")
    return found[0]


def stored_json(content: str | bytes, what: str) -> Any:  # noqa: ANN401 - JSON is anything
    """Return what stored JSON stands for; raises `RegistryError` where it was damaged."""
    try:
        return parse_json(content)
    except ValueError as error:
        raise damaged(what, str(error)) from error


def damaged(what: str, why: str) -> RegistryError:
    """Return the error that something stored is not what it should be."""
    return RegistryError(
        f"the {what} that it holds are damaged ({why}); check it with tumble registry verify"
    )


def _rows(connection: Connection, chosen: Select[Any]) -> Iterator[Row]:
    return (dict(row) for row in connection.execute(chosen).mappings())


def _of(connection: Connection, table: Table, key: str, value: object, order: str) -> tuple[Row, ...]:
    chosen = select(table).where(table.c[key] == value).order_by(table.c[order])
    return tuple(_rows(connection, chosen))


def _latest_units() -> Any:  # noqa: ANN401 - a subquery
    """Select each unit as its latest row has it."""
    u = tables.unit
    newer = tables.unit.alias("newer")
    later = select(newer.c.entry).where(newer.c.unit == u.c.unit, newer.c.entry > u.c.entry)
    return select(u).where(~exists(later)).subquery("units")


def current_units(connection: Connection, condition: Any) -> Iterator[Mapping[str, Any]]:  # noqa: ANN401
    """Yield units of which some row meets a condition, each as its latest row has it."""
    u = tables.unit
    keys = list(connection.execute(select(u.c.unit).where(condition).distinct()).scalars())
    latest: dict[str, Any] = {}
    for row in connection.execute(select(u).where(u.c.unit.in_(keys)).order_by(u.c.entry)).mappings():
        latest[row["unit"]] = row
    yield from latest.values()


def units_called(connection: Connection, name: str) -> Iterator[Mapping[str, Any]]:
    """Yield units of that serial; where there are none, those of that name."""
    u, wanted = tables.unit.c, stored(name_of(name, "unit"))
    found = list(current_units(connection, u.serial == wanted))
    yield from found or current_units(connection, or_(u.name == wanted, u.unit == wanted))


def _kinds(facts: UnitFacts, unit: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    return (facts.manufacturer, unit["manufacturer"]), (facts.model, unit["model"])
