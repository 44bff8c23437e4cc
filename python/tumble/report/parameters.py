"""The tables of a triad: parameters with intervals and limits, matrices, noise. All as text to print."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
from markupsafe import Markup

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import NOT_SHOWN, LimitCheck, Parameter, TriadResult
from tumble.foundation.units import CalibratedTriad
from tumble.report.figures import largest
from tumble.report.groups import group_title, groups_of, shown_value
from tumble.report.limits import used_share
from tumble.report.numbers import (
    GIVEN,
    NOT_OBSERVABLE,
    Scale,
    exact,
    fixed,
    measurement,
    readable_scale,
    readable_unit,
    round_like,
    round_pair,
    significant,
)
from tumble.report.whisker import Ruler, whisker

NO_PICTURE = Markup()


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """One parameter as printed. `reason` is set, and all figures are empty, where it was not observable."""

    name: str
    value: str = ""
    sigma: str = ""
    inherited: str = ""
    """Sigma that the reference leaves on all its targets alike."""
    interval: str = ""
    limit: str = ""
    share: str = ""
    """Share of the limit."""
    kept: bool | None = None
    picture: Markup = NO_PICTURE
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ParameterGroup:
    """Three parameters of one kind, in one unit and on one ruler."""

    title: str
    unit: str
    low: str
    high: str
    rows: tuple[ParameterRow, ...]

    @property
    def observable(self) -> bool:
        """Returns whether any of them was observable."""
        return any(not row.reason for row in self.rows)

    @property
    def kind(self) -> str:
        """Whole words that the names of all its rows begin with; empty for a single one."""
        columns = zip(*(row.name.split()[:-1] for row in self.rows), strict=False)
        shared = takewhile(lambda words: len(set(words)) == 1, columns)
        return " ".join(words[0] for words in shared) if len(self.rows) > 1 else ""

    @property
    def common_reason(self) -> str:
        """Common reason why none of them was observable; empty where there are several."""
        reasons = {row.reason for row in self.rows}
        return reasons.pop() if len(reasons) == 1 else ""


@dataclass(frozen=True, slots=True)
class PrintedMatrix:
    """A matrix or vector as printed; `rows` is empty and `reason` set where it was not observable."""

    name: str
    meaning: str
    rows: tuple[tuple[str, ...], ...] = ()
    reason: str = ""


@dataclass(frozen=True, slots=True)
class NoiseRow:
    """Noise of three axes in one unit, in SI and as data sheets state it."""

    name: str
    unit: str
    values: tuple[str, ...]
    sheet_unit: str
    sheet_values: tuple[str, ...]


def parameter_groups(triad: TriadResult, checks: Sequence[LimitCheck]) -> tuple[ParameterGroup, ...]:
    """Prints the parameter table of a triad, held against the limits that name its parameters."""
    by_name = {check.parameter: check for check in checks}
    return tuple(
        printed_group(
            group_title(name), members, [by_name.get(f"{triad.triad} {member.name}") for member in members]
        )
        for name, members in groups_of(triad).items()
    )


def limited_groups(
    triad: CalibratedTriad, found: TriadResult | None, checks: Sequence[LimitCheck]
) -> tuple[ParameterGroup, ...]:
    """Prints what else of a triad has limits: noise and residuals, and all where it has no result."""
    estimated = {parameter.name for parameter in found.parameters} if found else set()
    groups: dict[str, list[LimitCheck]] = {}
    for check in checks:
        whose, _, name = check.parameter.partition(" ")
        if whose == triad and name not in estimated:
            groups.setdefault(name.rpartition(" ")[0], []).append(check)
    return tuple(_limited_group(name, members) for name, members in groups.items())


def matrices(triad: TriadResult) -> tuple[PrintedMatrix, ...]:
    """Prints M, b and the factors K, L, Q; M and b to the digits their sigma carries."""
    sigma = np.sqrt(np.diag(triad.covariance))
    sigma_M, sigma_b = sigma[:9].reshape(3, 3), sigma[9:].reshape(3, 1)
    unit = readable_unit(triad.unit)
    bias = PrintedMatrix("b", f"bias, {unit}", _rounded(triad.b.reshape(3, 1), sigma_b))
    if "matrix" not in triad.estimated or not np.all(np.isfinite(sigma_M)):
        return (PrintedMatrix("M", "sensor from case", reason=_why_no_matrix(triad)), bias)
    return (
        PrintedMatrix("M", "sensor from case", _rounded(triad.M, sigma_M)),
        bias,
        PrintedMatrix("K", "scale", _six_decimals(triad.K)),
        PrintedMatrix("L", "non-orthogonality", _six_decimals(triad.L)),
        PrintedMatrix("Q", "mounting, a rotation", _six_decimals(triad.Q)),
    )


def g_sensitivity(triad: TriadResult) -> PrintedMatrix | None:
    """Prints the sensitivity of the gyroscope to specific force; None where it was not asked for."""
    if triad.g_sensitivity is None:
        return None
    sigma = triad.g_sensitivity_sigma
    sigma = np.full((3, 3), np.nan) if sigma is None else sigma
    scale = readable_scale("rad/s per m/s^2", largest(triad.g_sensitivity))
    rows = _with_sigma(scale.factor * triad.g_sensitivity, scale.factor * sigma)
    return PrintedMatrix("G", f"sensitivity to specific force, {scale.unit}", rows)


def noise_rows(triad: TriadResult) -> tuple[NoiseRow, ...]:
    """Prints noise density and bias instability of the three axes."""
    if triad.triad == "accelerometer":
        sheet_density, sheet_bias = (
            Scale("µg/√Hz", 1e6 / STANDARD_GRAVITY),
            Scale("µg", 1e6 / STANDARD_GRAVITY),
        )
    else:
        sheet_density, sheet_bias = Scale("deg/s/√Hz", math.degrees(1)), Scale("deg/h", math.degrees(3600))
    density = readable_scale(f"{triad.unit}/sqrt(Hz)", largest(triad.noise_density))
    bias = readable_scale(triad.unit, largest(triad.bias_instability))
    return (
        _noise_row("noise density", triad.noise_density, density, sheet_density),
        _noise_row("bias instability", triad.bias_instability, bias, sheet_bias),
    )


def printed_group(
    title: str, members: Sequence[Parameter], checks: Sequence[LimitCheck | None]
) -> ParameterGroup:
    """Prints parameters of one kind and unit on a common ruler, each against its limit, if any."""
    seen = [member for member in members if member.observable]
    values = [abs(shown_value(member, member.value)) for member in seen]
    ends = [shown_value(member, end) for member in seen for end in (member.low, member.high)]
    limits = [check.limit for check in checks if check is not None]
    scale = readable_scale(members[0].unit, max(limits or values, default=0.0))
    ruler = Ruler.about_zero(scale.factor * number for number in (*ends, *limits))
    return ParameterGroup(
        title=title,
        unit=scale.unit,
        low=_tick(ruler.low),
        high=_tick(ruler.high),
        rows=tuple(_row(member, check, scale, ruler) for member, check in zip(members, checks, strict=True)),
    )


def _limited_group(name: str, checks: Sequence[LimitCheck]) -> ParameterGroup:
    limits = [check.limit for check in checks]
    values = [abs(check.value) for check in checks if math.isfinite(check.value)]
    scale = readable_scale(checks[0].unit, max(limits))
    ruler = Ruler.about_zero(scale.factor * number for number in (*values, *limits))
    rows = tuple(_limited_row(check, scale, ruler) for check in checks)
    return ParameterGroup(group_title(name), scale.unit, _tick(ruler.low), _tick(ruler.high), rows)


def _limited_row(check: LimitCheck, scale: Scale, ruler: Ruler) -> ParameterRow:
    name = check.parameter.partition(" ")[2]
    held = _held(name, check, scale)
    if not math.isfinite(check.value):
        return replace(held, reason=check.remark or NOT_SHOWN)
    value, limit = scale.factor * check.value, scale.factor * check.limit
    picture = whisker(ruler, value, value, value, limit, alarm=not check.passed)
    return replace(held, value=significant(value), picture=picture)


def _row(parameter: Parameter, check: LimitCheck | None, scale: Scale, ruler: Ruler) -> ParameterRow:
    held = _held(parameter.name, check, scale)
    if not parameter.observable:
        return replace(held, reason=parameter.reason or NOT_SHOWN)
    value, low, high = (
        scale.factor * shown_value(parameter, number)
        for number in (parameter.value, parameter.low, parameter.high)
    )
    sigma = scale.factor * parameter.sigma
    if not (math.isfinite(value) and math.isfinite(sigma)):
        return replace(held, reason=NOT_SHOWN)
    limit = None if check is None else scale.factor * check.limit
    picture = whisker(ruler, value, low, high, limit, alarm=held.kept is False)
    if sigma <= 0:
        return replace(held, value=exact(value), sigma=GIVEN, picture=picture)
    shown = round_pair(value, sigma)
    interval = f"{round_like(low, sigma)} to {round_like(high, sigma)}"
    of_reference = "" if parameter.inherited is None else significant(scale.factor * parameter.inherited, 2)
    return replace(
        held, value=shown[0], sigma=shown[1], inherited=of_reference, interval=interval, picture=picture
    )


def _held(name: str, check: LimitCheck | None, scale: Scale) -> ParameterRow:
    """Prints the limit of a row, and how much of it is used."""
    if check is None:
        return ParameterRow(name)
    share = used_share(check) if math.isfinite(check.value) else ""
    return ParameterRow(name, limit=f"± {exact(scale.factor * check.limit)}", share=share, kept=check.passed)


def _tick(number: float) -> str:
    return exact(number) if number <= 0 else f"+{exact(number)}"


def _rounded(values: FloatArray, sigma: FloatArray) -> tuple[tuple[str, ...], ...]:
    return tuple(
        tuple(round_like(float(v), float(s)) for v, s in zip(row, row_sigma, strict=True))
        for row, row_sigma in zip(values, sigma, strict=True)
    )


def _with_sigma(values: FloatArray, sigma: FloatArray) -> tuple[tuple[str, ...], ...]:
    return tuple(
        tuple(measurement(float(v), float(s)) for v, s in zip(row, row_sigma, strict=True))
        for row, row_sigma in zip(values, sigma, strict=True)
    )


def _six_decimals(values: FloatArray) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(fixed(float(value), 6) for value in row) for row in values)


def _why_no_matrix(triad: TriadResult) -> str:
    reasons = dict.fromkeys(p.reason for p in triad.parameters if not p.observable and p.reason)
    return "; ".join(reasons) or "the data do not show all of it"


def _noise_row(name: str, values: FloatArray, scale: Scale, sheet: Scale) -> NoiseRow:
    return NoiseRow(
        name=name,
        unit=scale.unit,
        values=tuple(_noise_text(scale.factor * float(value)) for value in values),
        sheet_unit=sheet.unit,
        sheet_values=tuple(_noise_text(sheet.factor * float(value)) for value in values),
    )


def _noise_text(value: float) -> str:
    if not math.isfinite(value):
        return NOT_OBSERVABLE
    return "none seen" if value == 0 else significant(value)
