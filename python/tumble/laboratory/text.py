"""A result of the registry in words: lines and tables for the screen, plain data for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from tumble.foundation.plain import finite
from tumble.laboratory.history import Lot, UnitHistory
from tumble.laboratory.registry import Shown, stored_json
from tumble.report.numbers import NOT_OBSERVABLE, readable_scale, round_like

_NEARLY_ONE = 0.999
COVERAGE = 2.0
"""Factor k of expanded uncertainties, for about 95 %."""


def shown_lines(found: Shown) -> Iterator[str]:
    """Yield what a person wants to know of a result before its numbers."""
    unit, session, calibration = found.unit, found.session, found.calibration
    made = " ".join(str(unit[name]) for name in ("manufacturer", "model") if unit[name])
    yield f"Result {calibration['calibration']}"
    stated = {
        "unit": ", ".join(
            filter(None, [str(unit["name"]), f"serial {unit['serial']}" if unit["serial"] else "", made])
        ),
        "lot": unit["lot"],
        "owner": unit["owner"],
        "date": calibration["date"],
        "procedure": session["procedure"],
        "operator": session["operator"],
        "station": session["station"],
        "software": session["software"],
        "condition": calibration["condition"],
        "verdict": calibration["verdict"],
        "temperature": f"{calibration['temperature']:g} degC"
        if calibration["temperature"] is not None
        else "",
        "supersedes": calibration["supersedes"],
        "superseded by": ", ".join(found.superseded_by),
        "entry": calibration["entry"],
    }
    for name, value in stated.items():
        if value:
            yield f"  {name}: {value}"
    for log in found.recordings:
        yield f"  log of the {log['role']}: {log['file']}, sha256 {log['sha256']}"
    for decision in found.decisions:
        why = f": {decision['why']}" if decision["why"] else ""
        yield f"  decision by the {decision['rule']} rule: {decision['verdict']}{why}"


def shown_rows(found: Shown) -> Iterator[tuple[str, ...]]:
    """Print each parameter, with its expanded uncertainty and the part that the reference leaves."""
    for row in found.parameters:
        yield (str(row["name"]), *_cells(row))


def _cells(row: Any) -> tuple[str, str, str]:  # noqa: ANN401 - a row
    value, u, common = row["value"], row["u"], row["common"]
    if value is None:
        return NOT_OBSERVABLE, "", ""
    scale = readable_scale(row["unit"], value)
    if u is None:
        return scale.figure(value, 4), "not stated", ""
    if u <= 0.0:
        return scale.figure(value, 6), scale.quantity("0"), ""
    printed = scale.quantity(round_like(scale.factor * value, scale.factor * COVERAGE * u))
    expanded = scale.figure(COVERAGE * u, 2)
    return printed, expanded, "" if common is None else scale.figure(COVERAGE * common, 2)


def shown_content(found: Shown) -> dict[str, Any]:
    """Return a result as plain data."""
    session = dict(found.session) | {"options": stored_json(str(found.session["options"]), "options")}
    unit = dict(found.unit) | {"identities": stored_json(str(found.unit["identities"]), "identities")}
    content = {
        "result": found.calibration,
        "unit": unit,
        "session": session,
        "recordings": found.recordings,
        "parameters": found.parameters,
        "decisions": found.decisions,
        "superseded_by": found.superseded_by,
    }
    plain = finite(content)
    assert isinstance(plain, dict)
    return plain


DUE_COLUMNS = ("parameter", "last value", "limit", "within it now", "due")
DRIFT_COLUMNS = ("parameter", "calibrations", "last value", "drift a year, rms", "95 % interval")
LOT_COLUMNS = ("parameter", "units", "Cp", "Cpk", "repeatability", "reproducibility")


def due_sentence(history: UnitHistory) -> str:
    """Describe when a unit is due, and by which parameter."""
    first = min((each for each in history.parameters if each.due), key=lambda each: each.due, default=None)
    if first is not None:
        return f"Due on {first.due}, by {first.measured.name}."
    reasons = sorted({each.reason for each in history.parameters})
    return f"No due date: {'; '.join(reasons) or 'no parameter with an uncertainty is on record'}."


def due_rows(history: UnitHistory) -> Iterator[tuple[str, ...]]:
    """Print what `DUE_COLUMNS` name of each parameter that has a limit."""
    for each in history.parameters:
        if each.limit is None:
            continue
        measured = each.measured
        scale = readable_scale(measured.unit, measured.values[-1])
        yield (
            measured.name,
            scale.measurement(measured.values[-1], measured.u[-1]),
            f"± {scale.figure(each.limit)}",
            _share(each.probability),
            each.due or each.reason,
        )


def _share(probability: float | None) -> str:
    if probability is None:
        return "not known"
    return "more than 99.9 %" if probability > _NEARLY_ONE else f"{100.0 * probability:.1f} %"


def drift_rows(history: UnitHistory) -> Iterator[tuple[str, ...]]:
    """Print what `DRIFT_COLUMNS` name of each parameter."""
    for each in history.parameters:
        measured, walk = each.measured, each.walk
        value = readable_scale(measured.unit, measured.values[-1])
        head = (
            measured.name,
            str(len(measured.values)),
            value.measurement(measured.values[-1], measured.u[-1]),
        )
        if walk is None:
            yield (*head, "not known", "")
            continue
        scale = readable_scale(measured.unit, math.sqrt(walk.high))
        low, q, high = (scale.figure(math.sqrt(each), 2) for each in (walk.low, walk.q, walk.high))
        yield (*head, q, f"{low} to {high}")


def signal_sentences(history: UnitHistory) -> Iterator[str]:
    """Describe where a control chart shows that something changed."""
    for each in history.parameters:
        if each.chart is not None:
            for place, rule in each.chart.signals:
                yield f"{each.measured.name} on {each.measured.dates[place][:10]}: {rule}"


def lot_rows(lot: Lot) -> Iterator[tuple[str, ...]]:
    """Print what `LOT_COLUMNS` name of each parameter."""
    for name in dict.fromkeys([*lot.capabilities, *lot.precisions]):
        c, p = lot.capabilities.get(name), lot.precisions.get(name)
        yield (
            name,
            "" if c is None else str(c.units),
            "" if c is None else _with_ends(c.cp, c.cp_interval),
            "" if c is None else _with_ends(c.cpk, c.cpk_interval),
            "" if p is None else f"{p.repeatability:.2g}",
            "" if p is None else f"{p.reproducibility:.2g}",
        )


def _with_ends(value: float, ends: tuple[float, float]) -> str:
    return f"{value:.2f} ({ends[0]:.2f} to {ends[1]:.2f})"
