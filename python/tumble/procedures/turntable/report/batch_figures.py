"""The figures of a batch: each parameter over all targets, and the error before and after calibration."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import LimitCheck
from tumble.foundation.words import count_of
from tumble.procedures.turntable.record import TargetRecord
from tumble.procedures.turntable.report.improvement import Improvement, improvement
from tumble.procedures.turntable.result import TurntableResult
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import CALIBRATED, FULL_WIDTH, HALF_WIDTH, UNCOMPENSATED
from tumble.report.groups import group_of, group_title, shown_number
from tumble.report.numbers import MINUS, exact, readable_scale
from tumble.report.panel import horizontal_axis, log_axis, row_labels, segments, short, span
from tumble.report.svg import ALARM, GRID, INK, REST, SOFT, X_AXIS, inline_svg

_FEW = 30
"""Largest number of targets that are drawn as dots; beyond, each is a thin line."""
_MOST_NAMES = 30
"""Largest number of targets with their names beside the error figure."""
_MOST_LABELLED = 3
_LONGEST_TARGET = 24
"""Letters of a target's name for which the error figure has room."""
_MOST_LINES = 1000
"""Largest number of lines; more cannot be distinguished, so that beyond it only every n-th target has one."""
_FINEST = 2000
"""Shares of a panel's width below which two thin lines are one."""


@dataclass(frozen=True, slots=True)
class Strip:
    """One parameter over the targets that showed it."""

    name: str
    values: FloatArray
    """(n,) in the unit of the group."""
    names: tuple[str, ...]
    """(n,) targets."""
    outside: FloatArray
    """(n,) booleans: limit not kept."""
    limit: float | None


@dataclass(frozen=True, slots=True)
class StripGroup:
    """Three parameters of one kind over all targets."""

    triad: str
    title: str
    unit: str
    strips: tuple[Strip, ...]


def strip_groups(records: Iterable[TargetRecord]) -> list[StripGroup]:
    """Gathers each kind of parameter over the targets, accelerometer first."""
    gathering = StripGathering()
    for record in records:
        gathering.add(record)
    return gathering.groups()


class StripGathering:
    """Collects the parameters of one target after the other, and keeps nothing else of them."""

    def __init__(self) -> None:
        self._columns: dict[str, _Column] = {}

    def add(self, record: TargetRecord) -> None:
        """Adds the parameters of one target."""
        checks = {check.parameter: check for check in record.checks}
        for parameter in record.parameters:
            column = self._columns.setdefault(parameter.name, _Column(parameter.unit))
            if parameter.value is not None:
                column.add(record.target, parameter.name, parameter.value, checks.get(parameter.name))

    def groups(self) -> list[StripGroup]:
        """Returns each kind that any target showed."""
        kinds: dict[tuple[str, str], list[str]] = {}
        for name in self._columns:
            triad, _, rest = name.partition(" ")
            kinds.setdefault((triad, group_of(rest)), []).append(name)
        order = sorted(kinds, key=lambda kind: kind[0] != "accelerometer")
        groups = [self._group(triad, kind, kinds[triad, kind]) for triad, kind in order]
        return [group for group in groups if any(strip.values.size for strip in group.strips)]

    def _group(self, triad: str, kind: str, names: Sequence[str]) -> StripGroup:
        columns = [self._columns[name] for name in names]
        largest = max((abs(value) for column in columns for value in column.values), default=0.0)
        scale = readable_scale(columns[0].unit, largest)
        strips = tuple(
            column.strip(name.partition(" ")[2], scale.factor)
            for name, column in zip(names, columns, strict=True)
        )
        return StripGroup(triad, group_title(kind), scale.unit, strips)


class _Column:
    """One parameter over the targets that showed it."""

    def __init__(self, unit: str) -> None:
        self.unit = unit
        self.values = array("d")
        self._names: list[str] = []
        self._outside = bytearray()
        self._limit: float | None = None

    def add(self, target: str, name: str, value: float, check: LimitCheck | None) -> None:
        self.values.append(shown_number(group_of(name), value))
        self._names.append(target)
        self._outside.append(check is not None and not check.passed)
        if check is not None:
            self._limit = check.limit if self._limit is None else min(self._limit, check.limit)

    def strip(self, name: str, factor: float) -> Strip:
        return Strip(
            name=name,
            values=factor * np.array(self.values),
            names=tuple(self._names),
            outside=np.array(self._outside, dtype=float),
            limit=None if self._limit is None else factor * self._limit,
        )


def distribution_figure(group: StripGroup, prefix: str) -> Markup:
    """Draws one row a parameter, one mark a target, limits upright, the worst outside them named."""
    rows = len(group.strips)
    figure = Figure(HALF_WIDTH, 0.62 + 0.46 * rows)
    axes = figure.add_axes((0.55, 0.46, HALF_WIDTH - 0.75, 0.46 * rows))
    limits = [end for strip in group.strips if strip.limit is not None for end in (-strip.limit, strip.limit)]
    values = [strip.values for strip in group.strips]
    low, high = span(*values, at_least=_visible_limits(limits, values), margin=0.06)
    title = f"{group.title}, {group.unit}" if group.unit else group.title
    horizontal_axis(axes, low, high, title, most=7, zero=SOFT)
    axes.set_ylim(rows - 0.5, -0.5)
    row_labels(axes, [strip.name.rpartition(" ")[2] for strip in group.strips])
    for row, strip in enumerate(group.strips):
        _draw_strip(axes, row, strip)
    beyond = limits_off_scale(group, high)
    if beyond:
        axes.text(1, 1, beyond, frames=("panel", "panel"), shift=(0, 3), ha="right", size=7.5, color=ALARM)
    counts = f"{max(strip.values.size for strip in group.strips)} targets"
    return inline_svg(
        figure, prefix, f"Distribution of {group.triad} {group.title} over {counts}, in {group.unit}"
    )


def limits_off_scale(group: StripGroup, reach: float) -> str:
    """Describes limits beyond `reach`, the end of the scale, which are not visible; empty for none."""
    found: dict[str, list[str]] = {}
    for strip in group.strips:
        if strip.limit is not None and strip.limit > reach:
            found.setdefault(exact(strip.limit), []).append(strip.name.rpartition(" ")[2])
    named = (f"± {limit} ({', '.join(axes)})" for limit, axes in found.items())
    return f"limits off scale: {', '.join(named)}" if found else ""


def improvement_figure(pairs: Sequence[tuple[str, Improvement]], prefix: str) -> Markup | None:
    """Draws the error of |specific force| at rest of each target, before and after; None if there is none."""
    if not pairs:
        return None
    named = len(pairs) <= _MOST_NAMES
    height = 0.22 * len(pairs) + 0.3 if named else 4.5
    left = 1.5 if named else 0.3
    figure = Figure(FULL_WIDTH, height + 0.6)
    axes = figure.add_axes((left, 0.5, FULL_WIDTH - left - 0.2, height))
    draw_improvement(axes, pairs, named=named)
    label = (
        f"Error of |specific force| at rest of {count_of('target', len(pairs))}, before and after calibration"
    )
    return inline_svg(figure, prefix, label)


def improvements(result: TurntableResult) -> list[tuple[str, Improvement]]:
    """Returns the targets whose error at rest is known before and after, by name, the best first."""
    found = ((target.name, improvement(target, result.gravity)) for target in result.targets)
    return best_first([(name, gain) for name, gain in found if gain is not None])


def best_first(pairs: Sequence[tuple[str, Improvement]]) -> list[tuple[str, Improvement]]:
    """Sorts by what is left of the error, without those of which a logarithm cannot be drawn."""
    drawn = [(name, gain) for name, gain in pairs if min(gain.before, gain.after) > 0]
    return sorted(drawn, key=lambda pair: pair[1].after)


def draw_improvement(axes: Axes, pairs: Sequence[tuple[str, Improvement]], *, named: bool) -> None:
    """Draws a line a target from its error after calibration to its error before, on a logarithmic scale."""
    before = 1e3 * np.array([gain.before for _, gain in pairs])
    after = 1e3 * np.array([gain.after for _, gain in pairs])
    rows = np.arange(len(pairs), dtype=float)
    stride = max(1, -(-len(pairs) // _MOST_LINES))
    log_axis(
        axes, float(after.min()), float(before.max()), f"rms of |specific force| {MINUS} g at rest, mm/s²"
    )
    axes.set_ylim(len(pairs) - 0.4, -0.6)
    before, after, rows = np.log10(before[::stride]), np.log10(after[::stride]), rows[::stride]
    segments(axes, after, rows, before, rows, SOFT, 0.9 if named else 0.3)
    size = 5.0 if named else 2.0
    axes.points(before, rows, UNCOMPENSATED, "o", size, hollow=True, edge=1.1)
    axes.points(after, rows, CALIBRATED, "o", size)
    if named:
        row_labels(axes, [short(name, _LONGEST_TARGET) for name, _ in pairs])


def _visible_limits(limits: Sequence[float], values: Sequence[FloatArray]) -> list[float]:
    """Zero, and the limits unless they lie so far out that they would squeeze the marks together."""
    largest = max((float(np.abs(array).max()) for array in values if array.size), default=0.0)
    return [0.0, *(limit for limit in limits if abs(limit) <= 6 * largest)]


def _draw_strip(axes: Axes, row: int, strip: Strip) -> None:
    axes.line(axes.get_xlim(), [row, row], GRID, 0.8, order=0.0)
    if strip.values.size > _FEW:
        first, middle, last = np.percentile(strip.values, [25, 50, 75])
        axes.bars([(first, last)], row - 0.32, 0.64, REST, order=0.5)
        _upright(axes, np.array([middle]), row, 0.34, INK, 1.4)
    if strip.limit is not None:
        _upright(axes, np.array([-strip.limit, strip.limit]), row, 0.46, ALARM, 1.2)
    outside = strip.outside > 0
    _draw_targets(axes, strip.values[~outside], row, X_AXIS, few=strip.values.size <= _FEW)
    _draw_targets(axes, strip.values[outside], row, ALARM, few=strip.values.size <= _FEW)
    _name_outside(axes, row, strip)


def _draw_targets(axes: Axes, values: FloatArray, row: int, colour: str, *, few: bool) -> None:
    if few:
        axes.points(values, np.full_like(values, row), colour, "o", 4.5, edge=0.0, opacity=0.8)
    else:
        low, high = axes.get_xlim()
        step = (high - low) / _FINEST
        _upright(axes, np.unique(np.round(values / step)) * step, row, 0.2, colour, 0.5)


def _upright(axes: Axes, places: FloatArray, row: int, half: float, colour: str, width: float) -> None:
    middle = np.full_like(places, row)
    segments(axes, places, middle - half, places, middle + half, colour, width)


def _name_outside(axes: Axes, row: int, strip: Strip) -> None:
    outermost = np.argsort(-np.abs(strip.values))
    named = [index for index in outermost if strip.outside[index]][:_MOST_LABELLED]
    for index in named:
        axes.text(
            strip.values[index], row, strip.names[index], shift=(0, 6), ha="center", size=6.5, color=ALARM
        )
