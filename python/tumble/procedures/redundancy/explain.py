"""`tumble redundancy --explain`: every setting with its meaning, unit and default."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from tumble.cli.screen import LISTED, print_document, print_summary
from tumble.foundation.setting_table import Explained, explain
from tumble.report.numbers import readable_unit

SETTINGS: Final = "tumble-settings/1"


def show_settings(as_json: bool) -> None:
    """Prints all settings, as a table or for a machine."""
    if as_json:
        settings = [_content(setting) for setting in explain("redundancy")]
        print_document(SETTINGS, LISTED, {"settings": settings})
        return
    print_summary(_table())
    print("State them with --set NAME=VALUE, or in a YAML file with --settings FILE.")


def default_text(setting: Explained) -> str:
    """Returns the default as it would be typed."""
    if setting.default is None:
        return "none"
    if isinstance(setting.default, bool):
        return str(setting.default).lower()
    return f"{setting.default:.10g}" if isinstance(setting.default, float) else str(setting.default)


def typed_choices(setting: Explained) -> str:
    """Returns the words that may be chosen from, as they would be typed."""
    return ", ".join(f"`{choice}`" for choice in setting.choices)


def _meaning(setting: Explained) -> str:
    choices = f" One of {typed_choices(setting)}." if setting.choices else ""
    return f"{setting.meaning}{choices}".replace("\n", " ").replace("`", "")


def _content(setting: Explained) -> dict[str, object]:
    return {
        "name": setting.name,
        "group": setting.group,
        "meaning": setting.meaning,
        "unit": setting.unit,
        "choices": setting.choices,
        "default": setting.default,
    }


def _table() -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    for title in ("setting", "default", "unit"):
        table.add_column(title, no_wrap=True)
    table.add_column("meaning")
    for row in _rows():
        table.add_row(*row)
    return table


def _rows() -> Iterator[tuple[str, ...]]:
    group = ""
    for setting in explain("redundancy"):
        if setting.group != group:
            group = setting.group
            yield (f"[bold]{group}[/bold]", "", "", "")
        unit = readable_unit(setting.unit)
        yield (f"  {setting.name}", default_text(setting), unit, _meaning(setting))
