"""Where results go: the option `-o` of all commands that write a folder, and what it is if not given."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from tumble.foundation.errors import OutputError
from tumble.foundation.file_names import file_stem
from tumble.foundation.file_status import is_file
from tumble.foundation.log_formats import stem_of
from tumble.logs.spec import parse_spec


def output_path(text: str) -> Path:
    """Reads what follows `-o`; raises `OutputError` where it is empty, which would be the current folder."""
    if not text.strip():
        raise OutputError("--output is empty; give a name, or leave it out")
    return Path(text)


OutputFolder: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        parser=output_path,
        help="Folder for all results, made where missing; ./NAME-tumble if not given.",
        show_default=False,
    ),
]


OutputFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        parser=output_path,
        help="File to write; ./NAME-tumble with the ending of its format if not given.",
        show_default=False,
    ),
]


def folder_named_after(name: str) -> Path:
    """Returns the folder for what is found of a log, a unit or a source of that name: `./NAME-tumble`."""
    return Path(f"{file_stem(name)}-tumble")


def file_named_after(name: str, format_name: str) -> Path:
    """Corrected log of a unit, `./NAME-tumble.csv`: in its own format, where that can be written."""
    written = {"ros1": "mcap", "ros2": "mcap", "mcap": "mcap", "parquet": "parquet"}.get(format_name, "csv")
    return Path(f"{file_stem(name)}-tumble.{written}")


def folder_for(source: str) -> Path:
    """Folder for what is found in LOG or LOG:NAME; raises `LogError` where there is no such log."""
    path = parse_spec(source).path.resolve()
    return folder_named_after(stem_of(path) if is_file(path) else path.name)
