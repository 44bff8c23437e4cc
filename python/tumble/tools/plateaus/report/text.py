"""Common wording of page and screen on a calibration over temperature."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.report.numbers import NOT_OBSERVABLE, Scale, readable_scale, significant
from tumble.tools.plateaus.result import PlateausResult, PolynomialScore, TriadOverTemperature

COLUMNS = ("order", "change of bias", "hysteresis of bias", "change of scale")
"""Columns of the table with one row an axis."""
Rows = tuple[tuple[str, tuple[str, ...]], ...]


def sentences(result: PlateausResult) -> Iterator[str]:
    """Describes what was used, where the result holds, and how well it predicts."""
    low, high = result.range
    yield (
        f"one calibration over temperature from {len(result.plateaus)} sessions, {low:.1f} to {high:.1f} °C"
    )
    yield (
        f"M and b hold at {result.reference:.1f} °C; below {low:.1f} and above {high:.1f} °C bias and scale "
        "at that edge are held, as nothing shows how they go on"
    )
    for triad in result.triads:
        yield from _predicted(triad)


def _predicted(triad: TriadOverTemperature) -> Iterator[str]:
    """Describes how well inner plateaus are predicted from the others."""
    inner = [each for each in triad.predictions if not each.outside]
    if not inner:
        return
    bias, scale = (_rms([getattr(each, part) for each in inner]) for part in ("bias", "scale"))
    of_bias = readable_scale(triad.unit, bias).figure(bias, 2)
    if not np.isfinite(scale):
        yield f"{triad.triad}: the bias of a plateau that was left out is predicted within {of_bias}"
        return
    of_scale = readable_scale("1", scale).figure(scale, 2)
    yield (
        f"{triad.triad}: bias and scale of a plateau that was left out are predicted within {of_bias} and "
        f"{of_scale}"
    )


def _rms(values: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def constant_sentences(result: PlateausResult) -> Iterator[str]:
    """Describes what is held constant, and whether that is right."""
    for triad in result.triads:
        for each in triad.constancies:
            test = f"{each.chi_square:.1f}", f"{each.degrees_of_freedom}"
            if each.changes:
                yield f"{triad.triad} {each.group}: not modelled, though it {each.described}"
            else:
                yield f"{triad.triad} {each.group}: no change, chi-square {test[0]} for {test[1]}"


def axis_rows(result: PlateausResult) -> Rows:
    """Prints what `COLUMNS` name of each axis."""
    rows = []
    for triad in result.triads:
        change, spread = triad.change
        scales = _scale_of(triad)
        for axis, name in enumerate("xyz"):
            orders = [_order(triad.orders.get(f"{part} {name}", ())) for part in ("bias", "scale")]
            rows.append(
                (
                    f"{triad.triad} {name}",
                    (
                        f"bias {orders[0]}, scale {orders[1]}",
                        scales["bias"].measurement(float(change[3 + axis]), float(spread[3 + axis])),
                        _printed(scales["bias"], triad.hysteresis[axis], triad.hysteresis_sigma[axis]),
                        scales["scale"].measurement(float(change[axis]), float(spread[axis]))
                        if f"scale {name}" in triad.orders
                        else NOT_OBSERVABLE,
                    ),
                )
            )
    return tuple(rows)


def _order(scores: Sequence[PolynomialScore]) -> int:
    return next((each.order for each in scores if each.chosen), 0)


def _scale_of(triad: TriadOverTemperature) -> dict[str, Scale]:
    """Chooses the units of changes of bias and scale."""
    bias, scale = triad.swing
    return {
        "bias": readable_scale(triad.unit, float(bias.max())),
        "scale": readable_scale("1", float(scale.max())),
    }


def _printed(scale: Scale, value: float, sigma: float) -> str:
    return scale.measurement(float(value), float(sigma)) if np.isfinite(value) else NOT_OBSERVABLE


def parameter_rows(triad: TriadOverTemperature) -> Rows:
    """Prints every coefficient, the three axes side by side."""
    cells: dict[str, list[str]] = {}
    for row in triad.parameters():
        name = str(row["parameter"]).rpartition(" ")[0].replace("^2", "²").replace("^3", "³")
        value, sigma = float(str(row["value"])), float(str(row["sigma"]))
        scale = readable_scale(str(row["unit"]), max(abs(value), sigma))
        cells.setdefault(name, []).append(_printed(scale, value, sigma) if sigma > 0.0 else "none")
    return tuple((name, tuple(each)) for name, each in cells.items())


def score_rows(triad: TriadOverTemperature) -> Rows:
    """Prints the prediction error of each order; the chosen one is marked."""
    rows = []
    for name, scores in triad.orders.items():
        unit = triad.unit if name.startswith("bias") else "1"
        scale = readable_scale(unit, max(each.left for each in scores))
        printed = (f"{scale.figure(each.left)}{' ●' if each.chosen else ''}" for each in scores)
        rows.append((name, tuple(printed)))
    widest = max((len(cells) for _, cells in rows), default=0)
    return tuple((name, (*cells, *[""] * (widest - len(cells)))) for name, cells in rows)


def prediction_rows(triad: TriadOverTemperature) -> Rows:
    """Prints the largest error of each plateau that was left out, with its 1-sigma."""
    rows = []
    for each in triad.predictions:
        cells = []
        for values, sigma, unit in (
            (each.bias, each.bias_sigma, triad.unit),
            (each.scale, each.scale_sigma, "1"),
        ):
            if not np.isfinite(values).all():
                cells.append(NOT_OBSERVABLE)
                continue
            most = int(np.abs(values).argmax())
            scale = readable_scale(unit, abs(float(values[most])))
            cells.append(f"{'xyz'[most]} {scale.measurement(float(values[most]), float(sigma[most]))}")
        rows.append((f"{each.temperature:.1f} °C", tuple(cells)))
    return tuple(rows)


def method_lines(result: PlateausResult) -> tuple[tuple[str, str], ...]:
    """Lists how it was done."""
    chi_squares = ", ".join(
        f"{each.triad} {significant(each.chi_square)} for {each.degrees_of_freedom}" for each in result.triads
    )
    return (
        ("fit", "generalised least squares with the full covariance of each calibration"),
        ("order", "by plateaus left out in turn; no power is dropped that is beyond chance"),
        ("chi-square", chi_squares),
        ("held constant", "non-orthogonality and mounting, tested for change"),
        *((f"{each.temperature:.1f} °C", each.file or each.name) for each in result.plateaus),
        ("software", result.software),
    )
