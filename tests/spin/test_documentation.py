"""Statements of docs/how-to/spin.md hold: options and messages."""

from __future__ import annotations

import re
from pathlib import Path

import typer

import tumble
from pages import without_commands
from tumble.cli.commands import command_line

HOW_TOS = Path(__file__).parents[2] / "docs" / "how-to"
HOW_TO = (HOW_TOS / "spin.md").read_text(encoding="utf-8")
PACKAGE = Path(tumble.__file__).parent


def test_every_option_of_the_how_to_exists():
    words = ["spin", "apply"]
    commands = typer.main.get_command(command_line(words)).commands
    known = {option for word in words for parameter in commands[word].params for option in parameter.opts}
    told = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", without_commands(HOW_TO)))
    assert told <= known
    own = {option for parameter in commands["spin"].params for option in parameter.opts if len(option) > 2}
    of_logs = {option for parameter in commands["apply"].params for option in parameter.opts}
    live = (HOW_TOS / "live.md").read_text(encoding="utf-8")
    assert {option for option in own - of_logs - told if option not in live} == set(), "not explained"
