"""`tumble bench`: serves the bench page until Ctrl-C."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.errors import print_notice
from tumble.cli.registry_option import RegistryOption
from tumble.cli.screen import print_event
from tumble.cli.shared_options import JsonOption, MakerOptions, RateOption
from tumble.cli.standard_output import drawing
from tumble.foundation.errors import CommandError
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.words import count_of
from tumble.logs.optional import install_command

if TYPE_CHECKING:
    from tumble.bench.bench import Bench
    from tumble.bench.simulated import SimulatedBench

FOLDER = "bench"
"""Folder of the runs where none is given."""


def bench_command(
    folder: Annotated[
        Path,
        typer.Option("--folder", metavar="DIR", help="Folder of the runs, their recordings and results."),
    ] = Path(FOLDER),
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Address to serve at; any but this computer's own needs the token that is printed.",
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for a free one.")] = 8321,
    certificate: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Certificate of the server (PEM), for TLS.", show_default=False),
    ] = None,
    key: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Private key of the certificate (PEM).", show_default=False),
    ] = None,
    pedal: Annotated[str, typer.Option(metavar="KEY", help="Key that a pedal presses, such as F9.")] = "F9",
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Serve simulated units, and a rate table that turns them.")
    ] = False,
    speed: Annotated[
        float, typer.Option(min=0.1, max=50.0, help="With --simulated: simulated seconds in a second.")
    ] = 1.0,
    rate: RateOption = 200.0,
    registry: RegistryOption = "",
    fleet: Annotated[
        Path | None,
        typer.Option(
            "--fleet",
            metavar="DIR",
            help="Folder with job files of tumble fleet, whose progress and results are shown; that of the "
            "runs if not given.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    *,
    maker: MakerOptions,
) -> None:
    """Calibrate in a browser: sources, guided runs, one big verdict, units and certificates.

    Example: tumble bench --folder bench --registry lab.db

    Serves this computer only, unless --host is given; then a token is needed, which is printed with a QR
    code. Ctrl-C ends it, and a run that was under way can go on with the next start.
    """
    from tumble.bench.settings import BenchSettings
    from tumble.foundation.ending import watched

    if (certificate is None) != (key is None):
        raise CommandError("--certificate and --key belong together; give both, or neither")
    for path in (certificate, key):
        if path is not None and not is_file(path):
            raise CommandError(f"{path}: no such file; give the certificate and its key as PEM")
    if fleet is not None and not is_folder(fleet):
        raise CommandError(f"{fleet}: no such folder; give the one with the job files")
    server, bench_module = _needed("server"), _needed("bench")
    settings = BenchSettings(
        folder=folder,
        host=host,
        port=port,
        certificate=certificate,
        key=key,
        registry=registry,
        fleet=fleet,
        operator=maker.operator,
        station=maker.station,
        pedal=pedal,
    )
    simulating = _simulation(folder, speed, rate) if simulated else nullcontext(None)
    with watched(), simulating as simulation:
        bench: Bench = bench_module.Bench(settings, simulation)
        try:
            _needed("server_log").hide_secrets_in_logs()
            served = server.BenchServer(bench)
            try:
                served.serve_until_ended(lambda: _show_address(bench, served.port, as_json))
            finally:
                _report_dropped(served.dropped.count)
        finally:
            bench.close()


def _report_dropped(count: int) -> None:
    if count:
        print_notice(f"{count_of('message', count)} of browsers made no sense, and changed nothing")


def _simulation(folder: Path, speed: float, rate: float) -> SimulatedBench:
    from tumble.bench.simulated import SimulatedBench
    from tumble.foundation.files import prepare_folder

    return SimulatedBench(prepare_folder(folder), speed=speed, rate=rate)


def _needed(module: str) -> Any:  # noqa: ANN401 - a module has no type of its own
    """Imports a module of the bench; raises `CommandError`, with a remedy, where a library is missing."""
    try:
        return import_module(f"tumble.bench.{module}")
    except ModuleNotFoundError as error:
        raise CommandError(
            f"the bench needs the Python package {error.name}, which is not installed; type: "
            f"{install_command('bench')}"
        ) from error


def _show_address(bench: Bench, port: int, as_json: bool) -> None:
    from tumble.bench.address import entrances
    from tumble.bench.qr import qr_code

    found = entrances(bench.settings, bench.access, port)
    # Here alone tokens are to be read: whoever sees the terminal operates.
    with drawing():
        if as_json:
            print_event("serving", {"folder": str(bench.folder), **found}, keeps_secrets=True)
            return
        print(f"Bench: {found['operator']}")
        if not bench.settings.is_local:
            print(f"For viewers: {found['viewer']}")
            print(qr_code(found["operator"]))
    if not bench.settings.is_local and bench.settings.certificate is None:
        print("tumble: warning: without --certificate the network can read along", file=sys.stderr)
    print(f"Runs are in {bench.folder}. Ctrl-C ends it.")
    sys.stdout.flush()
