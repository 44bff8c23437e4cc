"""The commands of `tumble`: where each lives, and the command line that is made of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated, Any

import typer

from tumble.cli.abbreviations import AbbreviatingCommand
from tumble.cli.options import OptionsAround, expanded
from tumble.cli.standard_output import drawing
from tumble.foundation.errors import CommandError, PlaceError
from tumble.foundation.file_status import unusable
from tumble.foundation.procedures import PROCEDURES


@dataclass(frozen=True, slots=True)
class CommandEntry:
    """Where a command lives; its module is imported only when the command is asked for."""

    module: str
    attribute: str
    """A function to be made a command, or a `typer.Typer` with commands of its own."""
    summary: str
    """First line of its help, for the list of commands."""

    def load(self) -> Callable[..., Any] | typer.Typer:
        """Imports the command."""
        found: Callable[..., Any] | typer.Typer = getattr(import_module(self.module), self.attribute)
        return found


_PROCEDURES = {
    each.word: CommandEntry(f"{each.folder}.command", f"{each.word}_command", each.summary)
    for each in PROCEDURES
}
COMMANDS = {
    **_PROCEDURES,
    "apply": CommandEntry("tumble.tools.apply.command", "apply_command", "Correct a log with a calibration."),
    "compare": CommandEntry(
        "tumble.tools.compare.command",
        "compare_command",
        "Report whether calibrations are the same within their uncertainties.",
    ),
    "plateaus": CommandEntry(
        "tumble.tools.plateaus.command",
        "plateaus_command",
        "Make one calibration over temperature of several, each made at its own temperature.",
    ),
    "convert": CommandEntry(
        "tumble.tools.convert.command", "convert_command", "Write a log in another format, in SI units."
    ),
    "export": CommandEntry(
        "tumble.tools.exchange.command_export", "export_command", "Write a calibration for another program."
    ),
    "import": CommandEntry(
        "tumble.tools.exchange.command_import",
        "import_command",
        "Read a calibration that another program made.",
    ),
    "inspect": CommandEntry(
        "tumble.tools.inspect.command",
        "inspect_command",
        "Show what logs hold and which procedures they are fit for.",
    ),
    "view": CommandEntry(
        "tumble.bench.log.command",
        "view_command",
        "Show recordings as charts in the browser: zoom, rests and turns, spectra, calibrated beside raw.",
    ),
    "formats": CommandEntry(
        "tumble.tools.exchange.command_formats",
        "formats_command",
        "List every format that is read or written, with an example of each.",
    ),
    "record": CommandEntry(
        "tumble.tools.record.command", "record_command", "Record several live sources at once, on one clock."
    ),
    "table": CommandEntry(
        "tumble.tools.table.command", "table_app", "Try a rate table: list, position, goto, rate, stop."
    ),
    "simulate": CommandEntry(
        "tumble.tools.simulate.command", "simulate_app", "Make recordings whose truth is known."
    ),
    "demo": CommandEntry(
        "tumble.tools.demo.command",
        "demo_command",
        "Calibrate a simulated turntable session, one target of it faulty, and compare with the truth.",
    ),
    "bench": CommandEntry(
        "tumble.bench.command",
        "bench_command",
        "Calibrate in a browser: sources, guided runs, one big verdict, units and certificates.",
    ),
    "registry": CommandEntry(
        "tumble.laboratory.command",
        "registry_app",
        "Keep and ask a laboratory's record of calibrations: which unit, how well, good until when.",
    ),
    "certificate": CommandEntry(
        "tumble.laboratory.certificate.command",
        "certificate_app",
        "Issue certificates of results (tumble certificate RESULT...): PDF/A-3 with an XML inside.",
    ),
    "fleet": CommandEntry(
        "tumble.fleet.command",
        "fleet_app",
        "Run a procedure over any number of recordings, here or on a cluster, and sum up the units.",
    ),
    "doctor": CommandEntry(
        "tumble.tools.doctor.command",
        "doctor_command",
        "Report what is installed, what of it works, and how to get the rest.",
    ),
    "schema": CommandEntry(
        "tumble.cli.schema",
        "schema_command",
        "Print the JSON Schema of a document; without a name, list the documents.",
    ),
}


_WITHOUT_SETTINGS = ("doctor", "schema", "formats", "--version", "--install-completion")
_SETTINGS_OF_A_PROCEDURE = (
    *("operator", "station", "registry", "limits"),
    *("reference_certificate", "reference_signer", "reference_model", "decision"),
)
_SETTINGS_OF_THE_REGISTRY = ("operator", "laboratory", "registry", "limits")
_SUBCOMMANDS = (*("init", "list", "show", "history", "due", "equipment", "export", "verify", "backup"),)
"""Subcommands of `tumble registry`; `add` also takes facts about the units."""

_COMMANDS_OF_CERTIFICATES = (*("issue", "list", "show", "withdraw", "key", "sign", "verify", "template"),)
"""Commands of `tumble certificate`; each takes the settings that it has an option for."""

_UsageError: Any = typer.BadParameter.__mro__[1]
"""Error of typer for a wrong command line; its module changes with the version."""
_COMPLETION = "_TUMBLE_COMPLETE"
"""Variable by which a shell asks for completion."""


def run_command(words: Sequence[str]) -> int:
    """Run `tumble WORDS` and give its exit code.

    Raises `CommandError` where an argument or option is missing, unknown or of another kind.
    """
    return run_command_line(command_line_for(words), words)


def command_line_for(words: Sequence[str]) -> Any:  # noqa: ANN401 - typer keeps its type to itself
    """Builds the command line that `tumble WORDS` needs, and imports its command."""
    command = typer.main.get_command(command_line([*words, *words_to_complete()]))
    _let_help_be_drawn(command)
    return command


def run_command_line(command: Any, words: Sequence[str]) -> int:  # noqa: ANN401
    """Runs what `command_line_for` gave; the rest is as of `run_command`."""
    try:
        code: int | None = command(
            args=list(words), prog_name="tumble", standalone_mode=False, default_map=_defaults(words)
        )
    except _UsageError as error:
        if message := " ".join(error.format_message().split()).rstrip("."):
            command = error.ctx.command_path if error.ctx else "tumble"
            raise CommandError(f"{message[0].lower()}{message[1:]}; see {command} --help") from error
        code = error.exit_code  # of a command without arguments, whose help was shown
    except (KeyError, ValueError):
        if _COMPLETION not in os.environ:
            raise
        code = 0  # the shell did not state what to complete: there is nothing
    except OSError as error:
        if error.filename is None:
            raise
        # Whatever the system refuses at a path is no mistake of ours.
        raise PlaceError(unusable(error.filename, error)) from error
    return code or 0


def _defaults(words: Sequence[str]) -> dict[str, Any]:
    """Return values of options that are not typed: those of the project file, for every command alike.

    Raises `TumbleError` where that file is wrong; help and `doctor`, which shows it, need none.
    """
    if not words or words[0] in _WITHOUT_SETTINGS or {"--help", "-h"} & {*words}:
        return {}
    from tumble.foundation.project_file import project_settings

    values = {setting.name: setting.value for setting in project_settings().values()}

    def only(names: Sequence[str]) -> dict[str, Any]:
        return {name: value for name, value in values.items() if name in names}

    registry = dict.fromkeys(_SUBCOMMANDS, only(_SETTINGS_OF_THE_REGISTRY)) | {"add": values}
    others = dict.fromkeys(COMMANDS, only(("operator", "station")))
    certificate = dict.fromkeys(_COMMANDS_OF_CERTIFICATES, values)
    groups = {"registry": registry, "certificate": certificate}
    return others | dict.fromkeys(_PROCEDURES, only(_SETTINGS_OF_A_PROCEDURE)) | groups


def _let_help_be_drawn(command: Any) -> None:  # noqa: ANN401
    """Lets typer draw the help of a command and its subcommands: it holds no text from outside."""
    draw = command.format_help

    def format_help(*arguments: Any) -> None:  # noqa: ANN401
        with drawing():
            draw(*arguments)

    command.format_help = format_help
    for each in getattr(command, "commands", {}).values():
        _let_help_be_drawn(each)


def command_line(words: Sequence[str]) -> typer.Typer:
    """Builds the command line. Commands named in `words` are imported, the others only listed.

    Where the first word is a command, none but those named is needed.
    """
    app = typer.Typer(
        name="tumble",
        help="Calibrate inertial measurement units over their whole life.",
        epilog="Start with: tumble simulate turntable --help",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_root)
    is_chosen = bool(words) and words[0] in COMMANDS
    for name, entry in COMMANDS.items():
        if is_chosen and name not in words:
            continue
        found = entry.load() if name in words else _listed_only
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=name, help=entry.summary)
            continue
        is_listed = found is _listed_only
        command = found if is_listed else expanded(found, _options_around(name))
        help_text = entry.summary if is_listed else None
        app.command(name, cls=AbbreviatingCommand, help=help_text)(command)
    return app


def _options_around(name: str) -> type[OptionsAround] | None:
    """Returns the options of what is done around a command: results of procedures may enter a registry."""
    if name not in _PROCEDURES:
        return None
    from tumble.cli.registry_option import RegistryOptions

    return RegistryOptions


def _listed_only() -> None:
    raise AssertionError("a command that is called is named in the arguments, and so was imported")


def words_to_complete() -> list[str]:
    """Splits what stands on the line that a shell wants completed."""
    return f"{os.environ.get('COMP_WORDS', '')} {os.environ.get('_TYPER_COMPLETE_ARGS', '')}".split()


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"tumble {version('tumble-imu')}")
        raise typer.Exit


def _root(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
    ] = False,
    _debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            help="Tell what is done, and when; behind the command too, or TUMBLE_DEBUG=1.",
        ),
    ] = False,
) -> None:
    """Calibrate inertial measurement units over their whole life."""
