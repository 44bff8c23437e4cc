"""Options as people type them: cut short, and found in the help where they belong."""

from __future__ import annotations

import ast
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer

import tumble
from log_fixtures import made_up, write
from tumble.cli.commands import COMMANDS, command_line
from tumble.cli.options import Options, expanded
from tumble.foundation.procedures import PROCEDURES
from turntable_sessions import typed
from typed_commands import commands_below

READING = "Reading options"


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "log.csv", made_up(300))


@pytest.mark.parametrize("option", ["--gyroscope-u", "--gyroscope-uni", "--gyroscope-unit"])
@pytest.mark.parametrize("sign", [" ", "="])
def test_option_may_be_any_unambiguous_prefix(log, option, sign):
    words = f"{option}{sign}furlongs".split(" ")
    done = typed("inspect", log, *words)
    assert "--gyroscope-unit furlongs" in done.err


def test_ambiguous_option_prefix_is_refused_with_its_candidates(log):
    done = typed("inspect", log, "--gyroscope", "furlongs")
    assert done.code == 2
    assert "--gyroscope-unit" in done.err
    assert "--gyroscope-zero" in done.err


def test_an_option_is_not_completed_behind_two_dashes(log):
    done = typed("inspect", "--", log, "--gyroscope-u")
    assert "--gyroscope-u: no such file" in done.err


def test_commands_of_simulate_take_options_cut_short_too(tmp_path):
    done = typed("simulate", "spin", "--floor", "2", "--out", tmp_path, "--js")
    assert done.code == 0, done.err
    assert done.out.startswith("{")


@pytest.mark.parametrize("command", ["turntable", "spin", "redundancy", "align", "apply", "inspect"])
def test_reading_options_stand_together_at_the_end_of_the_help(command):
    shown = typed(command, "--help").out
    own, _, reading = shown.partition(READING)
    assert "--output" in own or command == "inspect"
    for option in ("--columns", "--gyroscope-unit", "--serial"):
        assert option in reading
        assert option not in own
    assert "--help" not in reading
    assert ("--for" in reading) == (command in ("turntable", "redundancy", "align"))


@pytest.fixture(scope="module")
def parameters():
    """Parameters by option and command."""
    found = defaultdict(dict)
    root = typer.main.get_command(command_line(list(COMMANDS)))
    for name, command in commands_below(root):
        for parameter in command.params:
            for option in parameter.opts:
                found[option][name] = parameter
    return found


ONE_MEANING = {
    **dict.fromkeys(("--json", "--quiet", "--verbose", "--jobs", "--operator", "--station"), 1),
    **dict.fromkeys(("--from", "--to"), 1),
    # Folders and files; Hz of a log, or of what is simulated.
    **dict.fromkeys(("--output", "--rate"), 2),
    # A calibration to build on, one of a primary, or those of the units of a chart.
    "--calibration": 3,
}
"""Options that several commands share, and with how many texts."""


@pytest.mark.parametrize("option", ONE_MEANING)
def test_a_shared_option_has_one_text_in_all_commands(parameters, option):
    commands = parameters[option]
    texts = {parameter.help for parameter in commands.values()}
    assert commands
    assert len(texts) == ONE_MEANING[option], texts


def test_a_format_is_that_of_a_file_everywhere(parameters):
    assert set(parameters["--format"]) >= {"apply", "convert", "export", "import", "simulate spin"}
    for name, parameter in parameters["--format"].items():
        assert parameter.help.startswith("Format of the file; "), name
    for word in ("--to", "--from"):
        assert {"convert", "export", "import"}.isdisjoint(parameters[word])


@pytest.mark.parametrize("word", [row.word for row in PROCEDURES])
def test_every_procedure_takes_the_options_that_procedures_share(parameters, word):
    for option in (
        "--json",
        "--quiet",
        "-q",
        "--operator",
        "--station",
        "--output",
        "-o",
        "--gyroscope-unit",
    ):
        assert word in parameters[option], option
    for short, long in (("-q", "--quiet"), ("-v", "--verbose"), ("-o", "--output")):
        assert parameters[short].get(word) is parameters[long].get(word)


def test_no_function_of_a_command_is_over_100_lines():
    package = Path(tumble.__file__).parent
    lengths = {
        f"{path.relative_to(package)}:{node.name}": node.end_lineno - node.lineno + 1
        for path in [
            *package.glob("cli/*.py"),
            *package.glob("*/*/command*.py"),
            *package.glob("*/*/*/command.py"),
        ]
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef)
    }
    assert len(lengths) > 200
    assert {name: lines for name, lines in lengths.items() if lines > 100} == {}


@dataclass(frozen=True, slots=True, kw_only=True)
class RestOptions(Options):
    """Options of a command that is made up."""

    still: Annotated[float, typer.Option(help="Least rest, s.")] = 2.0
    at: Annotated[list[str] | None, typer.Option(help="Where; repeatable.")] = None


def test_options_of_a_class_are_options_of_the_command():
    given = []

    def command(log: str, rest: RestOptions, loud: bool = False) -> None:
        """Do something."""
        given.append((log, rest, loud))

    app = typer.Typer()
    app.command()(expanded(command))
    found = typer.main.get_command(app)
    assert [each.name for each in found.params][:4] == ["log", "still", "at", "loud"]
    assert {each.name: each.help for each in found.params}["still"] == "Least rest, s."
    found(["a.csv", "--at", "1", "--at", "2"], standalone_mode=False)
    assert given == [("a.csv", RestOptions(still=2.0, at=["1", "2"]), False)]


def test_quiet_says_only_that_not_all_is_well(tmp_path):
    assert typed("simulate", "static", "--duration", "1min", "--rate", "20", "-o", tmp_path).code == 0
    done = typed("noise", tmp_path / "static.csv", "-q", "-o", tmp_path / "out")
    assert (done.code, done.out) == (3, "")
    assert done.err == f"tumble: partly measured; see {tmp_path / 'out' / 'static.noise.html'}\n"


def test_verbose_shows_every_spin(tmp_path):
    plan = ", ".join(["rest 6, 2 turns, -2 turns, rest 3, drive 6"] * 5 + ["rest 3"])
    assert typed("simulate", "spin", "--plan", plan, "-o", tmp_path).code == 0
    shown = {
        words: typed("spin", tmp_path / "spin.csv", *words, "-o", tmp_path / "out").out
        for words in ((), ("-v",))
    }
    spins = [line for line in shown[()].splitlines() if line.startswith("Spin ")]
    assert len(spins) > 4
    assert "spin 5" not in shown[()].split("all spins")[1].splitlines()[0]
    assert "spin 5" in shown[("-v",)].split("all spins")[1].splitlines()[0]
