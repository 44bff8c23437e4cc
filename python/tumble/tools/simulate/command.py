"""`tumble simulate`: recordings and live streams whose truth is known, to try a procedure on."""

from __future__ import annotations

import typer

from tumble.cli.abbreviations import AbbreviatingCommand
from tumble.cli.options import expanded
from tumble.tools.simulate.flight.command import flight_command
from tumble.tools.simulate.live.command import live_command
from tumble.tools.simulate.magnetometer.command import magnetometer_command
from tumble.tools.simulate.multipose.command import multipose_command
from tumble.tools.simulate.plateaus.command import plateaus_command
from tumble.tools.simulate.spin.command import spin_command
from tumble.tools.simulate.static.command import static_command
from tumble.tools.simulate.thermal.command import thermal_command
from tumble.tools.simulate.turntable.command import turntable_command

simulate_app = typer.Typer(no_args_is_help=True, help="Make recordings whose truth is known.")


@simulate_app.callback()
def _simulate() -> None:
    """Make recordings whose truth is known."""


simulate_app.command("turntable", cls=AbbreviatingCommand)(expanded(turntable_command))
simulate_app.command("flight", cls=AbbreviatingCommand)(expanded(flight_command))
simulate_app.command("spin", cls=AbbreviatingCommand)(expanded(spin_command))
simulate_app.command("multipose", cls=AbbreviatingCommand)(expanded(multipose_command))
simulate_app.command("magnetometer", cls=AbbreviatingCommand)(expanded(magnetometer_command))
simulate_app.command("static", cls=AbbreviatingCommand)(expanded(static_command))
simulate_app.command("thermal", cls=AbbreviatingCommand)(expanded(thermal_command))
simulate_app.command("plateaus", cls=AbbreviatingCommand)(expanded(plateaus_command))
simulate_app.command("live", cls=AbbreviatingCommand)(expanded(live_command))
