"""The stub of `tumble.foundation.setting_models`: types of models that are made while they run."""

from __future__ import annotations

import textwrap
from pathlib import Path

from tumble import _core
from tumble.foundation.documents import Document
from tumble.foundation.setting_table import meaning

STUB = Path(__file__).parents[1] / "python" / "tumble" / "foundation" / "setting_models.pyi"
LINE = 110
HEAD = '''\
"""Made by scripts/write_settings.py from the tables of settings; edit those instead."""

from typing import Literal

from tumble.foundation.documents import Document
'''


def stub(models: dict[_core.SettingTable, type[Document]]) -> str:
    """Returns the text of the stub."""
    return "\n".join([HEAD, *(_model(table, model) for table, model in models.items())])


def _model(table: _core.SettingTable, model: type[Document]) -> str:
    fields = "".join(_field(row) for row in _core.setting_table(table))
    return f'class {model.__name__}(Document):\n    """{model.__doc__}"""\n\n{fields}'


def _field(row: _core.SettingRow) -> str:
    unit = f" In {row['unit']}." if row["unit"] else ""
    text = f'"""{meaning(row)}{unit}"""'
    lines = textwrap.wrap(text, LINE - 4, break_on_hyphens=False)
    default = str(row["default"]) if row["kind"] not in ("choice", "threshold") else f'"{row["default"]}"'
    return f"    {row['name']}: {_type(row)} = {default}\n" + "".join(f"    {line}\n" for line in lines)


def _type(row: _core.SettingRow) -> str:
    match row["kind"]:
        case "flag":
            return "bool"
        case "count":
            return "int"
        case "choice":
            return "Literal[" + ", ".join(f'"{choice}"' for choice in row["choices"]) + "]"
        case "threshold":
            return "str"
        case _:
            return "float | None" if row["none"] else "float"
