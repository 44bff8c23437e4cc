"""A turntable batch as a table on screen, as rows for `summary.csv`, and as JSON for machines."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.calibration.document import Calibration
from tumble.files import FileKind
from tumble.plain import finite
from tumble.report.numbers import NOT_OBSERVABLE, measurement, readable_scale
from tumble.report.text import VERDICT_TITLES, count_of
from tumble.results import Parameter, TriadResult
from tumble.turntable.report.text import check_sentence, misfit_sentence, mounting_sentence
from tumble.turntable.result import TargetResult, TurntableResult

MOST_SHOWN = 40
"""With more targets than this, only those that need a look are shown."""
SUMMARY_KIND = FileKind("a summary of tumble turntable", re.compile(rb"\Atarget,"))
GROUPS = ("bias", "scale", "non-orthogonality", "mounting")
COLOURS = {
    "pass": "green",
    "fail": "red",
    "calibrated": "default",
    "model not met": "red",
    "not calibrated": "red",
}


def screen_summary(result: TurntableResult) -> RenderableType:
    """Say what a person wants to know at once: the reference, a row for each triad, why targets failed."""
    reference = result.reference
    mounting = "" if reference.mounting is None else "mounting-angle error "
    head = [f"Reference {reference.name}: {mounting}{mounting_sentence(reference)}"]
    if result.poses:
        worst = max(result.poses, key=lambda pose: pose.table_error_angle)
        angle = measurement(worst.table_error_angle, worst.table_error_sigma, "deg")
        head.append(f"Largest table error {angle}, at {worst.name}")
    lines = [Text(line) for line in head]
    notes = [Text(f"Warning: {warning}", "yellow") for warning in result.warnings]
    notes += [note for target in result.targets for note in _notes(target)]
    foot = Text("Of three axes the one furthest out, with its 1-sigma.", "dim")
    return Group(*lines, "", _table(result), foot, "", *notes, Text(_count(result)))


def csv_text(result: TurntableResult) -> str:
    """One row a target: verdict, why, every parameter with its sigma; what was not observable is empty."""
    rows = [{"target": target.name, **_row(target)} for target in result.targets]
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def json_content(result: TurntableResult, files: dict[str, str]) -> dict[str, Any]:
    """Give the batch without its recordings: what was found, and the files it was written to."""
    reference = result.reference
    mounting = reference.mounting
    content = {
        "software": result.software,
        "truth": result.truth,
        "gravity": {"value": result.gravity, "source": result.gravity_source},
        "options": result.options,
        "reference": {
            "name": reference.name,
            "serial": reference.serial,
            "calibration_hash": reference.calibration_hash,
            "missing_samples": reference.missing_samples,
            "bias": reference.bias,
            "bias_sigma": reference.bias_sigma,
            "mounting": mounting and {"rotation_vector": mounting.rotation_vector, "sigma": mounting.sigma},
            "mounting_reason": reference.mounting_reason,
        },
        "poses": [
            {"name": pose.name, "table_error_angle": pose.table_error_angle, "sigma": pose.table_error_sigma}
            for pose in result.poses
        ],
        "targets": [_target_content(target, result) for target in result.targets],
        "warnings": result.warnings,
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def reason(target: TargetResult) -> str:
    """Why a target failed or has no calibration; empty where neither is so."""
    broken = "; ".join(check_sentence(check) for check in target.checks if not check.passed)
    objections = "; ".join(filter(None, (misfit_sentence(target), broken)))
    return target.failure_reason or target.failure or objections


def _notes(target: TargetResult) -> Iterator[Text]:
    why = reason(target)
    if why:
        yield Text(f"{target.name}: {target.verdict}: {why}", "red")
    for warning in target.warnings:
        yield Text(f"{target.name}: {warning}", "yellow")


def _table(result: TurntableResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    table.add_column("", no_wrap=True)
    for title in ("bias", "scale error", "non-orthogonality", "mounting"):
        table.add_column(title, overflow="fold")
    many = len(result.targets) > MOST_SHOWN
    for target in result.targets:
        if many and target.verdict in ("pass", "calibrated"):
            continue
        table.add_row(Text(f"{target.name}: {VERDICT_TITLES[target.verdict]}", COLOURS[target.verdict]))
        for triad in (target.accelerometer, target.gyroscope):
            if triad is not None and not target.failure:
                table.add_row(f"  {triad.triad}", *(Text(_worst(triad, group)) for group in GROUPS))
    return table


def _count(result: TurntableResult) -> str:
    verdicts = Counter(target.verdict for target in result.targets)
    shown = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
    skipped = "; those that pass are in summary.csv only" if len(result.targets) > MOST_SHOWN else ""
    return f"{count_of('target', len(result.targets))}: {shown}{skipped}"


def _worst(triad: TriadResult, group: str) -> str:
    members = [parameter for parameter in triad.parameters if parameter.name.startswith(f"{group} ")]
    if not members or not all(parameter.observable for parameter in members):
        return NOT_OBSERVABLE
    ideal = 1.0 if group == "scale" else 0.0
    furthest = max(members, key=lambda parameter: abs(parameter.value - ideal))
    distance = furthest.value - ideal
    scale = readable_scale(furthest.unit, distance)
    axis = furthest.name.removeprefix(f"{group} ")
    figures = measurement(scale.factor * distance, scale.factor * furthest.sigma, scale.unit)
    return f"{axis} {figures.replace(' deg', '°')}"


def _row(target: TargetResult) -> dict[str, str]:
    row = {"serial": target.serial, "verdict": target.verdict, "reason": reason(target)}
    for triad in (target.accelerometer, target.gyroscope):
        if triad is not None and not target.failure:
            for parameter in triad.parameters:
                row |= _cells(f"{triad.triad} {parameter.name}", parameter)
    return row


def _cells(name: str, parameter: Parameter) -> dict[str, str]:
    unit = "" if parameter.unit == "1" else f" ({parameter.unit})"
    shown = parameter.observable and math.isfinite(parameter.sigma)
    value, sigma = (repr(float(parameter.value)), repr(float(parameter.sigma))) if shown else ("", "")
    return {f"{name}{unit}": value, f"sigma {name}{unit}": sigma}


def _target_content(target: TargetResult, result: TurntableResult) -> dict[str, Any]:
    calibration = None if target.failure else Calibration.from_target(target, result).content()
    checks = [
        {
            "parameter": check.parameter,
            "value": check.value,
            "limit": check.limit,
            "unit": check.unit,
            "passed": check.passed,
            "remark": check.remark,
        }
        for check in target.checks
    ]
    return {
        "name": target.name,
        "source": target.source,
        "serial": target.serial,
        "missing_samples": target.missing_samples,
        "verdict": target.verdict,
        "reason": reason(target),
        "warnings": target.warnings,
        "checks": checks,
        "calibration": calibration,
    }
