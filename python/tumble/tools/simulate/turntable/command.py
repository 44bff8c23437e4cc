"""`tumble simulate turntable`: a session on a turntable, recorded, with its truth."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.words import count_of
from tumble.tools.simulate.options import (
    FAULTS_HELP,
    GravityOption,
    InstabilityOption,
    ResponseOption,
    SimulationOptions,
    faults_by_unit,
    print_simulation,
    unit_line,
)

if TYPE_CHECKING:
    from tumble.poses.pose_list import PoseList
    from tumble.tools.simulate import SimulatedTurntable


class ClockSharing(str, Enum):
    """Sharing of one clock by all units."""

    SHARED = "shared"
    APART = "apart"


class TurnProfile(str, Enum):
    """Shape of the angular rate over a turn."""

    SMOOTH = "smooth"
    TRAPEZOID = "trapezoid"


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitOptions(Options):
    """Units on the table, and their faults."""

    grades: Annotated[
        str,
        typer.Option(
            help="Grade of each target, separated by commas: consumer, industrial, tactical, reference."
        ),
    ] = "consumer,industrial,tactical"
    reference: Annotated[str, typer.Option(help="Grade of the reference.")] = "reference"
    perfect_reference: Annotated[
        bool,
        typer.Option(
            "--perfect-reference",
            help="Let scale, non-orthogonality and alignment of the reference be exact.",
        ),
    ] = False
    rate: RateOption = 200.0
    target_mounting: Annotated[
        float, typer.Option(help="Mounting angle of a target against the reference, deg, axis drawn.")
    ] = 1.0
    bias_instability: InstabilityOption = True
    g_sensitivity: ResponseOption = True
    magnetometer: Annotated[
        bool, typer.Option("--magnetometer", help="Let all units have a magnetometer.")
    ] = False
    field_difference: Annotated[
        float,
        typer.Option(help="Field at the targets less that at the reference, uT eastwards, by steel nearby."),
    ] = 0.0
    disturbed: Annotated[
        int, typer.Option(metavar="REST", help="Number of the rest at which a magnet is near.")
    ] = 0
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="UNIT:KIND[:KEY=VALUE]...",
            help="Something wrong with a unit, such as target_2:stuck:triad=gyroscope:axis=y; may be "
            f"repeated. {FAULTS_HELP}",
        ),
    ] = None

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        from tumble.tools.simulate import Fault

        return {
            "grades": _words(self.grades),
            "reference": self.reference,
            "perfect_reference": self.perfect_reference,
            "rate_hz": self.rate,
            "target_mounting_deg": self.target_mounting,
            "bias_instability": self.bias_instability,
            "g_sensitivity": self.g_sensitivity,
            "magnetometer": self.magnetometer,
            "field_difference": self.field_difference,
            "disturbed": self.disturbed,
            "faults": faults_by_unit(self.fault or [], Fault),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class TableOptions(Options):
    """Motion of the table."""

    poses: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Pose list; the six faces if not given.")
    ] = None
    visits: Annotated[
        str | None,
        typer.Option(help="Names of the poses in the order they are taken, separated by commas."),
    ] = None
    rest: Annotated[float, typer.Option(help="Time at each pose in s.")] = 10.0
    mounting: Annotated[
        float, typer.Option(help="Mounting angle of the structure all units share, deg, axis drawn.")
    ] = 1.0
    table_error: Annotated[
        float, typer.Option(help="Error of the table at each pose, deg, 1 sigma about each axis.")
    ] = 0.02
    turn_rate: Annotated[float, typer.Option(help="Largest rate of a turn in deg/s.")] = 60.0
    profile: Annotated[TurnProfile, typer.Option(help="Shape of the rate over a turn.")] = TurnProfile.SMOOTH
    heading_turn: Annotated[
        float, typer.Option(help="Turn about the vertical after each change of pose, deg.")
    ] = 0.0
    rates: Annotated[
        str,
        typer.Option(
            metavar="RATE,...",
            help="Turn about the vertical at these constant rates after each rest, deg/s, both ways, such as "
            "10,30,60.",
        ),
    ] = ""
    seconds_per_rate: Annotated[float, typer.Option(help="Time at each of the constant rates, s.")] = 20.0

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        return {
            **({"poses": _poses(self.poses)} if self.poses else {}),
            "visits": _words(self.visits) if self.visits else None,
            "rest_seconds": self.rest,
            "mounting_angle_deg": self.mounting,
            "table_error_deg": self.table_error,
            "turn_rate_dps": self.turn_rate,
            "turn_profile": self.profile.value,
            "heading_turn_deg": self.heading_turn,
            "rates_dps": _rates(self.rates),
            "seconds_per_rate": self.seconds_per_rate,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceOptions(Options):
    """Where the table stands, and what stamps the samples."""

    clocks: Annotated[ClockSharing, typer.Option(help="One clock for all units, or each its own.")] = (
        ClockSharing.SHARED
    )
    clock_offset: Annotated[float, typer.Option(help="Clocks apart: largest offset either way in s.")] = 5.0
    clock_skew: Annotated[float, typer.Option(help="Clocks apart: skew in ppm, 1 sigma.")] = 50.0
    gravity: GravityOption = STANDARD_GRAVITY
    latitude: Annotated[float, typer.Option(help="Latitude in degrees, for the Earth's rate.")] = 45.0
    warm_up: Annotated[float, typer.Option(help="Rise of the temperature in the long run, K.")] = 0.0

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        return {
            "clocks": self.clocks.value,
            "clock_offset_seconds": self.clock_offset,
            "clock_skew_ppm": self.clock_skew,
            "gravity": self.gravity,
            "latitude_deg": self.latitude,
            "warm_up_kelvin": self.warm_up,
        }


def turntable_command(
    output: OutputFolder = None,
    *,
    units: UnitOptions,
    table: TableOptions,
    place: PlaceOptions,
    shared: SimulationOptions,
) -> None:
    """Simulate a turntable session: a reference and targets on one structure, turned from rest to rest.

    Example: tumble simulate turntable --grades consumer,consumer,tactical --seed 7 -o session

    Writes reference.csv, target_1.csv ..., poses.yaml and, to hold results against, truth.yaml.
    """
    from tumble.tools.simulate import simulate_turntable, write_turntable

    session = simulate_turntable(seed=shared.seed, **units.stated(), **table.stated(), **place.stated())
    paths = write_turntable(session, output or folder_named_after("turntable"), shared.format_name.value)
    _show(session, {name: str(path) for name, path in paths.items()}, shared.as_json)


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _rates(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in _words(text))
    except ValueError:
        raise typer.BadParameter(f"{text!r}: give numbers in deg/s, such as 10,30,60") from None


def _poses(path: Path) -> PoseList:
    from tumble.poses.pose_list import PoseList

    return PoseList.load(path)


def _show(session: SimulatedTurntable, paths: dict[str, str], as_json: bool) -> None:
    units = [unit.name for unit in session.units]
    samples = {unit.name: len(unit.samples) for unit in session.units}
    if as_json:
        content = {
            "seed": session.scenario.seed,
            "duration": session.duration,
            "samples": samples,
            "files": paths,
        }
        print_simulation(content)
        return
    for unit in session.units:
        print(unit_line(paths[unit.name], unit))
    poses, rests = len(session.scenario.poses), len(session.rests)
    print(f"{paths['poses']}: {count_of('pose', poses)}, {count_of('rest', rests)}")
    print(f"{paths['truth']}: the truth")
    logs = " ".join(paths[name] for name in units)
    fitted = " --g-sensitivity" if session.scenario.g_sensitivity else ""
    print(f"Next: tumble turntable {logs} --poses {paths['poses']}{fitted} -o results")
