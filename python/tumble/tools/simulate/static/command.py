"""`tumble simulate static`: a unit that stands still, recorded, with its truth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import (
    GradeOption,
    GravityOption,
    SimulationOptions,
    print_simulation,
)

if TYPE_CHECKING:
    from tumble.tools.simulate import SimulatedStatic

_TERMS = "TERM=VALUE,... with q, n, b, k, r: quantisation, white noise, bias instability, random walk, ramp"
_LETTERS = "qnbkr"


def static_command(
    output: OutputFolder = None,
    duration: Annotated[str, typer.Option(metavar="TIME", help="Length, such as 90s, 20min or 3h.")] = "1h",
    rate: RateOption = 100.0,
    grade: GradeOption = "consumer",
    accelerometer: Annotated[
        str | None,
        typer.Option(
            metavar="TERM=VALUE,...", help=f"{_TERMS}; SI. What is not given is of the grade, or zero."
        ),
    ] = None,
    gyroscope: Annotated[
        str | None, typer.Option(metavar="TERM=VALUE,...", help="Likewise, such as n=1e-4,b=2e-5,k=1e-6.")
    ] = None,
    gap: Annotated[
        list[str] | None,
        typer.Option(metavar="START:END", help="The logger misses what lies between, s; repeatable."),
    ] = None,
    gravity: GravityOption = STANDARD_GRAVITY,
    *,
    shared: SimulationOptions,
) -> None:
    """Simulate a unit that stands still, with noise of known terms.

    Example: tumble simulate static --duration 3h --gyroscope n=1e-4,b=2e-5,k=1e-6 --seed 7 -o static

    Writes static.csv and, to hold results against, truth.yaml.
    """
    from tumble.cli.progress import sample_progress
    from tumble.tools.simulate import simulate_static, write_static

    static = simulate_static(
        seed=shared.seed,
        duration=seconds_of("--duration", duration),
        rate_hz=rate,
        grade=grade,
        accelerometer=_terms("--accelerometer", accelerometer),
        gyroscope=_terms("--gyroscope", gyroscope),
        gaps=tuple(_gap(text) for text in gap or ()),
        gravity=gravity,
    )
    folder = output or folder_named_after("static")
    with sample_progress("writing") as advance:
        paths = write_static(static, folder, shared.format_name.value, progress=advance)
    _show(static, {name: str(path) for name, path in paths.items()}, shared.as_json)


def _terms(option: str, text: str | None) -> dict[str, float]:
    from tumble.foundation.noise_terms import TERM_UNITS

    words = dict(zip(_LETTERS, TERM_UNITS["gyroscope"], strict=True))
    try:
        pairs = [part.split("=") for part in text.split(",")] if text else []
        return {words[letter.strip()]: float(value) for letter, value in pairs}
    except (KeyError, ValueError):
        raise TumbleError(f"{option} {text}: write {_TERMS}, such as n=1e-4,b=2e-5") from None


def _gap(text: str) -> tuple[float, float]:
    start, _, end = text.partition(":")
    try:
        return float(start), float(end)
    except ValueError:
        raise TumbleError(f"--gap {text}: give START:END in s, such as 12.5:60") from None


def _show(static: SimulatedStatic, paths: dict[str, str], as_json: bool) -> None:
    scenario = static.scenario
    if as_json:
        print_simulation(
            {"seed": scenario.seed, "samples": scenario.samples, "truth": static.truth, "files": paths}
        )
        return
    print(f"{paths['log']}: {scenario.unit_grade.name}, {scenario.samples} samples")
    print(f"{paths['truth']}: the truth")
    print(f"Next: tumble noise {paths['log']} -o results")
