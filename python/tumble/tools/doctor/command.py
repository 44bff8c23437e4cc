"""`tumble doctor`: what is installed, what of it works, and how to get the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.screen import print_document, result_console
from tumble.cli.shared_options import JsonOption

if TYPE_CHECKING:
    from tumble.tools.doctor.result import Diagnosed, Diagnosis

DIAGNOSIS: Final = "tumble-diagnosis/1"


def doctor_command(
    as_json: JsonOption = False,
) -> None:
    """Report what is installed, what of it works, and how to get the rest.

    Example: tumble doctor

    Looks at versions, the native module, needed and optional libraries, serial ports, sensors of Linux, the
    terminal and completion. The exit code is 3 if anything is broken that is always needed.
    """
    from tumble.tools.doctor.procedure import diagnose

    diagnosis = diagnose()
    if as_json:
        print_document(DIAGNOSIS, "works" if diagnosis.works else "does not work", diagnosis.content())
    else:
        _show(diagnosis)
    if not diagnosis.works:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _show(diagnosis: Diagnosis) -> None:
    from rich.text import Text

    console = result_console()
    for section in diagnosis.sections:
        console.print(Text(section.name, "bold"), soft_wrap=True)
        for finding in section.findings:
            console.print(Text(f"  {_line(finding)}", _style(finding)), soft_wrap=True)
    console.print()
    console.print("Tumble works." if diagnosis.works else "Tumble does not work: see what is broken above.")


def _line(finding: Diagnosed) -> str:
    remedy = f"; {finding.remedy}" if finding.remedy else ""
    return f"{finding.part}: {finding.state.value}: {finding.what}{remedy}"


def _style(finding: Diagnosed) -> str:
    return {"works": "green", "missing": "", "refused": "yellow", "broken": "red"}[finding.state.value]
