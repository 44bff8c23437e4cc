"""Certificates in the registry: numbers, documents by hash, and which were withdrawn or superseded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, func, select

from tumble.foundation.errors import TumbleError
from tumble.foundation.provenance import date_now
from tumble.foundation.words import quoted
from tumble.laboratory import tables
from tumble.laboratory.certificate.numbering import Pattern, first_free
from tumble.laboratory.chain import Value, stored
from tumble.laboratory.registry import SHORT, Listing, NewRows, Registry

PDF = "certificate as PDF"
XML = "certificate as XML"
"""Kinds of documents."""


@dataclass(frozen=True, slots=True)
class Rendered:
    """A certificate as it is handed out."""

    number: str
    pdf: bytes
    xml: bytes


def issue(
    registry: Registry,
    pattern: Pattern,
    day: str,
    calibrations: Sequence[str],
    render: Callable[[str], Rendered],
    *,
    supersedes: str = "",
    who: str = "",
) -> Rendered:
    """Give a certificate the next number, and enter it with its documents.

    `render` makes it of its number while no other can take that; where it fails, the number is free again.
    Raises `TumbleError`, also where a result is on a certificate that holds.
    """
    with registry.appending("certificate issued", who) as (connection, rows):
        replaced = _row(connection, supersedes) if supersedes else None
        if replaced is not None and state_of(replaced) != "issued":
            raise TumbleError(f"certificate {supersedes}: is {state_of(replaced)}; give the one that holds")
        _check_not_certified(connection, calibrations, supersedes)
        number = first_free(pattern, day, lambda text: _is_taken(connection, text))
        rendered = render(number)
        rows["certificate"] = [
            {
                "number": number,
                "issued": date_now(),
                "pdf": _keep(registry, connection, rows, PDF, rendered.pdf),
                "xml": _keep(registry, connection, rows, XML, rendered.xml),
                "withdrawn": None,
                "reason": None,
                "superseded_by": None,
            }
        ]
        if replaced is not None:
            rows["certificate"].append(_copied(replaced) | {"superseded_by": number})
        rows["certificate_calibration"] = [
            {"number": number, "calibration": calibration} for calibration in calibrations
        ]
    return rendered


def replace_documents(registry: Registry, rendered: Rendered, what: str, who: str = "") -> None:
    """Enter new documents of a certificate, such as signed ones; those of before stay on record."""
    with registry.appending(what, who) as (connection, rows):
        row = _row(connection, rendered.number)
        rows["certificate"] = [
            _copied(row)
            | {
                "pdf": _keep(registry, connection, rows, PDF, rendered.pdf),
                "xml": _keep(registry, connection, rows, XML, rendered.xml),
            }
        ]


def withdraw(registry: Registry, number: str, why: str, who: str = "") -> None:
    """Withdraw a certificate; its documents stay. Raises `TumbleError` where it does not hold any more."""
    with registry.appending("certificate withdrawn", who) as (connection, rows):
        row = _row(connection, number)
        if state_of(row) != "issued":
            raise TumbleError(f"certificate {number}: is {state_of(row)} already")
        rows["certificate"] = [_copied(row) | {"withdrawn": date_now(), "reason": why}]


def certificate_row(registry: Registry, number: str) -> dict[str, Any]:
    """Return what is on record of a certificate; raises `TumbleError` where there is none of that number."""
    with registry.database.reading() as connection:
        row = dict(_row(connection, number))
        c = tables.certificate_calibration.c
        chosen = select(c.calibration).where(c.number == row["number"]).order_by(c.calibration)
        return row | {"state": state_of(row), "results": list(connection.execute(chosen).scalars())}


def documents_of(registry: Registry, number: str) -> Rendered:
    """Return the documents of a certificate; raises `TumbleError`."""
    row = certificate_row(registry, number)
    return Rendered(str(row["number"]), registry.document(row["pdf"]), registry.document(row["xml"]))


def listed(registry: Registry) -> Listing:
    """Return all certificates in the order in which they were issued."""
    c, of, k, u = tables.certificate, tables.certificate_calibration, tables.calibration, tables.unit
    latest = select(c.c.number, func.max(c.c.entry).label("entry")).group_by(c.c.number).subquery("latest")
    first = select(u.c.unit, func.max(u.c.entry).label("entry")).group_by(u.c.unit).subquery("known")
    chosen = (
        select(c, u.c.name, u.c.serial)
        .join(latest, (latest.c.number == c.c.number) & (latest.c.entry == c.c.entry))
        .join(of, of.c.number == c.c.number)
        .join(k, k.c.calibration == of.c.calibration)
        .join(first, first.c.unit == k.c.unit)
        .join(u, (u.c.unit == first.c.unit) & (u.c.entry == first.c.entry))
        .order_by(c.c.issued, c.c.number)
        .distinct()
    )
    with registry.database.reading() as connection:
        found = [dict(row) for row in connection.execute(chosen).mappings()]
    return Listing(row | {"state": state_of(row)} for row in found)


def state_of(row: Mapping[Any, Any]) -> str:
    """Return `issued`, `withdrawn` or `superseded by NUMBER`."""
    if row["superseded_by"]:
        return f"superseded by {row['superseded_by']}"
    return "withdrawn" if row["withdrawn"] else "issued"


def holding(registry: Registry, calibrations: Sequence[str]) -> dict[str, str]:
    """Return the number of the certificate that holds, of each result that is on one."""
    with registry.database.reading() as connection:
        return _holding(connection, calibrations)


def _holding(connection: Connection, calibrations: Sequence[str]) -> dict[str, str]:
    c = tables.certificate_calibration.c
    chosen = select(c.number, c.calibration).where(c.calibration.in_(calibrations)).order_by(c.number)
    return {
        calibration: number
        for number, calibration in connection.execute(chosen)
        if state_of(_row(connection, number)) == "issued"
    }


def _check_not_certified(connection: Connection, calibrations: Sequence[str], supersedes: str) -> None:
    for calibration, number in _holding(connection, calibrations).items():
        if number != supersedes:
            raise TumbleError(
                f"result {calibration[:SHORT]}: is on certificate {number}; give --supersedes {number}, or "
                f"see tumble certificate show {number}"
            )


def _row(connection: Connection, number: str) -> Mapping[str, Any]:
    c = tables.certificate
    chosen = select(c).where(c.c.number == stored(number)).order_by(c.c.entry.desc()).limit(1)
    found = connection.execute(chosen).mappings().one_or_none()
    if found is None:
        raise TumbleError(
            f"certificate {quoted(number)}: the registry has none of that number; see tumble certificate list"
        )
    return dict(found)


def _is_taken(connection: Connection, number: str) -> bool:
    c = tables.certificate.c
    return connection.execute(select(c.entry).where(c.number == number).limit(1)).first() is not None


def _copied(row: Mapping[str, Any]) -> dict[str, Value]:
    return {column: value for column, value in row.items() if column != "entry"}


def _keep(registry: Registry, connection: Connection, rows: NewRows, kind: str, content: bytes) -> str:
    digest = registry.documents.keep(content)
    d = tables.document.c
    if connection.execute(select(d.entry).where(d.sha256 == digest)).first() is None:
        rows.setdefault("document", []).append({"sha256": digest, "kind": kind, "size": len(content)})
    return digest
