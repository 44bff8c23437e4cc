"""`tumble registry`: a laboratory's record of calibrations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from tumble.cli.abbreviations import AbbreviatingCommand
from tumble.cli.exit_code import ExitCode
from tumble.cli.output import OutputFolder
from tumble.cli.registry_option import RegistryOption, warn_of_names
from tumble.cli.registry_option import laboratory as laboratory_room
from tumble.cli.screen import LISTED, print_document, print_line, print_summary
from tumble.cli.shared_options import JsonOption, LanguageOption, OperatorOption
from tumble.foundation.errors import CommandError
from tumble.foundation.translation import translated

if TYPE_CHECKING:
    from tumble.calibration.limits import Limits
    from tumble.laboratory.parameter_history import Fleet
    from tumble.laboratory.registry import Registry

registry_app = typer.Typer(
    no_args_is_help=True,
    help="Keep and ask a laboratory's record of calibrations: which unit, how well, good until when.",
)

SerialOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--serial", metavar="TEXT", help="Only of this unit, by serial or name.", show_default=False
    ),
]
ModelOption: TypeAlias = Annotated[
    str, typer.Option("--model", metavar="TEXT", help="Model of the units.", show_default=False)
]
LotOption: TypeAlias = Annotated[
    str, typer.Option("--lot", metavar="TEXT", help="Lot of the units.", show_default=False)
]
ManufacturerOption: TypeAlias = Annotated[
    str, typer.Option("--manufacturer", metavar="TEXT", help="Maker of the units.", show_default=False)
]
LimitsOption: TypeAlias = Annotated[
    str | None, typer.Option("--limits", metavar="FILE", help="Limits file.", show_default=False)
]


@registry_app.callback()
def _registry() -> None:
    """Keep and ask a laboratory's record of calibrations: which unit, how well, good until when."""


@registry_app.command("init", cls=AbbreviatingCommand)
def init_command(
    address: Annotated[
        str,
        typer.Argument(
            metavar="[FILE|URL]",
            help="A file, or postgresql://USER@HOST/DATABASE; the registry that is set if not given.",
        ),
    ] = "",
    laboratory: Annotated[
        str, typer.Option(metavar="NAME", help="Name of the laboratory.", show_default=False)
    ] = "",
    documents: Annotated[
        str,
        typer.Option(
            metavar="FOLDER|URL",
            help="Place of calibration files and pages; a folder beside the file if not given.",
            show_default=False,
        ),
    ] = "",
    registry: RegistryOption = "",
) -> None:
    """Make a registry, or bring an older one to this version of Tumble.

    Example: tumble registry init lab.db --laboratory "Inertial laboratory"
    """
    made = laboratory_room("registry").Registry.create(
        address or _stated(registry), laboratory=laboratory, documents=documents
    )
    print_line(f"Registry {made.address} is ready; its documents are in {made.documents.place}")


@registry_app.command("add", cls=AbbreviatingCommand)
def add_command(
    places: Annotated[
        list[str], typer.Argument(metavar="FOLDER|FILE...", help="Results: folders, or calibration files.")
    ],
    manufacturer: ManufacturerOption = "",
    model: ModelOption = "",
    lot: LotOption = "",
    owner: Annotated[str, typer.Option(metavar="TEXT", help="Owner of the units.", show_default=False)] = "",
    identity: Annotated[
        list[str] | None,
        typer.Option(
            "--identity", metavar="TEXT", help="Device id of the unit; repeatable.", show_default=False
        ),
    ] = None,
    as_found: Annotated[bool, typer.Option("--as-found", help="The unit was calibrated as found.")] = False,
    as_left: Annotated[bool, typer.Option("--as-left", help="The unit was calibrated as left.")] = False,
    supersedes: Annotated[
        str,
        typer.Option(metavar="RESULT", help="Result that the one given replaces.", show_default=False),
    ] = "",
    operator: OperatorOption = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Add results of procedures; what is there already stays as it is.

    Example: tumble registry add results --model ADIS16470
    """
    if as_found and as_left:
        raise CommandError("--as-found and --as-left exclude each other; give one")
    condition = "as found" if as_found else "as left" if as_left else ""
    opened = _open(registry)
    from tumble.laboratory.registry import UnitFacts

    facts = UnitFacts(manufacturer, model, lot, owner, tuple(identity or ()))
    added = opened.add(*places, facts=facts, condition=condition, supersedes=supersedes, who=operator)
    warn_of_names(added)
    if as_json:
        rows = [
            {"result": each.identity, "name": each.name, "serial": each.serial, "new": each.is_new}
            for each in added
        ]
        _print("add", "added", {"added": rows})
        return
    for each in added:
        state = "added" if each.is_new else "there already"
        print_line(
            f"{_short(each.identity)}  {each.name}{f', serial {each.serial}' if each.serial else ''}: {state}"
        )
    if not added:
        print_line("no results of procedures there", is_message=True)


@registry_app.command("list", cls=AbbreviatingCommand)
def list_command(
    serial: SerialOption = None,
    model: ModelOption = "",
    lot: LotOption = "",
    procedure: Annotated[
        str, typer.Option(metavar="WORD", help="Only of this procedure.", show_default=False)
    ] = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """List results, the latest first.

    Example: tumble registry list --model ADIS16470
    """
    found = _open(registry).list(
        serial=serial, model=model or None, lot=lot or None, procedure=procedure or None
    )
    if as_json:
        _print("list", LISTED, {"results": list(found)})
        return
    columns = ("date", "name", "serial", "model", "procedure", "verdict", "condition")
    rows = [(_short(row["calibration"]), *(str(row[name]) for name in columns)) for row in found]
    print_summary(_table(("result", *columns), rows))


@registry_app.command("show", cls=AbbreviatingCommand)
def show_command(
    result: Annotated[
        str,
        typer.Argument(
            metavar="RESULT", help="The beginning of a result's identity, or a serial or name: its latest."
        ),
    ],
    output: OutputFolder = None,
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Show a result: unit, run, parameters with uncertainty, decision; -o writes its documents.

    Example: tumble registry show 0042
    """
    opened = _open(registry)
    from tumble.laboratory.text import shown_content, shown_lines, shown_rows

    found = opened.show(result)
    if as_json:
        _print("show", LISTED, shown_content(found))
    else:
        for line in shown_lines(found):
            print_line(line)
        print_summary(_table(("parameter", "value", "U (k = 2)", "of the reference"), shown_rows(found)))
    if output is not None:
        from tumble.laboratory.export import write_documents

        for path in write_documents(opened, found, output):
            print_line(f"Written: {path}", is_message=True)


@registry_app.command("history", cls=AbbreviatingCommand)
def history_command(
    unit: Annotated[
        str, typer.Argument(metavar="[UNIT]", help="Serial or name of a unit; or give --lot or --model.")
    ] = "",
    output: OutputFolder = None,
    lot: LotOption = "",
    model: ModelOption = "",
    limits: LimitsOption = None,
    registry: RegistryOption = "",
    as_json: JsonOption = False,
    language: LanguageOption = "",
) -> None:
    """Show a unit over time, with its drift; of a lot or model how capable and repeatable it is.

    Example: tumble registry history 0042 -o history

    With -o a page is written. Drift is pooled over the units of the model.
    """
    if bool(unit) == bool(lot or model):
        raise CommandError("give a unit, or --lot or --model")
    opened = _open(registry)
    from tumble.laboratory.text import DRIFT_COLUMNS, LOT_COLUMNS, drift_rows, lot_rows, signal_sentences

    held = _limits(limits)
    if not unit:
        found = opened.lot(lot=lot, model=model, limits=held)
        if as_json:
            _print("lot", LISTED, {"units": found.units, "parameters": list(found.rows())})
        else:
            print_summary(_table(LOT_COLUMNS, lot_rows(found)))
        return
    history = opened.history(unit, held)
    if as_json:
        content = {"unit": history.unit, "values": list(history.rows()), "due": list(history.due_rows())}
        _print("history", LISTED, content)
    else:
        print_summary(_table(DRIFT_COLUMNS, drift_rows(history)))
        for sentence in signal_sentences(history):
            print_line(translated(f"control chart: {sentence}"))
    if output is not None:
        from tumble.foundation.file_names import file_stem
        from tumble.foundation.files import prepare_folder
        from tumble.laboratory.report.page import HISTORY_REPORT

        path = prepare_folder(output) / f"{file_stem(str(history.unit['name']))}.history.html"
        HISTORY_REPORT.write(history, path)
        print_line(translated(f"Report: {path}"), is_message=True)


@registry_app.command("due", cls=AbbreviatingCommand)
def due_command(
    units: Annotated[
        list[str] | None,
        typer.Argument(metavar="[UNIT...]", help="Serials or names; all units of a lot or model without."),
    ] = None,
    lot: LotOption = "",
    model: ModelOption = "",
    limits: LimitsOption = None,
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Show when units are due: when they may leave their limits with more than 5 %.

    Example: tumble registry due 0042 --limits limits.yaml

    Without --limits those hold that a unit was last checked against. The exit code is 3 if a unit is due.
    """
    opened = _open(registry)
    from tumble.foundation.provenance import date_now
    from tumble.laboratory.history import history_of
    from tumble.laboratory.text import due_sentence

    held = _limits(limits)
    if not units and not (lot or model):
        raise CommandError("give units, or --lot or --model")
    wanted = units or opened.units(lot=lot or None, model=model or None)
    names = [each if isinstance(each, str) else str(each["unit"]) for each in wanted]
    fleets: dict[str, Fleet] = {}
    found = [history_of(opened, name, held, fleets) for name in names]
    is_due = any(each.due and each.due <= date_now()[:10] for each in found)
    if as_json:
        rows = [{"unit": each.unit, "due": each.due, "parameters": list(each.due_rows())} for each in found]
        _print("due", "due" if is_due else "not due", {"units": rows})
    else:
        for each in found:
            print_line(f"{each.unit['serial'] or each.unit['name']}: {due_sentence(each)}")
    if is_due:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


@registry_app.command("verify", cls=AbbreviatingCommand)
def verify_command(
    head: Annotated[
        str,
        typer.Option(
            metavar="HASH",
            help="Hash of the last entry as an earlier run printed it: shows whether entries were cut off.",
            show_default=False,
        ),
    ] = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """Recompute all hashes: of rows, of the chain, of documents. The exit code is 3 if one is wrong.

    Example: tumble registry verify
    """
    from tumble.foundation.words import count_of

    found = _open(registry).verify(head=head)
    if as_json:
        _print("verify", "intact" if found.intact else "damaged", {"verification": found.content()})
    else:
        for fault in found.faults:
            print_line(f"fault: {fault}")
        state = "intact" if found.intact else count_of("fault", len(found.faults))
        entries = f"{found.entries} {'entry' if found.entries == 1 else 'entries'}"
        print_line(f"{entries}, {count_of('document', found.documents)}: {state}")
        print_line(f"Last entry: {found.head}")
    if not found.intact:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


@registry_app.command("export", cls=AbbreviatingCommand)
def export_command(
    path: Annotated[str, typer.Argument(metavar="FILE", help="A .csv or .json file, a parameter a row.")],
    serial: SerialOption = None,
    model: ModelOption = "",
    lot: LotOption = "",
    registry: RegistryOption = "",
) -> None:
    """Write all parameters of results, with uncertainty, as a table for other programs.

    Example: tumble registry export lot-7.csv --lot 7
    """
    from tumble.foundation.words import count_of

    rows = _open(registry).export(path, serial=serial, model=model or None, lot=lot or None)
    print_line(f"{path}: {count_of('row', rows)}")


@registry_app.command("backup", cls=AbbreviatingCommand)
def backup_command(
    folder: Annotated[str, typer.Argument(metavar="FOLDER", help="A new folder for the copy.")],
    registry: RegistryOption = "",
) -> None:
    """Copy a registry with its documents, from either engine, into a folder, and verify the copy.

    Example: tumble registry backup 2026-11-25

    The copy is a registry in a file, registry.db.
    """
    found = _open(registry).backup(folder)
    print_line(f"{folder}/registry.db: {found.entries} entries, {found.documents} documents, intact")
    print_line(f"Last entry: {found.head}")


@registry_app.command("equipment", cls=AbbreviatingCommand)
def equipment_command(
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help="Equipment to add or to renew; all is listed without.")
    ] = "",
    kind: Annotated[
        str,
        typer.Option(metavar="KIND", help="reference, table, chamber or thermometer.", show_default=False),
    ] = "",
    manufacturer: Annotated[str, typer.Option(metavar="TEXT", help="Its maker.", show_default=False)] = "",
    model: Annotated[str, typer.Option(metavar="TEXT", help="Its model.", show_default=False)] = "",
    serial: Annotated[str, typer.Option(metavar="TEXT", help="Its serial.", show_default=False)] = "",
    certificate: Annotated[
        str, typer.Option(metavar="TEXT", help="Number of its certificate.", show_default=False)
    ] = "",
    due: Annotated[
        str, typer.Option(metavar="YYYY-MM-DD", help="Date until which that is valid.", show_default=False)
    ] = "",
    uncertainty: Annotated[
        str, typer.Option(metavar="TEXT", help="Its uncertainty, in words.", show_default=False)
    ] = "",
    state: Annotated[str, typer.Option(metavar="TEXT", help="Such as retired.", show_default=False)] = "",
    document: Annotated[
        str, typer.Option(metavar="FILE", help="The certificate as a file.", show_default=False)
    ] = "",
    operator: OperatorOption = "",
    registry: RegistryOption = "",
    as_json: JsonOption = False,
) -> None:
    """List references, tables and chambers with the dates at which they are due, or add one.

    Example: tumble registry equipment "reference 1" --kind reference --due 2027-06-30

    Facts of known equipment that are not given stay as they were. The exit code of a list is 3 if
    a piece that is in service is past its date.
    """
    opened = _open(registry)
    from tumble.laboratory import equipment

    if name:
        stated = {
            "kind": kind, "manufacturer": manufacturer, "model": model, "serial": serial,
            "certificate": certificate, "due": due, "uncertainty": uncertainty, "state": state,
        }  # fmt: skip
        equipment.add(opened, name, {key: text for key, text in stated.items() if text}, document, operator)
        print_line(f"{name}: entered")
        return
    found = equipment.listed(opened)
    if as_json:
        _print("equipment", LISTED, {"equipment": list(found)})
    else:
        columns = ("kind", "name", "model", "serial", "certificate", "due", "state")
        print_summary(_table(columns, [tuple(str(row[column]) for column in columns) for row in found]))
    late = [str(row["name"]) for row in found if row["overdue"]]
    for each in late:
        print_line(f"tumble: warning: {each} is past its date", is_message=True)
    if late:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _print(document: str, verdict: str, content: Mapping[str, Any]) -> None:
    print_document(f"tumble-registry-{document}/1", verdict, content)


def _open(address: str) -> Registry:
    opened: Registry = laboratory_room("registry").Registry(_stated(address))
    return opened


def _limits(path: str | None) -> Limits | None:
    from tumble.calibration.limits import Limits

    return Limits.load(path) if path else None


def _stated(address: str) -> str:
    """Return the address that is set; raises `CommandError` where none is."""
    if address:
        return address
    raise CommandError(
        'no registry is set; give --registry FILE, set TUMBLE_REGISTRY, or write registry = "lab.db" into '
        "tumble.toml"
    )


def _short(identity: object) -> str:
    from tumble.laboratory.registry import SHORT

    return str(identity)[:SHORT]


def _table(columns: tuple[str, ...], rows: Any) -> Any:  # noqa: ANN401 - rich is imported late
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table
