"""The option `--registry`: results that a procedure has written are handed over to a laboratory's record."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from contextvars import ContextVar
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated, Any, TypeAlias

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.options import OptionsAround
from tumble.cli.screen import print_line
from tumble.foundation.errors import CommandError, TumbleError
from tumble.foundation.file_status import is_file
from tumble.foundation.files import files_written
from tumble.foundation.words import count_of
from tumble.logs.optional import install_command

RegistryOption: TypeAlias = Annotated[
    str,
    typer.Option(
        "--registry",
        envvar="TUMBLE_REGISTRY",
        metavar="FILE|URL",
        help="Registry of the laboratory: a file, or postgresql://USER@HOST/DATABASE.",
        show_default=False,
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistryOptions(OptionsAround):
    """Registry that gets what the command of a procedure has written."""

    registry: RegistryOption = ""

    def run(self, command: Callable[[], None]) -> None:
        """Run the command and enter its results; the exit code is 3 where they could not be entered."""
        end: typer.Exit | None = None
        in_use = _address.set(self.registry)
        try:
            command()
        except typer.Exit as error:
            end = error
        finally:
            _address.reset(in_use)
        if self.registry and not _entered(self.registry):
            raise typer.Exit(ExitCode.NOT_ALL_WELL)
        if end is not None:
            raise end


_address: ContextVar[str] = ContextVar("address", default="")
"""Registry of the command that runs; empty for none."""


def registry_in_use() -> str:
    """Return the address of the registry of the command that runs; empty for none."""
    return _address.get()


def laboratory(module: str) -> Any:  # noqa: ANN401 - a module has no type of its own
    """Import a module of the laboratory, a room above this one, as all commands are.

    Raises `CommandError`, with how to get it, where a library that it needs is not installed.
    """
    try:
        return import_module(f"tumble.laboratory.{module}")
    except ModuleNotFoundError as error:
        needing = "a certificate" if module.startswith("certificate") else "the registry"
        raise CommandError(
            f"{needing} needs the Python package {error.name}, which is not installed; type: "
            f"{install_command('laboratory')}"
        ) from error


def warn_of_names(added: Iterable[Any]) -> None:
    """Warn of new results whose units state no serial: units of one name would be taken for one."""
    names = dict.fromkeys(each.name for each in added if each.is_new and not each.serial)
    if names:
        print_line(
            f"tumble: warning: {', '.join(names)}: no serial is stated, so that all units of this name "
            "are one; give --serial",
            is_message=True,
        )


def _entered(address: str) -> bool:
    """Enter what was written; where that cannot be done, print how to do it later and return False."""
    from tumble.foundation.project_file import project_settings

    written = [path for path in files_written() if is_file(path)]
    stated = {setting.name: setting.value for setting in project_settings().values()}
    try:
        added = laboratory("entering").enter_written(address, written, stated)
    except TumbleError as error:
        folders = dict.fromkeys(shlex.quote(str(path.parent)) for path in written if path.suffix == ".yaml")
        print_line(
            f"tumble: not in the registry: {error}; the results are written: type tumble registry add "
            f"{' '.join(folders)}",
            is_message=True,
        )
        return False
    warn_of_names(added)
    new = sum(each.is_new for each in added)
    known = f", {len(added) - new} there already" if new < len(added) else ""
    if added:
        print_line(f"tumble: {count_of('result', new)} added to the registry{known}", is_message=True)
    return True
