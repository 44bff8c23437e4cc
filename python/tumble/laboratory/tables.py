"""Tables of the registry. Rows are added and never changed: what is newer stands in a row of a later entry.

`entry` of a row is the number of the entry that added it. Dates are UTC in ISO 8601, hashes SHA-256 in
hexadecimal, numbers in SI units, angles in degrees.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Column, Double, ForeignKey, Index, Integer, MetaData, Table, Text, types
from sqlalchemy.dialects import sqlite

METADATA = MetaData()

NUMBER: types.TypeEngine[float] = Double().with_variant(sqlite.REAL(), "sqlite")
"""64 bits on both engines."""


def _table(name: str, *columns: Any) -> Table:  # noqa: ANN401 - columns, keys and indices
    return Table(name, METADATA, *columns, sqlite_strict=True)


def _text(name: str, *keys: ForeignKey, **options: Any) -> Column[str]:  # noqa: ANN401
    return Column(name, Text, *keys, nullable=False, **options)


def _entry(**options: Any) -> Column[int]:  # noqa: ANN401
    return Column("entry", Integer, ForeignKey("entry.number"), nullable=False, **options)


entry = _table(
    "entry",
    Column("number", Integer, primary_key=True, autoincrement=False),
    _text("date"),
    _text("who"),
    _text("what"),
    _text("content"),
    _text("previous"),
    _text("hash"),
)
"""The chain."""

registry = _table(
    "registry",
    _text("identifier", primary_key=True),
    _text("laboratory"),
    _text("documents"),
    _entry(),
)
"""The registry itself, one row: its name, and the place of its documents."""

unit = _table(
    "unit",
    _text("unit", primary_key=True),
    _entry(primary_key=True),
    _text("name"),
    _text("serial"),
    _text("manufacturer"),
    _text("model"),
    _text("lot"),
    _text("identities"),
    _text("owner"),
    _text("state"),
    Index("unit_serial", "serial"),
    Index("unit_name", "name"),
    Index("unit_model", "model", "unit"),
    Index("unit_lot", "lot", "unit"),
    Index("unit_entry", "entry"),
)
"""Units; the row of the latest entry holds."""

equipment = _table(
    "equipment",
    _text("equipment", primary_key=True),
    _entry(primary_key=True),
    _text("kind"),
    _text("name"),
    _text("manufacturer"),
    _text("model"),
    _text("serial"),
    _text("certificate"),
    _text("due"),
    _text("uncertainty"),
    _text("state"),
    Column("document", Text),
    Index("equipment_entry", "entry"),
)
"""References, tables, chambers and thermometers; the row of the latest entry holds."""

document = _table(
    "document",
    _text("sha256", primary_key=True),
    _entry(index=True),
    _text("kind"),
    Column("size", Integer, nullable=False),
)
"""Documents that lie under their hash in the folder of documents."""

session = _table(
    "session",
    _text("session", primary_key=True),
    _entry(index=True),
    _text("procedure"),
    _text("station"),
    _text("operator"),
    _text("software"),
    _text("options"),
    _text("began"),
    Column("gravity", NUMBER),
    Column("temperature", NUMBER),
    Column("humidity", NUMBER),
)
"""Runs of a procedure."""

recording = _table(
    "recording",
    _text("session", ForeignKey("session.session"), primary_key=True),
    _text("sha256", primary_key=True),
    _text("role", primary_key=True),
    _entry(index=True),
    _text("file"),
    Column("format", Text),
    Column("rate", NUMBER),
    Column("duration", NUMBER),
)
"""Logs that a session was computed from, by the hash of their bytes."""

calibration = _table(
    "calibration",
    _text("calibration", primary_key=True),
    _entry(),
    _text("unit"),
    _text("session", ForeignKey("session.session")),
    _text("date"),
    _text("verdict"),
    _text("condition"),
    Column("temperature", NUMBER),
    _text("document", ForeignKey("document.sha256")),
    Column("page", Text, ForeignKey("document.sha256")),
    Column("supersedes", Text, ForeignKey("calibration.calibration")),
    Index("calibration_unit", "unit", "date"),
    Index("calibration_date", "date", "entry"),
    Index("calibration_supersedes", "supersedes"),
    Index("calibration_entry", "entry"),
)
"""Results, by their identity."""

parameter = _table(
    "parameter",
    _text("calibration", ForeignKey("calibration.calibration"), primary_key=True),
    _text("name", primary_key=True),
    _entry(index=True),
    Column("value", NUMBER),
    Column("u", NUMBER),
    Column("common", NUMBER),
    _text("unit"),
    _text("origin"),
    _text("measured"),
)
"""Parameters of a result: combined standard uncertainty `u`, and the part of it, `common`, that the reference
leaves on all its targets. No value means not observable. `origin` is the hash of the run that found it."""

decision = _table(
    "decision",
    _text("calibration", ForeignKey("calibration.calibration"), primary_key=True),
    _text("limits", primary_key=True),
    _entry(index=True),
    _text("rule"),
    _text("verdict"),
    _text("why"),
)
"""Checks of a result against limits, by the hash of the document that states these."""

certificate = _table(
    "certificate",
    _text("number", primary_key=True),
    _entry(primary_key=True),
    _text("issued"),
    Column("pdf", Text, ForeignKey("document.sha256")),
    Column("xml", Text, ForeignKey("document.sha256")),
    Column("withdrawn", Text),
    Column("reason", Text),
    Column("superseded_by", Text),
    Index("certificate_entry", "entry"),
)
"""Certificates by their number; the row of the latest entry holds."""

certificate_calibration = _table(
    "certificate_calibration",
    _text("number", primary_key=True),
    _text("calibration", ForeignKey("calibration.calibration"), primary_key=True),
    _entry(index=True),
    Index("certificate_calibration_calibration", "calibration"),
)
"""Results that a certificate is of."""

OF_ENTRIES = tuple(table for table in METADATA.sorted_tables if table is not entry)
"""Tables whose rows belong to entries."""
