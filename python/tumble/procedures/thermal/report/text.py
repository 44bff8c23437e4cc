"""Common wording of page, screen and notebook on temperature drift."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from tumble.foundation.results import Parameter
from tumble.foundation.units import Triad
from tumble.foundation.words import count_of, join, length_of_time
from tumble.procedures.thermal.result import AxisDrift, ThermalResult
from tumble.report.columns import parameter_cell, parameter_scales
from tumble.report.numbers import measurement, readable_scale, significant

COLUMNS = ("order", "drift within the range", "largest hysteresis", "scale")
"""Columns of the table with one row an axis."""


def sentences(result: ThermalResult) -> Iterator[str]:
    """Describes what was used, and where the result holds."""
    blocks = result.blocks
    low, high = result.range
    logs = len(result.sources)
    of_logs = "" if logs == 1 else f" of {logs} logs"
    yield (
        f"{length_of_time(blocks.still)} at rest, {low:.1f} to {high:.1f} °C, in "
        f"{count_of('pose', blocks.poses)}{of_logs}"
    )
    yield (
        f"M and b hold at {result.reference:.1f} °C; below {low:.1f} and above {high:.1f} °C the drift "
        "at that edge is held, as nothing shows how it goes on"
    )
    if result.lag.observable:
        behind = "behind" if result.lag.value > 0.0 else "ahead of"
        size = measurement(abs(result.lag.value), result.lag.sigma, "s")
        yield f"the thermometer is {behind} the sensor by {size}, which was taken into account"


def unseen(result: ThermalResult) -> Iterator[str]:
    """Describes what the logs do not show, of which axes, and why."""
    hidden: dict[tuple[str, str], list[str]] = {}
    for axis in result.axes:
        for each in (axis.scale_change, axis.hysteresis):
            if not each.observable:
                hidden.setdefault((each.name, each.reason), []).append(axis.name)
    for (name, reason), axes in hidden.items():
        yield f"{name} of {join(axes)}: {reason}"


def axis_rows(result: ThermalResult) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Prints what `COLUMNS` name of each axis."""
    columns = [
        parameter_column([axis.swing for axis in result.axes]),
        parameter_column([axis.hysteresis for axis in result.axes]),
        parameter_column([axis.scale_change for axis in result.axes]),
    ]
    rows = zip(result.axes, *columns, strict=True)
    return tuple((axis.name, (order_of(axis), *cells)) for axis, *cells in rows)


def order_of(axis: AxisDrift) -> str:
    """Returns the powers of temperature in the fit."""
    of_scale = f", scale {len(axis.scale)}" if len(axis.scale) else ""
    return f"{len(axis.bias)}{of_scale}"


def parameter_column(parameters: Sequence[Parameter]) -> list[str]:
    """Prints estimates with their 1-sigma, those of one unit in one scale."""
    scales = parameter_scales(parameters)
    return [parameter_cell(each, scales) for each in parameters]


def score_rows(axes: Sequence[AxisDrift]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Prints the weight of each set of terms in percent, by axis; the chosen one is marked."""
    sets = list(dict.fromkeys((score.bias, score.scale) for axis in axes for score in axis.scores))
    rows = []
    for bias, power in sets:
        texts = []
        for axis in axes:
            found = [score for score in axis.scores if (score.bias, score.scale) == (bias, power)]
            mark = " ●" if found and found[0].chosen else ""
            texts.append(f"{100.0 * found[0].weight:.0f}{mark}" if found else "")
        rows.append((f"bias {bias}" + (f", scale {power}" if power else ""), tuple(texts)))
    return tuple(rows)


def parameter_rows(result: ThermalResult, triad: Triad) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Prints every parameter of the axes of a triad, side by side."""
    found = [{each.name: each for each in axis.parameters()} for axis in result.of_triad(triad)]
    scales = parameter_scales(parameter for each in found for parameter in each.values())
    names = sorted({name for each in found for name in each}, key=_place)
    return tuple(
        (
            name.replace("^2", "²").replace("^3", "³"),
            tuple(parameter_cell(each[name], scales) if name in each else "none" for each in found),
        )
        for name in names
    )


def _place(name: str) -> tuple[bool, bool, str]:
    return name.endswith("hysteresis"), name.startswith("scale"), name


def method_lines(result: ThermalResult) -> tuple[tuple[str, str], ...]:
    """Lists how it was done."""
    noise = ", ".join(
        f"{axis.name} {printed_noise(axis)}" for axis in result.axes if axis.noise_density > 0.0
    )
    fixture = "yes" if result.options.get("fixture") else "no: each rest is a pose of its own"
    return (
        (
            "fit",
            "generalised least squares in white noise and flicker noise or random walk, averaged over both"
            " and their strengths",
        ),
        ("order", "the likeliest, each power at a cost; sigmas take in the others by their Akaike weights"),
        ("left by the fit", noise),
        ("thermometer", f"steps of {result.step:.3g} K, smoothed over four of them at least"),
        ("fixture", fixture),
        ("blocks", f"{len(result.blocks)}, in {count_of('pose', result.blocks.poses)}"),
        ("sources", ", ".join(result.sources)),
        ("software", result.software),
    )


def printed_noise(axis: AxisDrift) -> str:
    """Prints N, and B or K, of what the fit leaves."""
    white = f"N {_printed(axis.noise_density, f'{axis.unit}/sqrt(Hz)')}"
    if axis.random_walk > 0.0:
        return f"{white}, K {_printed(axis.random_walk, f'{axis.unit}/sqrt(s)')}"
    return f"{white}, B {_printed(axis.bias_instability, axis.unit)}"


def _printed(value: float, unit: str) -> str:
    scale = readable_scale(unit, value)
    return scale.quantity(significant(scale.factor * value, 2))
