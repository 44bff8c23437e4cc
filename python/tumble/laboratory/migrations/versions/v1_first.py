"""First version: all tables, and triggers that refuse any change of a row."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import sqlite

revision = "1"
down_revision = None
branch_labels = None
depends_on = None

_NUMBER: Any = sa.Double().with_variant(sqlite.REAL(), "sqlite")
_TEXTS = {
    "entry": "date who what content previous hash",
    "registry": "laboratory documents",
    "unit": "name serial manufacturer model lot identities owner state",
    "equipment": "kind name manufacturer model serial certificate due uncertainty state",
    "document": "kind",
    "session": "procedure station operator software options began",
    "recording": "file",
    "calibration": "unit session date verdict condition document",
    "parameter": "unit origin measured",
    "decision": "rule verdict why",
    "certificate": "issued",
    "certificate_calibration": "",
}
_KEYS = {
    "registry": ["identifier"],
    "unit": ["unit", "entry"],
    "equipment": ["equipment", "entry"],
    "document": ["sha256"],
    "session": ["session"],
    "recording": ["session", "sha256", "role"],
    "calibration": ["calibration"],
    "parameter": ["calibration", "name"],
    "decision": ["calibration", "limits"],
    "certificate": ["number", "entry"],
    "certificate_calibration": ["number", "calibration"],
}
_FURTHER: dict[str, dict[str, Any]] = {
    "equipment": {"document": sa.Text()},
    "document": {"size": sa.Integer()},
    "session": dict.fromkeys(("gravity", "temperature", "humidity"), _NUMBER),
    "recording": {"format": sa.Text(), "rate": _NUMBER, "duration": _NUMBER},
    "calibration": {"temperature": _NUMBER, "page": sa.Text(), "supersedes": sa.Text()},
    "parameter": dict.fromkeys(("value", "u", "common"), _NUMBER),
    "certificate": dict.fromkeys(("pdf", "xml", "withdrawn", "reason", "superseded_by"), sa.Text()),
}
_REQUIRED = ("size",)
_POINTERS = {
    "recording": {"session": "session.session"},
    "calibration": {
        "session": "session.session",
        "document": "document.sha256",
        "page": "document.sha256",
        "supersedes": "calibration.calibration",
    },
    "parameter": {"calibration": "calibration.calibration"},
    "decision": {"calibration": "calibration.calibration"},
    "certificate": {"pdf": "document.sha256", "xml": "document.sha256"},
    "certificate_calibration": {"calibration": "calibration.calibration"},
}
_INDICES: dict[str, tuple[str, list[str]]] = {
    "unit_serial": ("unit", ["serial"]),
    "unit_name": ("unit", ["name"]),
    "unit_model": ("unit", ["model", "unit"]),
    "unit_lot": ("unit", ["lot", "unit"]),
    "unit_entry": ("unit", ["entry"]),
    "equipment_entry": ("equipment", ["entry"]),
    "calibration_unit": ("calibration", ["unit", "date"]),
    "calibration_date": ("calibration", ["date", "entry"]),
    "calibration_supersedes": ("calibration", ["supersedes"]),
    "calibration_entry": ("calibration", ["entry"]),
    **{
        f"ix_{table}_entry": (table, ["entry"])
        for table in (
            *("document", "session", "recording", "parameter", "decision", "certificate_calibration"),
        )
    },
    "certificate_entry": ("certificate", ["entry"]),
    "certificate_calibration_calibration": ("certificate_calibration", ["calibration"]),
}
_REFUSAL = "rows of the registry are never changed"
REFUSING = f" BEGIN RAISE EXCEPTION '{_REFUSAL}'; END "
"""Body of the function of PostgreSQL that refuses changes; `verify` holds the server's against it."""


def upgrade() -> None:
    """Make tables, indices and triggers."""
    op.create_table(
        "entry",
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        *_texts("entry"),
        sqlite_strict=True,
    )
    for table, keys in _KEYS.items():
        pointers = {"entry": "entry.number"} | _POINTERS.get(table, {})
        columns: list[Any] = [
            *(sa.Column(key, sa.Text, nullable=False) for key in keys if key != "entry"),
            sa.Column("entry", sa.Integer, nullable=False),
            *(each for each in _texts(table) if each.name not in keys),
            *(
                sa.Column(name, kind, nullable=name not in _REQUIRED)
                for name, kind in _FURTHER.get(table, {}).items()
            ),
        ]
        op.create_table(
            table,
            *columns,
            sa.PrimaryKeyConstraint(*keys),
            *(sa.ForeignKeyConstraint([name], [target]) for name, target in pointers.items()),
            sqlite_strict=True,
        )
    for name, (table, indexed) in _INDICES.items():
        op.create_index(name, table, indexed)
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"CREATE FUNCTION tumble_refuse_change() RETURNS trigger LANGUAGE plpgsql AS $${REFUSING}$$"
        )
    for table in _TEXTS:
        _refuse_changes(table)


def _texts(table: str) -> list[sa.Column[str]]:
    return [sa.Column(name, sa.Text, nullable=False) for name in _TEXTS[table].split()]


def _refuse_changes(table: str) -> None:
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"CREATE TRIGGER {table}_unchanged BEFORE UPDATE OR DELETE OR TRUNCATE ON {table} "
            "FOR EACH STATEMENT EXECUTE FUNCTION tumble_refuse_change()"
        )
        return
    for change in ("UPDATE", "DELETE"):
        op.execute(
            f"CREATE TRIGGER {table}_no_{change.lower()} BEFORE {change} ON {table} "
            f"BEGIN SELECT RAISE(ABORT, '{_REFUSAL}'); END"
        )
