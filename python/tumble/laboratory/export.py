"""Results for other programs: tables of parameters as CSV or JSON, and documents as files."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path

from sqlalchemy import select

from tumble.calibration.document import KIND
from tumble.foundation.errors import OutputError
from tumble.foundation.file_names import file_stem
from tumble.foundation.files import PAGE, FileKind, prepare_folder, replacing
from tumble.foundation.results import Row
from tumble.foundation.words import ESCAPED, defused, utf8
from tumble.laboratory import tables
from tumble.laboratory.registry import Registry, Shown

COLUMNS = (
    *(
        "result",
        "date",
        "serial",
        "name",
        "manufacturer",
        "model",
        "lot",
        "procedure",
        "verdict",
        "condition",
    ),
    *("operator", "station", "parameter", "value", "u", "common", "unit", "measured"),
)
_CSV = FileKind("a table of the registry", re.compile(rb"\A\"?result\"?,\"?date\"?,\"?serial\"?,"))
_JSON = FileKind(
    "a table of the registry",
    re.compile(rb"\A\[\s*(\{\s*\"result\":[^\n]*\n\s*\"date\":[^\n]*\n\s*\"serial\":|\]\s*\Z)"),
)


def parameter_rows(
    registry: Registry, *, serial: str | None = None, model: str | None = None, lot: str | None = None
) -> Iterator[Row]:
    """Yield all parameters of results, the earliest result first."""
    found = registry.list(serial=serial, model=model, lot=lot, most=1 << 31)
    p = tables.parameter
    with registry.database.reading() as connection:
        for row in reversed(found):
            chosen = select(p).where(p.c.calibration == row["calibration"]).order_by(p.c.name)
            for each in connection.execute(chosen).mappings():
                number = {key: each[key] for key in ("value", "u", "common", "unit", "measured")}
                whole = dict(row) | {"result": row["calibration"], "parameter": each["name"]} | number
                yield {column: whole[column] for column in COLUMNS}


def export(
    registry: Registry,
    path: Path,
    *,
    serial: str | None = None,
    model: str | None = None,
    lot: str | None = None,
) -> int:
    """Write parameters into a `.csv` or `.json` file, and return how many; raises `TumbleError`."""
    if path.suffix not in (".csv", ".json"):
        raise OutputError(f"{path}: give a name that ends in .csv or .json")
    rows = parameter_rows(registry, serial=serial, model=model, lot=lot)
    if path.suffix == ".csv":
        return _write_csv(path, rows)
    found = list(rows)
    with replacing(path, _JSON) as file:
        file.write(utf8(json.dumps(found, indent=1) + "\n"))
    return len(found)


def _write_csv(path: Path, rows: Iterator[Row]) -> int:
    count = 0
    with replacing(path, _CSV) as file:
        text = io.TextIOWrapper(file, "utf-8", errors=ESCAPED, newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow(map(_cell, row.values()))
            count += 1
        text.detach()
    return count


def _cell(value: object) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else defused(str(value))


def write_documents(registry: Registry, found: Shown, folder: Path) -> Iterator[Path]:
    """Write the calibration file and the page of a result into a folder; raises `TumbleError`."""
    stem = file_stem(str(found.unit["name"]))
    prepare_folder(folder)
    for kind, ending, key in ((KIND, ".yaml", "document"), (PAGE, ".html", "page")):
        if (digest := found.calibration[key]) is not None:
            path = folder / f"{stem}{ending}"
            content = registry.document(str(digest))
            with replacing(path, kind) as file:
                file.write(content)
            yield path
