"""Statements of docs/how-to/align.md hold: options, messages, settings and the example."""

from __future__ import annotations

import re
from pathlib import Path

import typer
import yaml

import tumble
from pages import without_commands
from tumble.cli.commands import command_line
from tumble.procedures.redundancy.settings import RedundancySettings

HOW_TO = (Path(__file__).parents[2] / "docs" / "how-to" / "align.md").read_text(encoding="utf-8")
PACKAGE = Path(tumble.__file__).parent


def options_of(*words):
    commands = typer.main.get_command(command_line(words)).commands
    return {
        word: {option for parameter in commands[word].params for option in parameter.opts} for word in words
    }


def test_how_to_lists_existing_options_and_explains_each_own_one():
    options = options_of("align", "redundancy", "apply")
    told = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", without_commands(HOW_TO)))
    assert told <= options["align"] | options["redundancy"]
    own = {option for option in options["align"] - options["apply"] if option.startswith("--")}
    assert {"--primary", "--secondary", "--search", "--for"} <= own <= told
    assert "--json" in told


def test_the_settings_shown_are_settings_of_redundancy():
    (shown,) = re.findall(r"```yaml\n(.*?)```", HOW_TO, re.DOTALL)
    settings = RedundancySettings.model_validate(yaml.safe_load(shown))
    assert settings.units["imu2"].lever_arm[2] == -0.002
