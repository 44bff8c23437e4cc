"""`tumble formats`: every format that is read or written, with an example of each."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import metadata
from typing import TYPE_CHECKING, Any, Final

from tumble.cli.screen import LISTED, print_document
from tumble.cli.shared_options import JsonOption
from tumble.foundation.log_formats import LOG_FORMATS, PACKINGS

if TYPE_CHECKING:
    from rich.table import Table

FORMATS: Final = "tumble-formats/1"


def formats_command(
    as_json: JsonOption = False,
) -> None:
    """List every format that is read or written, with an example of each.

    Example: tumble formats

    Formats that need libraries which are not installed are marked, with the command to install them. Logs are
    recognised by their contents, not by their names; text is read packed too.
    """
    content = {"logs read": _logs_read(), "logs written": _logs_written(), "calibrations": _calibrations()}
    if as_json:
        packed = [packing.ending for packing in PACKINGS.values()]
        print_document(FORMATS, LISTED, {**content, "packed": packed})
        return
    from tumble.cli.screen import print_summary

    for title, rows in content.items():
        print_summary(_table(title, rows))
    print(f"Text is read packed too: {' '.join(packing.ending for packing in PACKINGS.values())}")
    for line in _remedies():
        print(line)


def _logs_read() -> list[dict[str, Any]]:
    return [
        {
            "format": each.name,
            "what": each.what,
            "endings": list(each.endings),
            "extra": each.extra,
            "installed": not _missing(each.extra),
            "example": each.example,
        }
        for each in LOG_FORMATS
    ]


def _logs_written() -> list[dict[str, Any]]:
    from tumble.logs.writers import FORMATS as WRITTEN
    from tumble.tools.convert.procedure import TARGETS

    names = {each.name: each.what for each in LOG_FORMATS}
    outputs = {name: f"drive.{name}" if name in WRITTEN else "drive" for name in TARGETS}
    return [
        {
            "format": name,
            "what": names[name],
            "example": f"tumble convert drive.bag --format {name} -o {output}",
        }
        for name, output in outputs.items()
    ]


def _calibrations() -> list[dict[str, Any]]:
    from tumble.tools.exchange.registry import TARGETS

    return [
        {
            "format": word,
            "what": target.title,
            "read": target.read is not None,
            "example": f"tumble export imu.yaml --format {word} -o imu{target.ending}",
        }
        for word, target in TARGETS.items()
    ]


def _missing(extra: str) -> list[str]:
    """Returns the libraries of an extra that are not installed."""
    from tumble.tools.doctor.libraries import requirements

    return [
        each.name for each in requirements() if extra and each.extra == extra and not _installed(each.name)
    ]


def _installed(library: str) -> bool:
    try:
        metadata.version(library)
    except metadata.PackageNotFoundError:
        return False
    return True


def _remedies() -> Iterator[str]:
    from tumble.logs.optional import install_command

    for extra in dict.fromkeys(each.extra for each in LOG_FORMATS if each.extra):
        if missing := _missing(extra):
            yield f"Not installed: {', '.join(missing)}; type: {install_command(extra)}"


def _table(title: str, rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("format", "what", title=title, title_justify="left")
    marks = {"extra": ("needs", _needs), "read": ("import", lambda row: "yes" if row["read"] else "")}
    shown = [mark for key, mark in marks.items() if key in rows[0]]
    for name, _ in shown:
        table.add_column(name)
    table.add_column("example")
    for row in rows:
        table.add_row(row["format"], row["what"], *(say(row) for _, say in shown), row["example"])
    return table


def _needs(row: dict[str, Any]) -> str:
    return f"{row['extra']}{'' if row['installed'] else ' (not installed)'}"
