"""Options that all of `tumble simulate` share, and how they are read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias, TypeVar

import typer

from tumble.cli.options import Options
from tumble.cli.screen import print_document
from tumble.cli.shared_options import JsonOption, LogFormatWord, format_option
from tumble.foundation.errors import TumbleError

if TYPE_CHECKING:
    from tumble.tools.simulate import SimulatedUnit

AnyFault = TypeVar("AnyFault")
SIMULATION: Final = "tumble-simulation/1"

FAULTS_HELP = (
    "Kinds: scale, stuck, frozen, moved, bias-jump, bias-drift, noise, spikes, saturated, nan, swapped-axes, "
    "left-handed, wrong-unit, gap, absent, dead, late, doubled, time-backwards, clock-jump. Keys: triad, "
    "axis, start (s), end (s), size."
)


GravityOption: TypeAlias = Annotated[float, typer.Option(help="Local gravity in m/s^2.")]
GradeOption: TypeAlias = Annotated[str, typer.Option(help="consumer, industrial, tactical or reference.")]
InstabilityOption: TypeAlias = Annotated[
    bool, typer.Option(help="Noise with bias instability, or white noise alone.")
]
StepsOption: TypeAlias = Annotated[bool, typer.Option(help="Readings in steps, or unrounded.")]
ResponseOption: TypeAlias = Annotated[
    bool, typer.Option(help="Gyroscopes that respond to specific force, or none.")
]
SeedOption: TypeAlias = Annotated[int, typer.Option(help="All random numbers follow from it.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationOptions(Options):
    """Options of all simulated recordings."""

    seed: SeedOption = 1
    format_name: Annotated[LogFormatWord, format_option("csv|parquet|mcap", "csv")] = LogFormatWord.CSV
    as_json: JsonOption = False


def print_simulation(content: Mapping[str, Any]) -> None:
    """Print, as JSON, what was simulated, and the files it was written to."""
    from tumble.foundation.plain import finite

    print_document(SIMULATION, "simulated", {key: finite(value) for key, value in content.items()})


def faults_by_unit(specs: list[str], make: Callable[..., AnyFault]) -> dict[str, list[AnyFault]]:
    """Reads `target_2:stuck:axis=y:start=20` and the like: what is wrong with each unit, by its name."""
    faults: dict[str, list[AnyFault]] = {}
    for spec in specs:
        unit, _, rest = spec.partition(":")
        fault = fault_of(f"--fault {spec}", rest, "UNIT:KIND[:KEY=VALUE]...", make)
        faults.setdefault(unit, []).append(fault)
    return faults


def fault_of(option: str, text: str, form: str, make: Callable[..., AnyFault]) -> AnyFault:
    """Reads `stuck:axis=y:start=20`, and makes a fault of it; `option` and `form` are for the error."""
    kind, *settings = text.split(":")
    try:
        return make(kind, **dict(_setting(text) for text in settings))
    except TypeError as error:
        raise TumbleError(f"{option}: a fault of this kind has no triad; write {form}") from error
    except ValueError as error:
        raise TumbleError(f"{option}: {error}; write {form}") from error


def numbers_of(option: str, text: str, count: int) -> list[float]:
    """Reads numbers with commas between; `option` is for the error."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        wanted = "a number" if count == 1 else f"{count} numbers with commas between"
        raise TumbleError(f"{option} {text}: needs {wanted}")
    return numbers


def _setting(text: str) -> tuple[str, str | float]:
    key, _, value = text.partition("=")
    if key in ("triad", "axis"):
        return key, value
    if key in ("start", "end", "size"):
        try:
            return key, float(value)
        except ValueError:
            raise ValueError(f"{key} needs a number, found {value!r}") from None
    raise ValueError(f"unknown key {key!r}; known are triad, axis, start, end, size")


def unit_line(place: str, unit: SimulatedUnit) -> str:
    """Describes the recording of a unit and its faults; `place` is the file of the recording."""
    faults = ", ".join(fault.kind for fault in unit.faults)
    fault = f", fault: {faults}" if faults else ""
    return f"{place}: {unit.grade.name}, {len(unit.samples)} samples{fault}"
