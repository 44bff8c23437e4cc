"""`tumble certificate`: calibration certificates, as PDF/A-3 and as Digital Calibration Certificate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer.core import TyperGroup

from tumble.cli.abbreviations import AbbreviatingCommand
from tumble.cli.exit_code import ExitCode
from tumble.cli.options import expanded
from tumble.cli.output import OutputFolder
from tumble.cli.registry_option import RegistryOption
from tumble.cli.registry_option import laboratory as laboratory_room
from tumble.cli.screen import LISTED, print_document, print_line, print_summary
from tumble.cli.shared_options import JsonOption, OperatorOption
from tumble.foundation.errors import CommandError
from tumble.foundation.file_reading import own_text
from tumble.laboratory.certificate.options import (
    AppearanceOptions,
    AsFoundOption,
    KeyOption,
    NumberArgument,
    NumberOptions,
    StatementOptions,
    WhyOption,
    key_of,
    text_option,
)

if TYPE_CHECKING:
    from tumble.laboratory.certificate.issue import Layout
    from tumble.laboratory.certificate.model import Certificate, Condition
    from tumble.laboratory.certificate.record import Rendered
    from tumble.laboratory.registry import Registry

SCHEMA: Final = "tumble-certificates/1"
_ISSUE: Final = "issue"
FOLDER: Final = "certificates"
"""Folder of certificates, where none is given."""


class _IssuingGroup(TyperGroup):
    """Commands of `tumble certificate`; without the name of one, results are meant, and `issue`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer keeps its type to itself
        """Puts `issue` before arguments that begin with no command."""
        names = {*self.commands, "--help", "-h"}
        return super().parse_args(ctx, args if not args or args[0] in names else [_ISSUE, *args])


certificate_app = typer.Typer(
    cls=_IssuingGroup,
    no_args_is_help=True,
    help="Issue certificates of results (tumble certificate RESULT...): PDF/A-3 with an XML inside.",
    epilog="Example: tumble certificate results -o certificates",
)


@certificate_app.callback()
def _certificate() -> None:
    """Issue calibration certificates: PDF/A-3 with a Digital Calibration Certificate (XML) inside.

    Example: tumble certificate results -o certificates

    Results need no command before them: tumble certificate RESULT... is tumble certificate issue RESULT...
    """


@certificate_app.command(_ISSUE, cls=AbbreviatingCommand)
@expanded
def issue_command(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="RESULT...",
            help="Folders of results, calibration files, or identities of results in the registry.",
        ),
    ],
    numbers: NumberOptions,
    statement: StatementOptions,
    appearance: AppearanceOptions,
    output: OutputFolder = None,
    as_found: AsFoundOption = None,
    manufacturer: Annotated[str, text_option("--manufacturer", "Maker of the units.")] = "",
    model: Annotated[str, text_option("--model", "Model of the units.")] = "",
    operator: OperatorOption = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Issue a certificate for each unit: a PDF with an XML inside, and the XML beside it.

    Example: tumble certificate results --customer Acme --customer-address "1 High Street, Town"

    Settings of all certificates, such as the laboratory, belong into tumble.toml. The registry gives the
    numbers, and keeps both files. The operator of a certificate is that of the result.
    """
    laboratory_room("certificate.issue")
    from tumble.foundation.files import prepare_folder
    from tumble.foundation.provenance import date_now
    from tumble.foundation.words import count_of
    from tumble.laboratory.certificate.collect import (
        certificates_of,
        results_in_files,
        results_in_registry,
    )
    from tumble.laboratory.certificate.issue import issue_all, numbered, rendered, without_certificate
    from tumble.laboratory.registry import Registry, UnitFacts

    opened = Registry(registry) if registry else None
    numbers.check(has_registry=opened is not None)
    stated = statement.stated(opened.laboratory if opened is not None else "")
    layout, pattern = appearance.layout(), numbers.pattern()
    facts = UnitFacts(manufacturer=manufacturer, model=model)
    groups: tuple[tuple[Condition, list[str]], ...] = (("as found", as_found or []), ("", results))
    found = [
        each
        for condition, places in groups
        for each in (
            results_in_files(places, condition, facts)
            if opened is None
            else results_in_registry(opened, places, condition, facts, operator)
        )
    ]
    drafts = certificates_of(found, stated, date_now()[:10], numbers.supersedes)
    numbers.check_units(len(drafts))
    folder = prepare_folder(output or Path(FOLDER))
    if opened is None:
        issued = [rendered(numbered(drafts[0], numbers.number), layout)]
    else:
        given = len(drafts)
        drafts = drafts if numbers.supersedes else without_certificate(opened, drafts)
        issued = issue_all(opened, drafts, pattern, layout, operator or statement.authorised_by)
        if len(drafts) < given:
            held = count_of("unit", given - len(drafts))
            print_line(f"tumble: {held} with a certificate that holds: left out", is_message=True)
    _print_issued(issued, drafts, folder, layout, as_json)


def _print_issued(
    issued: list[Rendered], drafts: list[Certificate], folder: Path, layout: Layout, as_json: bool
) -> None:
    from tumble.laboratory.certificate.issue import write

    rows = []
    for found, draft in zip(issued, drafts, strict=True):
        pdf, xml = write(found, folder)
        rows.append(
            {
                "number": found.number,
                "serial": draft.item.serial,
                "pdf": str(pdf),
                "xml": str(xml),
                "signed": layout.key is not None,
            }
        )
    if as_json:
        _print("issued", {"certificates": rows})
        return
    for row in rows:
        print_line(f"{row['number']}: serial {row['serial']}, {row['pdf']}, {row['xml']}")


@certificate_app.command("list", cls=AbbreviatingCommand)
def list_command(registry: RegistryOption = "", as_json: JsonOption = False) -> None:
    """List the certificates of the registry, with those that were withdrawn or superseded.

    Example: tumble certificate list
    """
    opened = _open(registry)
    from tumble.laboratory.certificate.record import listed

    found = [{**row} for row in listed(opened)]
    if as_json:
        _print(LISTED, {"certificates": found})
        return
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    columns = ("number", "issued", "name", "serial", "state")
    for column in columns:
        table.add_column(column, no_wrap=True)
    for row in found:
        table.add_row(*(str(row[column]) for column in columns))
    print_summary(table)


@certificate_app.command("show", cls=AbbreviatingCommand)
def show_command(
    number: NumberArgument,
    output: OutputFolder = None,
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Show the record of a certificate; -o writes its files.

    Example: tumble certificate show IMU-2026-0001 -o certificates
    """
    opened = _open(registry)
    from tumble.laboratory.certificate.record import certificate_row, documents_of

    row = certificate_row(opened, number)
    if as_json:
        _print(LISTED, {"certificates": [row]})
    else:
        print_line(f"Certificate {row['number']}")
        for name in ("state", "issued", "withdrawn", "reason", "results", "pdf", "xml", "entry"):
            if row[name]:
                print_line(f"  {name}: {', '.join(row[name]) if name == 'results' else row[name]}")
    if output is not None:
        from tumble.foundation.files import prepare_folder
        from tumble.laboratory.certificate.issue import write

        for path in write(documents_of(opened, number), prepare_folder(output)):
            print_line(f"Written: {path}", is_message=True)


@certificate_app.command("withdraw", cls=AbbreviatingCommand)
def withdraw_command(
    number: NumberArgument,
    why: WhyOption = "",
    operator: OperatorOption = "",
    registry: RegistryOption = "",
) -> None:
    """Withdraw a certificate, with the reason; it stays on record.

    Example: tumble certificate withdraw IMU-2026-0001 --why "reference was out of date"
    """
    if not why.strip():
        raise CommandError('--why is missing; state the reason, such as --why "wrong customer"')
    opened = _open(registry)
    from tumble.laboratory.certificate.record import withdraw

    withdraw(opened, number, why, operator)
    print_line(f"{number}: withdrawn")


@certificate_app.command("key", cls=AbbreviatingCommand)
def key_command(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="File of the key, such as laboratory.pem.")],
    laboratory: Annotated[str, text_option("--laboratory", "Name of the laboratory.")] = "",
) -> None:
    """Make the laboratory's key: a private file, and a public one (.crt) for whoever verifies.

    Example: tumble certificate key laboratory.pem --laboratory "Inertial laboratory"

    Keep the private file to yourself, and write signing_key = "laboratory.pem" into tumble.toml.
    """
    if not laboratory:
        raise CommandError("no certificate of a key without a name; give --laboratory NAME")
    public = laboratory_room("certificate.signing_key").make_key(path, laboratory)
    print_line(f"{path}: private key, keep it to yourself")
    print_line(f"{public}: give it to customers, who verify with --signer {public.name}")


@certificate_app.command("sign", cls=AbbreviatingCommand)
def sign_command(
    number: NumberArgument,
    output: OutputFolder = None,
    signing_key: KeyOption = "",
    operator: OperatorOption = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Sign a certificate that was issued without a key; the files of before stay on record.

    Example: tumble certificate sign IMU-2026-0001 --signing-key laboratory.pem -o certificates
    """
    key = key_of(signing_key)
    if key is None:
        raise CommandError(
            "no key is set; give --signing-key FILE, or make one with tumble certificate key FILE"
        )
    opened = _open(registry)
    from tumble.foundation.files import prepare_folder
    from tumble.laboratory.certificate.issue import signed, write
    from tumble.laboratory.certificate.record import (
        Rendered,
        certificate_row,
        documents_of,
        replace_documents,
    )

    row = certificate_row(opened, number)
    if row["state"] != "issued":
        raise CommandError(f"certificate {number}: is {row['state']}; sign the one that holds")
    found = documents_of(opened, number)
    made = Rendered(found.number, signed(found.pdf, key), signed(found.xml, key))
    if made != found:
        replace_documents(opened, made, "certificate signed", operator)
    pdf, xml = write(made, prepare_folder(output or Path(FOLDER)))
    if as_json:
        rows = [{"number": made.number, "pdf": str(pdf), "xml": str(xml), "signed": True}]
        _print("signed", {"certificates": rows})
    else:
        print_line(f"{made.number}: {'signed' if made != found else 'was signed before'}, {pdf}, {xml}")


@certificate_app.command("verify", cls=AbbreviatingCommand)
def verify_command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Certificates, PDF or XML.")],
    signer: Annotated[
        list[Path] | None,
        text_option(
            "--signer", "Public file (.crt) of a laboratory whose signature counts; repeatable.", "FILE"
        ),
    ] = None,
    signing_key: KeyOption = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Verify who signed certificates, that nothing was changed since, and that they still hold.

    Example: tumble certificate verify certificates/IMU-2026-0001.pdf --signer laboratory.crt

    Where the registry is set, a certificate that was withdrawn does not hold. The exit code is 3 if one
    is not as it was signed, or does not hold.
    """
    verification = laboratory_room("certificate.verification")
    from tumble.laboratory.certificate.signing_key import load_signer

    known = [load_signer(path) for path in (*(signer or ()), *([Path(signing_key)] if signing_key else ()))]
    if not known:
        raise CommandError(
            "no signer is known; give --signer FILE.crt, the public file of the laboratory's key"
        )
    opened = _open(registry) if registry else None
    checks = [verification.check(path, known, opened) for path in files]
    if as_json:
        verdict = "intact" if all(each.holds for each in checks) else "damaged"
        _print(verdict, {"checks": [each.content() for each in checks]})
    else:
        for each in checks:
            print_line(each.sentence)
    if not all(each.holds for each in checks):
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


@certificate_app.command("template", cls=AbbreviatingCommand)
def template_command() -> None:
    """Print the usual layout, to be changed and given back by --template.

    Example: tumble certificate template > ours.typ
    """
    print(own_text(laboratory_room("certificate.pdf").TEMPLATE), end="")


def _open(address: str) -> Registry:
    if not address:
        raise CommandError(
            'no registry is set; give --registry FILE, set TUMBLE_REGISTRY, or write registry = "lab.db" '
            "into tumble.toml"
        )
    opened: Registry = laboratory_room("registry").Registry(address)
    return opened


def _print(verdict: str, content: Mapping[str, Any]) -> None:
    print_document(SCHEMA, verdict, content)
