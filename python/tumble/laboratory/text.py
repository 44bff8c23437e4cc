"""A result of the registry in words: lines and tables for the screen, plain data for JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from tumble.foundation.plain import finite
from tumble.laboratory.registry import Shown
from tumble.report.numbers import NOT_OBSERVABLE, readable_scale, round_like

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
    session = dict(found.session) | {"options": json.loads(str(found.session["options"]))}
    unit = dict(found.unit) | {"identities": json.loads(str(found.unit["identities"]))}
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
