"""`tumble simulate live`: units, and a table that turns them, to try live procedures without hardware."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import JsonOption, RateOption
from tumble.foundation.words import count_of
from tumble.tools.simulate.options import SeedOption, faults_by_unit, print_simulation

if TYPE_CHECKING:
    from tumble.tools.simulate.live.procedure import LiveSimulation

FAULTS_HELP = (
    "Kinds: unplugged, garbled, restart, moved, frozen, gap, late, clock-jump, time-backwards. Keys: axis, "
    "start (s), end (s), size."
)


class MotionName(str, Enum):
    """Motion of the units."""

    TABLE = "table"
    SIX_FACES = "six-faces"
    HAND = "hand"
    SPIN = "spin"
    FLIGHT = "flight"


class TransportWord(str, Enum):
    """Transport of the samples."""

    UDP = "udp"
    PTY = "pty"
    TCP = "tcp"
    MAVLINK = "mavlink"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionOptions(Options):
    """Motion of the units, and its length."""

    motion: Annotated[
        MotionName,
        typer.Option(
            help="What moves the units: a table that is told over TCP, a hand from face to face, or with one "
            "unit all over the sphere, a robot, or a quadrotor."
        ),
    ] = MotionName.TABLE
    grades: Annotated[
        str,
        typer.Option(
            help="Grade of each unit, the reference or the primary first, separated by commas; what is "
            "usual for the motion if not given."
        ),
    ] = ""
    rate: RateOption = 200.0
    rest: Annotated[
        float, typer.Option(help="Time at rest first, and at each face or orientation, in s.")
    ] = 10.0
    told: Annotated[
        bool,
        typer.Option(
            "--told",
            help="A hand turns where events on standard input ask: those of tumble multipose --live --json.",
        ),
    ] = False
    speed: Annotated[float, typer.Option(help="Simulated seconds in a second.")] = 1.0
    duration: Annotated[
        float | None,
        typer.Option(help="Simulated s after which it ends; at the end of the motion, or with Ctrl-C."),
    ] = None
    seed: SeedOption = 1

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        return {
            "motion": self.motion.value,
            "grades": tuple(word.strip() for word in self.grades.split(",") if word.strip()),
            "rate_hz": self.rate,
            "rest_seconds": self.rest,
            "told": self.told,
            "speed": self.speed,
            "duration_seconds": self.duration,
            "seed": self.seed,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceOptions(Options):
    """Addresses of units and table."""

    transport: Annotated[TransportWord, typer.Option(help="How the units are heard.")] = TransportWord.UDP
    host: Annotated[str, typer.Option(help="Where datagrams go to, and where TCP is served.")] = "127.0.0.1"
    port: Annotated[
        int, typer.Option(help="Port of the first unit, the next one's is one more; 0 for free ones.")
    ] = 9000
    table_port: Annotated[int, typer.Option(help="TCP port of the table; 0 for a free one.")] = 5025
    table_profile: Annotated[
        str,
        typer.Option(metavar="NAME|FILE", help="Profile of the table: its words and what its axes may do."),
    ] = "scpi"

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        return {
            "transport": self.transport.value,
            "host": self.host,
            "port": self.port,
            "table_port": self.table_port,
            "table_profile": self.table_profile,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class LineOptions(Options):
    """Clocks and lines of the units."""

    clock_offset: Annotated[float, typer.Option(help="Largest offset of clocks either way in s.")] = 5.0
    clock_skew: Annotated[float, typer.Option(help="Skew of clocks in ppm, 1 sigma.")] = 50.0
    delay: Annotated[float, typer.Option(help="Time that every sample is on its way, ms.")] = 2.0
    jitter: Annotated[float, typer.Option(help="How much longer samples take, mean in ms.")] = 1.0
    batch: Annotated[float, typer.Option(help="Samples sent together: all of so many ms; 0 for each.")] = 0.0
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="UNIT:KIND[:KEY=VALUE]...",
            help="Something wrong with a unit, such as target_2:unplugged:start=20:end=25; may be repeated. "
            f"{FAULTS_HELP}",
        ),
    ] = None

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        from tumble.tools.simulate.live.fault import LiveFault

        return {
            "clock_offset_seconds": self.clock_offset,
            "clock_skew_ppm": self.clock_skew,
            "delay_seconds": 1e-3 * self.delay,
            "jitter_seconds": 1e-3 * self.jitter,
            "batch_seconds": 1e-3 * self.batch,
            "faults": faults_by_unit(self.fault or [], LiveFault),
        }


def live_command(
    output: OutputFolder = None,
    *,
    moved: MotionOptions,
    service: ServiceOptions,
    line: LineOptions,
    as_json: JsonOption = False,
) -> None:
    """Serve units that move, and a table that turns them, as if they were there.

    Example: tumble simulate live --grades reference,consumer,tactical --seed 7 -o bench

    Prints where each unit is read and the table is commanded, then serves them until the motion ends, or
    Ctrl-C or SIGTERM. Writes truth.yaml.
    """
    from tumble.tools.simulate.live.files import write_live
    from tumble.tools.simulate.live.hand_events import follow_events
    from tumble.tools.simulate.live.procedure import LiveSimulation
    from tumble.tools.simulate.live.scenario import LiveScenario
    from tumble.tools.simulate.live.signals import ended_by_signals

    folder = output or folder_named_after("live")
    scenario = LiveScenario(**moved.stated(), **service.stated(), **line.stated())
    with ended_by_signals() as wait_until_ended, LiveSimulation(scenario, folder) as simulation:
        truth = str(write_live(simulation, folder))
        _show(simulation, truth, as_json)
        if moved.told:
            follow_events(simulation, sys.stdin)
        wait_until_ended(simulation)
    _show_end(simulation)


def _show(simulation: LiveSimulation, truth: str, as_json: bool) -> None:
    table = simulation.table_address
    if as_json:
        content = {"seed": simulation.scenario.seed, "units": simulation.addresses, "truth": truth}
        print_simulation(content | ({} if table is None else {"table": table}))
    else:
        print(f"seed {simulation.scenario.seed}; {truth}: the truth")
        words = [f"'{name}={address}'" for name, address in simulation.addresses.items()]
        print(*words, sep="\n")
        if table is not None:
            print(f"--table '{table}'")
        if len(words) == 1 and simulation.scenario.motion in ("spin", "hand"):
            procedure = "spin" if simulation.hand is None else "multipose"
            print(f"Next: tumble {procedure} --live '{simulation.units[0].address}'")
        else:
            print(f"Next: tumble record {' '.join(words)} -o session")
        print("Ctrl-C ends it.")
    sys.stdout.flush()


def _show_end(simulation: LiveSimulation) -> None:
    for unit in simulation.units:
        lost = f", {count_of('sample', unit.lost)} of them nobody took" if unit.lost else ""
        print(f"{unit.name}: {count_of('sample', unit.sent)} sent{lost}", file=sys.stderr)
    if simulation.lag > 1.0:
        print(
            f"tumble: serving fell behind by {simulation.lag:.1f} s; give a lower --rate or --speed",
            file=sys.stderr,
        )
