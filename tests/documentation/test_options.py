"""Options that how-tos name exist, and each option of a procedure is explained."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
import typer

from pages import without_commands
from tumble.cli.commands import COMMANDS, command_line
from tumble.foundation.procedures import PROCEDURES

HOW_TOS = {path.stem: path for path in sorted((Path(__file__).parents[2] / "docs" / "how-to").glob("*.md"))}
EVERYWHERE = {"--help", "--debug"}
OF_OTHERS = {
    "c": {"--gc-sections", "--target"},
    "embed": {
        "--build",
        "--cflags",
        "--features",
        "--gc-sections",
        "--install",
        "--libs",
        "--no-default-features",
    }
    | {"--prefix"},
    "export": {"--imu-models"},
    "firmware": {"--no-save"},
    "fleet": {"--address"},
    "install": {"--owner", "--rm", "--tag", "--user", "--volume"},
    "noise": {"--imu"},
}
"""Options of programs of others that a page names."""
WORDS = sorted({each.word for each in PROCEDURES} & COMMANDS.keys() & HOW_TOS.keys())


@cache
def commands():
    return typer.main.get_command(command_line(list(COMMANDS))).commands


def options(command):
    """Options of a command and of those below it."""
    own = {option for each in command.params for option in (*each.opts, *each.secondary_opts)}
    return own.union(*map(options, getattr(command, "commands", {}).values()))


@cache
def told(page):
    """Options that a page names, outside of the commands that it shows."""
    text = without_commands(HOW_TOS[page].read_text(encoding="utf-8"))
    return frozenset(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))


@pytest.mark.parametrize("page", HOW_TOS)
def test_every_option_that_a_how_to_names_exists(page):
    text = HOW_TOS[page].read_text(encoding="utf-8")
    named = [word for word in COMMANDS if re.search(rf"tumble {word}\b|`{word}[ `]", text)]
    known = EVERYWHERE.union(*(options(commands()[word]) for word in named))
    unknown = told(page) - OF_OTHERS.get(page, set()) - known
    # Options may be cut short.
    assert {each for each in unknown if not any(option.startswith(each) for option in known)} == set()
    assert OF_OTHERS.get(page, set()) <= told(page) - known


@pytest.mark.parametrize("word", WORDS)
def test_every_option_of_a_procedure_is_explained(word):
    of_each = {each: options(command) for each, command in commands().items()}
    own = {option for option in of_each.pop(word) if option.startswith("--")} - EVERYWHERE
    # One page explains what several commands share.
    shared = own & set().union(*of_each.values())
    assert own - shared <= told(word) | told("live")
    assert shared <= frozenset().union(*map(told, HOW_TOS))
    assert own
