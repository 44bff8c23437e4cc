"""A spin as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.gravity import gravity_content
from tumble.foundation.plain import finite
from tumble.foundation.results import Parameter
from tumble.foundation.words import count_of
from tumble.procedures.spin.report.parameters import is_scale, scale_error
from tumble.procedures.spin.report.text import spin_gravity, unobserved
from tumble.procedures.spin.result import BiasEstimate, Spin, SpinResult
from tumble.report.columns import parameter_cell
from tumble.report.numbers import NOT_OBSERVABLE, Scale, scales_of, significant

SCHEMA: Final = "tumble-spin-result/1"

MOST_SPINS = 4
"""With more spins than this, only what they agree on is shown; all are in the report."""
MOST_REFUSED = 8
"""Stretches that are no spins; a day of driving has hundreds."""


def screen_summary(result: SpinResult) -> RenderableType:
    """Returns the main results: the figures of each spin, and its warnings."""
    return _summary(result, MOST_SPINS, MOST_REFUSED)


def long_summary(result: SpinResult) -> RenderableType:
    """Returns the same, with all spins and all that is none."""
    return _summary(result, len(result.spins), len(result.refused))


def _summary(result: SpinResult, most_spins: int, most_refused: int) -> RenderableType:
    result = result.from_start()
    head = [Text(_about(spin)) for spin in result.spins]
    head.append(Text(f"Gravity: {spin_gravity(result)}"))
    notes = [Text(f"Not observable: {line}", "yellow") for line in _unobserved(result)]
    notes += [Text(f"Not used: {line}", "yellow") for line in _refused(result, most_refused)]
    notes += [
        Text(f"Warning: {spin.label}: {line}", "yellow") for spin in result.spins for line in spin.warnings
    ]
    notes += [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(*head, "", _table(result, most_spins), "", *notes)


def json_content(result: SpinResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give the result without its recording: what was found, and the files it was written to."""
    content = {
        "name": result.name,
        "source": result.source,
        "software": result.software,
        "gravity": gravity_content(result),
        "options": result.options,
        "calibration_hash": result.calibration_hash,
        "accelerometer_bias": _bias_content(result.accelerometer_bias),
        "gyroscope_bias": _bias_content(result.gyroscope_bias),
        "covariance": result.covariance,
        "agreement": _parameter_content(result.agreement),
        "spins": [_spin_content(spin) for spin in result.spins],
        "refused": [{"start": start, "end": end, "reason": why} for start, end, why in result.refused],
        "warnings": result.warnings,
        "calibration": result.calibration.content(),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _about(spin: Spin) -> str:
    turned = [f"{turns:.2f} turns {direction}" for direction, turns in spin.turns_by_direction.items()]
    return (
        f"{spin.label.capitalize()}, {spin.start:.1f} to {spin.end:.1f} s: "
        f"{count_of('rest', len(spin.rests))}, {spin.resting:.1f} s; {', '.join(turned)} at "
        f"{spin.rate:.2g} rad/s"
    )


def _table(result: SpinResult, most_spins: int) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    table.add_column("", no_wrap=True)
    shown = result.spins if len(result.spins) <= most_spins else ()
    several = len(result.spins) > 1
    for title in [*(["all spins"] if several else []), *(spin.label for spin in shown)]:
        table.add_column(title, no_wrap=True)
    for name, cells in _rows(result, shown, several):
        table.add_row(name, *(Text(cell, "dim" if cell == NOT_OBSERVABLE else "") for cell in cells))
    return table


def _rows(result: SpinResult, shown: tuple[Spin, ...], several: bool) -> Iterator[tuple[str, list[str]]]:
    scales = _scales(result, shown, several)
    combined = _by_name(result, scales)
    for k, parameter in enumerate(result.spins[0].parameters):
        first = [combined.get(parameter.name, "")] if several else []
        yield parameter.name, [*first, *(_shown(spin.parameters[k], scales) for spin in shown)]
        if parameter.name == "accelerometer bias z":
            yield from _both_methods(shown, several, scales["m/s^2"])
    fit = [f"{spin.chi_square:.4g} for {spin.degrees_of_freedom}" for spin in shown]
    yield "chi-square", [*([_shown(result.agreement, scales)] if several else []), *fit]


def _both_methods(shown: tuple[Spin, ...], several: bool, scale: Scale) -> Iterator[tuple[str, list[str]]]:
    """Both accelerometer biases side by side: what differs is the tilt of the floor."""
    for method in ("level-free", "published"):
        for k, axis in enumerate("xyz"):
            biases = [spin.level_free if method == "level-free" else spin.published for spin in shown]
            cells = [scale.measurement(float(b.value[k]), float(b.sigma[k])) for b in biases]
            yield f"  {method} {axis}", [*([""] if several else []), *cells]


def _scales(result: SpinResult, shown: tuple[Spin, ...], several: bool) -> dict[str, Scale]:
    """Chooses one scale for each unit, for all spins."""
    found = [_readable(each) for spin in shown for each in spin.parameters if not _is_chi_square(each)]
    sizes = [(each.unit, max(abs(each.value), each.sigma)) for each in found if each.observable]
    biases = [bias for spin in shown for bias in (spin.level_free, spin.published)]
    sizes += [("m/s^2", float(size)) for bias in biases for size in bias.value]
    if several:
        sizes += [("m/s^2", float(size)) for size in result.accelerometer_bias.value]
        sizes += [("rad/s", float(size)) for size in result.gyroscope_bias.value]
    return scales_of([("m/s^2", 0.0), ("rad/s", 0.0), *sizes])


def _by_name(result: SpinResult, scales: Mapping[str, Scale]) -> dict[str, str]:
    return {
        f"{triad} bias {axis}": scales[unit].measurement(float(bias.value[k]), float(bias.sigma[k]))
        for triad, bias, unit in (
            ("accelerometer", result.accelerometer_bias, "m/s^2"),
            ("gyroscope", result.gyroscope_bias, "rad/s"),
        )
        for k, axis in enumerate("xyz")
    }


def _shown(parameter: Parameter, scales: Mapping[str, Scale]) -> str:
    if parameter.observable and _is_chi_square(parameter):
        low, high = significant(parameter.low), significant(parameter.high)
        return f"{significant(parameter.value)}, expected {low} to {high}"
    return parameter_cell(_readable(parameter), scales)


def _readable(parameter: Parameter) -> Parameter:
    return scale_error(parameter) if is_scale(parameter) else parameter


def _is_chi_square(parameter: Parameter) -> bool:
    return parameter.name.startswith("chi-square")


def _refused(result: SpinResult, most: int) -> Iterator[str]:
    """List what lies between the spins, the longest of it where it is much."""
    longest = sorted(result.refused, key=lambda each: each[0] - each[1])[:most]
    for start, end, why in sorted(longest):
        yield f"{start:.1f} to {end:.1f} s {why}"
    if len(result.refused) > most:
        yield f"{len(result.refused) - most} shorter segments; --json has all of them"


def _unobserved(result: SpinResult) -> Iterator[str]:
    """Name parameters that spins do not show, with the reason; what goes for several in one line."""
    for reason, names, labels in unobserved({spin.label: spin.parameters for spin in result.spins}):
        whose = "" if len(labels) == len(result.spins) else f"{', '.join(labels)}: "
        yield f"{whose}{', '.join(names)}: {reason}"


def _spin_content(spin: Spin) -> dict[str, Any]:
    return {
        "label": spin.label,
        "start": spin.start,
        "end": spin.end,
        "rests": [{"start": rest.start, "end": rest.end} for rest in spin.rests],
        "turned_clockwise": spin.turned_clockwise,
        "turned_counter_clockwise": spin.turned_counter_clockwise,
        "heading_span": spin.heading_span,
        "rate": spin.rate,
        "turning_time": spin.turning_time,
        "method": spin.method,
        "level_free": _bias_content(spin.level_free),
        "published": _bias_content(spin.published),
        "gyroscope_bias": _bias_content(spin.gyroscope_bias),
        "up": spin.up,
        "parameters": [_parameter_content(parameter) for parameter in spin.parameters],
        "slow_turn": _parameter_content(spin.slow_turn),
        "chi_square": spin.chi_square,
        "degrees_of_freedom": spin.degrees_of_freedom,
        "widening": spin.widening,
        "covariance": spin.covariance,
        "warnings": spin.warnings,
    }


def _bias_content(bias: BiasEstimate) -> dict[str, Any]:
    return {"value": bias.value, "sigma": bias.sigma, "observable": bias.observable, "reason": bias.reason}


def _parameter_content(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "unit": parameter.unit,
        "value": parameter.value,
        "sigma": parameter.sigma,
        "low": parameter.low,
        "high": parameter.high,
        "observable": parameter.observable,
        "reason": parameter.reason,
    }
