"""Write what is made from the table of records, or with --check report what is stale.

The bytes of a record in docs/record-format.md: names, meanings, units and order from the core's table in
crates/tumble-core/src/redundancy/record.rs.
"""

from __future__ import annotations

import sys

from made_files import ROOT, page_with, write_or_check

from tumble import _core

PAGE = ROOT / "docs" / "record-format.md"
NUMBER = 4
HEAD = [
    (2, '`54 52`, "TR"', ""),
    (1, "version of the format: {version}", ""),
    (8, "identity of the unit, integer", ""),
    (1, "sensor: 0 accelerometer, 1 gyroscope", ""),
    (
        1,
        "fitted model: 0 offset, 1 offset and gain, 2 offset and matrix, 3 offset, matrix and lever arm",
        "",
    ),
    (1, "number of directions of motion along which M was fitted, integer", ""),
    (4, "number of fitted pairs, integer", ""),
    (4, "number of calibrations of this sensor, integer", ""),
]
"""Bytes, meaning and unit of each field before the numbers."""


def table() -> str:
    """Returns the table of the version that is written."""
    rows = _core.record_table()
    numbers = [
        (NUMBER * row["count"], f"`{row['name']}`: {row['meaning'].rstrip('.')}", row["unit"]) for row in rows
    ]
    lines = ["", "| offset | bytes | what | unit |", "|---|---|---|---|"]
    offset = 0
    for size, meaning, unit in [*HEAD, *numbers]:
        meaning = meaning.format(version=rows[-1]["version"])
        lines.append(f"| {offset} | {size} | {meaning} | {unit} |".replace("|  |", "| |"))
        offset += size
    temperature = offset + 1
    lines += [
        f"| {offset} | 1 | 1: a temperature follows; 0: none does | |",
        f"| {temperature} | {NUMBER} or 0 | temperature while it was calibrated | degC |",
        f"| {temperature + NUMBER} or {temperature} | 4 | CRC-32 of all bytes before it | |",
    ]
    return "\n".join([*lines, "", ""])


if __name__ == "__main__":
    sys.exit(write_or_check([(PAGE, page_with(PAGE, "record", table()))], __doc__, __file__))
