"""List every command of `tumble` with all its options on a page of the documentation site, from its own help.

A hook of mkdocs, named in `mkdocs.yml`; the list takes the place of `<!-- commands -->`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer

from tumble.cli.commands import COMMANDS, command_line

PLACE = "<!-- commands -->"


def on_page_markdown(markdown: str, **_: object) -> str:
    """Puts the list into the page that asks for it."""
    return markdown.replace(PLACE, commands()) if PLACE in markdown else markdown


def commands() -> str:
    """Returns all commands as Markdown."""
    root: Any = typer.main.get_command(command_line(list(COMMANDS)))
    return "\n\n".join(
        text for name, command in root.commands.items() for text in shown(command, f"tumble {name}")
    )


def shown(command: Any, name: str) -> Iterator[str]:  # noqa: ANN401 - typer keeps its commands private
    """Returns a command and those below it: heading, help, table of what may be typed."""
    below = getattr(command, "commands", {})
    yield f"{'#' * (name.count(' ') + 1)} {name}\n\n{plain(command.help or '')}"
    rows = [row(parameter) for parameter in command.params if "--help" not in parameter.opts]
    if rows:
        yield "\n".join(["| typed | is |", "|---|---|", *rows])
    for word, subcommand in below.items():
        yield from shown(subcommand, f"{name} {word}")


def row(parameter: Any) -> str:  # noqa: ANN401 - as above
    """Returns a line of the table: an option with its value, or an argument."""
    if parameter.param_type_name == "argument":
        typed = parameter.metavar or parameter.name.upper()
    else:
        typed = ", ".join((*parameter.opts, *parameter.secondary_opts))
        words = "|".join(map(str, getattr(parameter.type, "choices", ())))
        if not parameter.is_flag:
            typed += f" {parameter.metavar or words or parameter.type.name.upper()}"
    help_text = " ".join(plain(parameter.help or "").split())
    return "| `{}` | {} |".format(*(cell.replace("|", "\\|") for cell in (typed, help_text)))


def plain(text: str) -> str:
    """Returns a help text without the marks that only a terminal needs, safe to be read as Markdown."""
    return re.sub(r"([*_<>\[\]])", r"\\\1", text.replace("\b", ""))
