"""Compact tables for notebooks: what `_repr_html_` of a result shows. Draws nothing, so it is quick."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup, escape

from tumble.report import redundancy_words, spin_words, words
from tumble.report.improvement import improvement
from tumble.report.parameters import ParameterRow, parameter_groups
from tumble.report.redundancy_parameters import error_groups
from tumble.report.spin_parameters import spin_groups
from tumble.results import TargetResult, TriadResult, TurntableResult
from tumble.results_redundancy import RedundancyResult
from tumble.results_spin import SpinResult


def target_html(target: TargetResult) -> str:
    """Print one target: its verdict, what was not shown, and its parameters with sigma."""
    caption = Markup("<caption><b>{}</b> {}: {}</caption>").format(
        target.name, words.VERDICT_TITLES[target.verdict], words.verdict_sentence(target)
    )
    rows = [row for triad in (target.accelerometer, target.gyroscope) if triad for row in _triad_rows(triad)]
    head = _row("th", ("", "parameter", "value", "± sigma", "unit")) if rows else Markup()
    notes = _paragraphs(words.unobserved_sentences(target))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)


def batch_html(result: TurntableResult) -> str:
    """Print a batch: one line a target, worst parameter and error at rest before and after."""
    count = words.count_of("target", len(result.targets))
    caption = Markup("<caption>{} against <b>{}</b></caption>").format(count, result.reference.name)
    head = _row("th", ("target", "verdict", "why", "error at rest, before → after"))
    rows = Markup().join(_target_row(target, result.gravity) for target in result.targets)
    return Markup("<table>{}{}{}</table>").format(caption, head, rows)


def spin_html(result: SpinResult) -> str:
    """Print the biases that the spins agree on, and every parameter of each spin with sigma."""
    _, title = spin_words.verdict(result)
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, title)
    biases = (
        spin_words.bias_sentence("Accelerometer bias", "m/s^2", result.accelerometer_bias),
        spin_words.bias_sentence("Gyroscope bias", "rad/s", result.gyroscope_bias),
    )
    head = _row("th", ("", "parameter", "value", "± sigma", "unit"))
    rows = [
        _row("td", (spin.label, row.name, *_figures(row, group.unit)))
        for spin in result.spins
        for group in spin_groups(spin)
        for row in group.rows
    ]
    notes = (*biases, *spin_words.trust_sentences(result), *spin_words.unobserved_sentences(result))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), _paragraphs(notes))


def redundancy_html(result: RedundancyResult) -> str:
    """Print what happened in a replay, and every parameter of each error found with sigma."""
    caption = Markup("<caption><b>{}</b></caption>").format(result.primary)
    head = _row("th", ("", "", "parameter", "value", "± sigma", "unit")) if result.errors else Markup()
    rows = [
        _row("td", (error.unit, error.sensor, row.name, *_figures(row, group.unit)))
        for unit in result.secondaries
        for error in redundancy_words.errors_of(result, unit)
        for group in error_groups(error)
        for row in group.rows
    ]
    notes = (*redundancy_words.summary(result), *redundancy_words.unobserved_sentences(result))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), _paragraphs(notes))


def _triad_rows(triad: TriadResult) -> list[Markup]:
    return [
        _row("td", (triad.triad, row.name, *_figures(row, group.unit)))
        for group in parameter_groups(triad, ())
        for row in group.rows
    ]


def _figures(row: ParameterRow, unit: str) -> tuple[str, str, str]:
    return ("not observable", "", "") if row.reason else (row.value, row.sigma, unit)


def _target_row(target: TargetResult, gravity: float) -> Markup:
    gain = improvement(target, gravity)
    verdict, why = words.VERDICT_TITLES[target.verdict], words.verdict_sentence(target)
    return _row("td", (target.name, verdict, why, gain.text() if gain else "not known"))


def _paragraphs(sentences: Iterable[str]) -> Markup:
    return Markup().join(Markup("<p>{}</p>").format(sentence) for sentence in sentences)


def _row(tag: str, cells: tuple[str, ...]) -> Markup:
    opening, closing = Markup(f"<{tag}>"), Markup(f"</{tag}>")
    return Markup("<tr>{}</tr>").format(Markup().join(opening + escape(cell) + closing for cell in cells))
