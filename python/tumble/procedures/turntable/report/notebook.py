"""A turntable session in a notebook: what `_repr_html_` of its results shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.foundation.results import TriadResult
from tumble.foundation.words import count_of
from tumble.procedures.turntable.report import text
from tumble.procedures.turntable.report.improvement import IMPROVEMENT_TITLE, improvement
from tumble.procedures.turntable.result import TargetResult, TurntableResult
from tumble.report.notebook import figures, paragraphs, row
from tumble.report.parameters import parameter_groups
from tumble.report.text import VERDICT_TITLES


def target_html(target: TargetResult) -> str:
    """Prints one target: its verdict, what was not shown, and its parameters with sigma."""
    caption = Markup("<caption><b>{}</b> {}: {}</caption>").format(
        target.name, VERDICT_TITLES[target.verdict], text.verdict_sentence(target)
    )
    rows = [row for triad in target.triads for row in _triad_rows(triad)]
    head = row("th", ("", "parameter", "value", "± sigma", "unit")) if rows else Markup()
    notes = paragraphs(text.unobserved_sentences(target))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)


def batch_html(result: TurntableResult) -> str:
    """Prints a batch: one line a target, worst parameter and error at rest before and after."""
    count = count_of("target", len(result.targets))
    caption = Markup("<caption>{} against <b>{}</b></caption>").format(count, result.reference.name)
    head = row("th", ("target", "verdict", "why", IMPROVEMENT_TITLE))
    rows = Markup().join(_target_row(target, result.gravity) for target in result.targets)
    return Markup("<table>{}{}{}</table>").format(caption, head, rows)


def _triad_rows(triad: TriadResult) -> list[Markup]:
    return [
        row("td", (triad.triad, printed.name, *figures(printed, group.unit)))
        for group in parameter_groups(triad, ())
        for printed in group.rows
    ]


def _target_row(target: TargetResult, gravity: float) -> Markup:
    gain = improvement(target, gravity)
    verdict, why = VERDICT_TITLES[target.verdict], text.verdict_sentence(target)
    return row("td", (target.name, verdict, why, gain.numbers() if gain else "not known"))
