"""Budgets and decision of a target on its page: shares as stacked bars, every source as a row of a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from markupsafe import Markup

from tumble.foundation.results import TriadName
from tumble.procedures.turntable.result import TargetResult
from tumble.report.canvas import Figure
from tumble.report.numbers import readable_scale, significant
from tumble.report.page import Picture
from tumble.report.panel import LABEL_SIZE, horizontal_axis
from tumble.report.svg import ALARM, GRID, INK, SOFT, UNUSED, X_AXIS, Y_AXIS, Z_AXIS, inline_svg

WIDTH, LEFT, RIGHT, ROW, BOTTOM = 5.6, 1.35, 0.12, 0.2, 0.42
"""Inches; a row for each parameter and each line of the key."""
_PAINTS = (
    (SOFT, ""),
    (X_AXIS, ""),
    (Y_AXIS, ""),
    (Z_AXIS, ""),
    (INK, ""),
    (UNUSED, "////"),
    (GRID, "xxxx"),
    (ALARM, "////"),
)
"""Colour and hatch of each source, in the order in which sources come."""
_LONG = 1e-3
"""Number below which zeros hide its digits."""
_BAR = 0.7
"""Height of a bar, in rows."""


@dataclass(frozen=True, slots=True)
class SourceRow:
    """One source as printed."""

    source: str
    type: str
    distribution: str
    uncertainty: str
    sensitivity: str
    contribution: str
    share: str
    freedom: str


@dataclass(frozen=True, slots=True)
class BudgetTable:
    """Budget of one parameter as printed."""

    parameter: str
    sentence: str
    rows: tuple[SourceRow, ...]


@dataclass(frozen=True, slots=True)
class BudgetSection:
    """Budgets of one triad."""

    name: str
    picture: Picture
    tables: tuple[BudgetTable, ...]


@dataclass(frozen=True, slots=True)
class DecisionRow:
    """Verdict on one parameter as printed."""

    parameter: str
    value: str
    uncertainty: str
    limit: str
    acceptance: str
    probability: str
    verdict: str


@dataclass(frozen=True, slots=True)
class DecisionSection:
    """Verdicts by the decision rule as printed."""

    rule: str
    rows: tuple[DecisionRow, ...]


def budget_sections(target: TargetResult) -> tuple[BudgetSection, ...]:
    """Prints the budgets of each triad; empty where there are none."""
    return tuple(
        BudgetSection(name, _picture(target, name), tuple(_tables(target, name)))
        for name, budgets in target.budgets.items()
        if budgets
    )


def decision_section(target: TargetResult) -> DecisionSection | None:
    """Prints the verdicts of a target; None where its limits state no decision rule."""
    decision = target.decision
    if decision is None:
        return None
    if decision.rule == "simple":
        rule = "Simple rule: a parameter within its limit passes; its uncertainty does not count."
    else:
        rule = (
            f"Guarded rule: the acceptance limit is the limit less {decision.guard:g} U. Between both a "
            "parameter passes conditionally; beyond the limit by less than that it fails conditionally "
            "(ILAC-G8:09)."
        )
    return DecisionSection(rule, tuple(_decision_rows(target)))


def _decision_rows(target: TargetResult) -> Iterator[DecisionRow]:
    for each in target.decision.parameters if target.decision is not None else ():
        scale = readable_scale(each.unit, each.limit)

        def printed(number: float | None, factor: float = scale.factor) -> str:
            return "not known" if number is None else significant(factor * number, 3)

        yield DecisionRow(
            parameter=f"{each.parameter}, {scale.unit}" if scale.unit else each.parameter,
            value=printed(each.value),
            uncertainty=printed(each.expanded_uncertainty),
            limit=printed(each.limit),
            acceptance=printed(each.acceptance_limit),
            probability=each.percent,
            verdict=each.verdict,
        )


def _tables(target: TargetResult, name: TriadName) -> Iterator[BudgetTable]:
    for budget in target.budgets[name]:
        scale = readable_scale(budget.unit, budget.combined_uncertainty)
        freedom = _freedom(budget.degrees_of_freedom)
        sentence = (
            f"u = {scale.figure(budget.combined_uncertainty)}, {freedom} effective degrees of freedom, "
            f"k = {significant(budget.coverage_factor, 3)}, U = {scale.figure(budget.expanded_uncertainty)}"
        )
        rows = tuple(
            SourceRow(
                source=each.source,
                type=each.type,
                distribution=each.distribution,
                uncertainty=readable_scale(each.unit, each.standard_uncertainty).figure(
                    each.standard_uncertainty
                ),
                sensitivity=_short(each.sensitivity),
                contribution=_short(scale.factor * each.contribution),
                share=_share(each.share),
                freedom=_freedom(each.degrees_of_freedom),
            )
            for each in budget.entries
        )
        title = f"{budget.parameter}, {scale.unit}" if scale.unit else budget.parameter
        yield BudgetTable(title, sentence, rows)


def _picture(target: TargetResult, name: TriadName) -> Picture:
    caption = "Shares of each source in the square of the combined uncertainty."
    return Picture(_figure(target, name), caption)


def _figure(target: TargetResult, name: TriadName) -> Markup:
    """Draws a stacked bar for each parameter, and what each colour stands for above them."""
    budgets = target.budgets[name]
    sources = list(dict.fromkeys(each.source for budget in budgets for each in budget.entries))
    figure = Figure(WIDTH, BOTTOM + ROW * (len(budgets) + len(sources)) + 0.1)
    width = WIDTH - LEFT - RIGHT
    panel = figure.add_axes((LEFT, BOTTOM, width, ROW * len(budgets)))
    panel.set_ylim(len(budgets), 0.0)
    horizontal_axis(panel, 0.0, 100.0, "share, %")
    key = figure.add_axes((LEFT, BOTTOM + ROW * len(budgets) + 0.06, width, ROW * len(sources)))
    key.set_xlim(0.0, 100.0)
    key.set_ylim(len(sources), 0.0)
    for k, source in enumerate(sources):
        colour, hatch = _PAINTS[k % len(_PAINTS)]
        key.bars([(0.0, 4.0)], k + 0.15, _BAR, colour, hatch, ink=INK)
        key.text(5.5, k + 0.5, source, va="center", size=LABEL_SIZE, color=INK)
    for row, budget in enumerate(budgets):
        start = 0.0
        for each in budget.entries:
            colour, hatch = _PAINTS[sources.index(each.source) % len(_PAINTS)]
            end = start + 100.0 * each.share
            title = f"{budget.parameter}: {each.source} {_share(each.share)}"
            panel.bars([(start, end)], row + 0.15, _BAR, colour, hatch, ink=INK, title=title)
            start = end
        panel.text(
            0.0,
            row + 0.5,
            budget.parameter,
            frames=("panel", "data"),
            shift=(-4, 0),
            ha="right",
            va="center",
            size=LABEL_SIZE,
            color=INK,
        )
    return inline_svg(figure, f"budget-{name}", f"Shares of sources in the uncertainty of the {name}")


def _short(number: float) -> str:
    """Prints three digits, with an exponent where zeros would hide them."""
    return f"{number:.2e}" if 0.0 < abs(number) < _LONG else significant(number, 3)


def _share(share: float) -> str:
    return "< 0.1 %" if 0.0 < share < 1e-3 else f"{significant(100.0 * share, 3)} %"


def _freedom(freedom: float | None) -> str:
    return "∞" if freedom is None else significant(freedom, 3)
