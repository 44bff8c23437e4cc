"""`tumble table`: what it takes to try a table, or a profile of it, by hand."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tumble.cli.abbreviations import AbbreviatingCommand, NumbersCommand
from tumble.cli.screen import LISTED, print_document
from tumble.cli.shared_options import JsonOption
from tumble.foundation import clock
from tumble.foundation.errors import TableError

if TYPE_CHECKING:
    from tumble.foundation.recording import FloatArray
    from tumble.tools.table.guarded import GuardedTable

table_app = typer.Typer(no_args_is_help=True, help="Try a rate table: list, position, goto, rate, stop.")

LONGEST: Final = 1e6
"""s for which a table turns at most."""
TABLES: Final = "tumble-tables/1"
POSITION: Final = "tumble-table-position/1"

TableOption = Annotated[
    str,
    typer.Option(
        "--table",
        metavar="DRIVER[:ADDRESS]",
        help="The table, such as simulated:two-axis or 'text:TCPIP::HOST::PORT::SOCKET?profile=scpi'; see "
        "tumble table list.",
        show_default=False,
    ),
]
LimitsOption = Annotated[
    str,
    typer.Option(
        "--table-limits",
        metavar="[AXIS.]KEY=VALUE,...",
        help="Limits on top of the maker's: rate=30 (deg/s), acceleration=20 (deg/s^2), outer.angle=-90..90 "
        "(deg).",
        show_default=False,
    ),
]
ArmedOption = Annotated[
    bool, typer.Option("--armed", help="Move. Without it, only what would be done is printed.")
]


@table_app.callback()
def _table() -> None:
    """Try a rate table: list, position, goto, rate, stop."""


@table_app.command("list", cls=AbbreviatingCommand)
def list_command(as_json: JsonOption = False) -> None:
    """List the drivers and the profiles of tables that come with Tumble.

    Example: tumble table list
    """
    from tumble.tools.table.profile import load_profile, shipped
    from tumble.tools.table.registry import drivers
    from tumble.tools.table.text import UNTRIED

    profiles = {name: load_profile(name) for name in shipped()}
    if as_json:
        named = {
            name: {"name": each.name, "axes": [axis.name for axis in each.axes], "tried": each.tried}
            for name, each in profiles.items()
        }
        print_document(TABLES, LISTED, {"drivers": drivers(), "profiles": named})
        return
    print(f"drivers: {', '.join(drivers())}")
    for name, profile in profiles.items():
        axes = ", ".join(axis.name for axis in profile.axes)
        print(f"profile {name}: {profile.name} ({axes}); {profile.tried or UNTRIED}")


@table_app.command("position", cls=AbbreviatingCommand)
def position_command(table: TableOption, as_json: JsonOption = False) -> None:
    """Report where a table is.

    Example: tumble table position --table simulated:two-axis
    """
    with _opened(table) as opened:
        _show_position(opened, as_json)


@table_app.command("stop", cls=AbbreviatingCommand)
def stop_command(table: TableOption) -> None:
    """Stop a table, whatever it does.

    Example: tumble table stop --table 'text:TCPIP::192.168.1.20::5025::SOCKET?profile=scpi'
    """
    with _opened(table) as opened:
        opened.stop()
    print("stopped")


@table_app.command("goto", cls=NumbersCommand)
def goto_command(
    angles: Annotated[
        str, typer.Argument(metavar="ANGLE[,ANGLE...]", help="deg, one for each axis from the floor up.")
    ],
    table: TableOption,
    speed: Annotated[
        str | None, typer.Option(metavar="RATE[,RATE...]", help="deg/s at most; the limits if not given.")
    ] = None,
    acceleration: Annotated[
        str | None,
        typer.Option(metavar="ACC[,ACC...]", help="deg/s^2 at most; the limits if not given."),
    ] = None,
    table_limits: LimitsOption = "",
    armed: ArmedOption = False,
    as_json: JsonOption = False,
) -> None:
    """Turn a table to angles, and wait until it is there.

    Example: tumble table goto 90,0 --table simulated:two-axis --speed 20,20 --armed
    """
    with _opened(table, table_limits, armed) as opened:
        opened.goto(
            _figures(opened, "ANGLE", angles),
            None if speed is None else _figures(opened, "--speed", speed),
            None if acceleration is None else _figures(opened, "--acceleration", acceleration),
        )
        if armed:
            opened.wait()
            _show_position(opened, as_json)


@table_app.command("rate", cls=NumbersCommand)
def rate_command(
    rates: Annotated[
        str, typer.Argument(metavar="RATE[,RATE...]", help="deg/s, one for each axis from the floor up.")
    ],
    table: TableOption,
    seconds: Annotated[float, typer.Option("--for", help="s to turn at the rate.")] = 5.0,
    acceleration: Annotated[
        str | None,
        typer.Option(metavar="ACC[,ACC...]", help="deg/s^2 at most; the limits if not given."),
    ] = None,
    table_limits: LimitsOption = "",
    armed: ArmedOption = False,
) -> None:
    """Turn a table at rates for a while, then stop it.

    Example: tumble table rate 36 --for 10 --table simulated:one-axis --armed
    """
    if not 0.0 <= seconds <= LONGEST:
        raise TableError(f"--for {seconds:g}: give s from 0 to {LONGEST:g}")
    with _opened(table, table_limits, armed) as opened:
        opened.rate(
            _figures(opened, "RATE", rates),
            None if acceleration is None else _figures(opened, "--acceleration", acceleration),
        )
        if armed:
            opened.wait()
            clock.sleep(seconds)
            # A stop by something else meanwhile, such as Ctrl-Z, is an error.
            opened.settled()
    if armed:
        print("stopped")


@contextmanager
def _opened(address: str, limits: str = "", armed: bool = False) -> Iterator[GuardedTable]:
    """Opens a table, and prints its remarks."""
    import sys

    from tumble.tools.table.bounds import parse_limits
    from tumble.tools.table.guarded import GuardedTable
    from tumble.tools.table.registry import open_table

    found = open_table(address)
    for remark in found.remarks:
        print(f"tumble: {found.name}: {remark}", file=sys.stderr)
    with GuardedTable(found, parse_limits(limits, found.axes), armed=armed, say=_say) as table:
        yield table


def _say(line: str) -> None:
    print(f"{line}; nothing moved, as it is not --armed")


def _figures(table: GuardedTable, what: str, text: str) -> FloatArray:
    from tumble.foundation.numbers import number_of
    from tumble.tools.table.angles import in_radians

    numbers = [number for part in text.split(",") if (number := number_of(part)) is not None]
    if len(numbers) != len(table.axes) or len(numbers) <= text.count(","):
        names = ", ".join(axis.name for axis in table.axes)
        raise TableError(f"{what} {text}: needs a number for each of {names}, commas between")
    return in_radians(numbers)


def _show_position(table: GuardedTable, as_json: bool) -> None:
    from tumble.tools.table.angles import in_degrees

    angles = dict(zip((axis.name for axis in table.axes), in_degrees(table.position()), strict=True))
    if as_json:
        known = "known" if None not in angles.values() else "partly known"
        print_document(POSITION, known, {"name": table.name, "position_deg": angles})
        return
    for name, angle in angles.items():
        print(f"{name}: not known" if angle is None else f"{name}: {angle:.4f} deg")
