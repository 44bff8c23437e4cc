"""Equipment of a laboratory: references, tables, chambers and thermometers, and when they are due."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sqlalchemy import select

from tumble.foundation.days import day_of
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.provenance import date_now
from tumble.foundation.results import Row
from tumble.foundation.words import quoted
from tumble.laboratory import tables
from tumble.laboratory.chain import Value, sha256_of_json, stored
from tumble.laboratory.registry import IN_SERVICE, Listing, Registry, name_of

KINDS = ("reference", "table", "chamber", "thermometer")
LARGEST_CERTIFICATE = 64 << 20
"""Bytes."""
_COLUMNS = ("kind", "manufacturer", "model", "serial", "certificate", "due", "uncertainty", "state")


def add(
    registry: Registry, name: str, stated: Mapping[str, str], document: Path | str = "", who: str = ""
) -> None:
    """Add a piece of equipment, or what is new of one that is there; raises `TumbleError`."""
    if "kind" in stated and stated["kind"] not in KINDS:
        raise TumbleError(f"--kind {quoted(stated['kind'])}: give one of {', '.join(KINDS)}")
    if "due" in stated and day_of(stated["due"]) is None:
        raise TumbleError(f"--due {quoted(stated['due'])}: give a date such as 2027-06-30")
    name = name_of(name, "equipment")
    stated = {key: name_of(value, f"--{key}") for key, value in stated.items()}
    content = read_whole(Path(document), LARGEST_CERTIFICATE, "certificate") if document else None
    digest = registry.documents.keep(content) if content is not None else None
    key = sha256_of_json(name)[:32]
    e, d = tables.equipment, tables.document
    with registry.appending("equipment", who) as (connection, rows):
        latest = select(e).where(e.c.equipment == key).order_by(e.c.entry.desc()).limit(1)
        before = connection.execute(latest).mappings().one_or_none()
        if before is None and "kind" not in stated:
            raise TumbleError(f"{quoted(name)}: is new; give --kind {', '.join(KINDS)}")
        first: dict[str, Value] = {**dict.fromkeys(_COLUMNS, ""), "state": IN_SERVICE, "document": None}
        row = {"equipment": key, "name": name} | (first if before is None else _kept(before)) | dict(stated)
        if digest is not None and content is not None:
            row["document"] = digest
            if connection.execute(select(d.c.sha256).where(d.c.sha256 == digest)).first() is None:
                rows["document"] = [{"sha256": digest, "kind": "certificate", "size": len(content)}]
        if before is None or _kept(before) != {key: stored(row[key]) for key in _kept(before)}:
            rows["equipment"] = [row]


def listed(registry: Registry) -> Listing:
    """Return all equipment as it is now, with whether it is past its date, the first due first."""
    e = tables.equipment
    latest: dict[str, Row] = {}
    with registry.database.reading() as connection:
        for row in connection.execute(select(e).order_by(e.c.entry)).mappings():
            latest[row["equipment"]] = dict(row)
    today = date_now()[:10]
    found = [
        row | {"overdue": row["state"] == IN_SERVICE and "" < str(row["due"]) < today}
        for row in latest.values()
    ]
    return Listing(sorted(found, key=lambda row: (str(row["due"]) or "9999", str(row["name"]))))


def _kept(row: Mapping[Any, Any]) -> dict[str, Value]:
    return {column: row[column] for column in (*_COLUMNS, "document")}
