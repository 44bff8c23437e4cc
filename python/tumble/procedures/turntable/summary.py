"""A turntable batch as a table on screen, as rows for `summary.csv`, and as JSON for machines."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.calibration.decision import in_percent
from tumble.foundation.files import FileKind, replacing
from tumble.foundation.gravity import gravity_content
from tumble.foundation.plain import finite
from tumble.foundation.results import GROUPS
from tumble.foundation.units import CALIBRATED_TRIADS
from tumble.foundation.words import count_of, defused, utf8
from tumble.procedures.turntable.record import RecordedParameter, TargetRecord
from tumble.procedures.turntable.report.text import gravity_sentence, mounting_sentence, uncertainty_sentence
from tumble.procedures.turntable.result import GOOD, TurntableResult
from tumble.report.groups import group_title
from tumble.report.numbers import NOT_OBSERVABLE, Scale, headed, measurement, scales_of
from tumble.report.text import VERDICT_TITLES

if TYPE_CHECKING:
    from tumble.procedures.turntable.command_run import TurntableRun

SCHEMA: Final = "tumble-turntable-result/1"

MOST_SHOWN = 40
"""With more targets than this, only those that need a look are shown, and of these as many."""
MOST_NAMED = 3
"""Targets that a warning they share names."""
SUMMARY_KIND = FileKind("a summary of tumble turntable", re.compile(rb"\Atarget,serial,verdict,reason,"))
COLOURS = {
    "pass": "green",
    "conditional pass": "yellow",
    "conditional fail": "red",
    "fail": "red",
    "calibrated": "default",
    "model not met": "red",
    "not calibrated": "red",
}
_OWN = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?(: [XYZ] (up|down))?")
"""Parts of a warning that differ between targets: numbers, and poses behind them."""


@dataclass(slots=True)
class SharedWarning:
    """A warning, and which targets have it, whatever its numbers are for each."""

    text: str
    """Text for the first target."""
    alike: bool = True
    """Indicates whether it is identical for all."""
    times: int = 0
    """Number of reports: more than one for a target that has it at several poses."""
    targets: int = 0
    latest: str = ""
    """The target that it was reported of last."""
    names: list[str] = field(default_factory=list)

    def say_of(self, target: str, text: str, most_named: int | None) -> None:
        """Adds a warning of a target; targets come one after another."""
        self.alike = self.alike and self.text == text
        self.times += 1
        if self.targets and self.latest == target:
            return
        self.targets, self.latest = self.targets + 1, target
        if most_named is None or len(self.names) <= most_named:
            self.names.append(target)


class ScreenSummary:
    """Summary of a run on screen; takes targets one by one, and keeps what is shown."""

    def __init__(self, batch: TurntableResult, expected: int, *, everything: bool = False) -> None:
        self._batch = batch
        self._everything = everything
        self._many = expected > MOST_SHOWN and not everything
        self._shown: list[TargetRecord] = []
        self._hidden_failures = 0
        self._warnings: dict[str, SharedWarning] = {}
        self.verdicts: Counter[str] = Counter()
        self.failed = 0
        """Targets that have no calibration, or are not known to be within their limits."""

    def add(self, record: TargetRecord) -> None:
        """Adds a target of the run."""
        self.verdicts[record.verdict] += 1
        self.failed += record.fails
        failed = record.verdict not in GOOD
        if not self._many or (failed and len(self._shown) < MOST_SHOWN):
            self._shown.append(record)
        elif failed:
            self._hidden_failures += 1
        for warning in record.warnings:
            shared = self._warnings.setdefault(_OWN.sub("#", warning), SharedWarning(warning))
            shared.say_of(record.target, warning, None if self._everything else MOST_NAMED)

    def counts(self) -> str:
        """Describes the number of targets with each verdict."""
        shown = ", ".join(f"{count} {verdict}" for verdict, count in self.verdicts.items())
        return f"{count_of('target', self.verdicts.total())}: {shown}"

    def failures(self) -> Iterator[str]:
        """Describes each shown target that failed or has no calibration in a line."""
        for record in self._shown:
            if record.reason:
                yield f"{record.target}: {record.verdict}: {record.reason}"
        if self._hidden_failures:
            yield f"{self._hidden_failures} more failed; see summary.csv"

    def rendered(self) -> RenderableType:
        """Returns the reference, a row for each triad, why targets failed, and what is odd about them."""
        head: list[RenderableType] = [Text(line) for line in self._head()]
        notes = [Text(f"Warning: {warning}", "yellow") for warning in self._batch.warnings]
        notes += [Text(line, "red") for line in self.failures()]
        notes += [Text(line, "yellow") for line in self.warnings()]
        skipped = "; those that pass are in summary.csv only" if self._many else ""
        foot = Text("Of three axes the one furthest out, with its 1-sigma.", "dim")
        chances = [Text(line, "dim") for line in _chances(self._shown)]
        table: list[RenderableType] = [_table(self._shown), foot, *chances, ""] if self._shown else []
        return Group(*head, "", *table, *notes, Text(self.counts() + skipped))

    def warnings(self) -> Iterator[str]:
        """Give each warning once, with how many targets share it."""
        total = self.verdicts.total()
        for shared in self._warnings.values():
            again = shared.times - shared.targets
            more = f", and {again} more like it" if again else ""
            if shared.targets == 1:
                yield f"{shared.names[0]}: {shared.text}{more}"
                continue
            few = shared.targets <= MOST_NAMED or self._everything
            names = f" ({', '.join(shared.names)})" if few and shared.targets < total else ""
            example = "" if shared.alike else f"such as {shared.names[0]}: "
            yield f"{shared.targets} of {total}{names}: {example}{shared.text}{more}"

    def _head(self) -> Iterator[str]:
        reference = self._batch.reference
        mounting = "" if reference.mounting is None else "mounting-angle error "
        yield f"Reference {reference.name}: {mounting}{mounting_sentence(reference)}"
        yield uncertainty_sentence(self._batch)
        yield f"Gravity: {gravity_sentence(self._batch)}"
        if self._batch.poses:
            worst = max(self._batch.poses, key=lambda pose: pose.table_error_angle)
            angle = measurement(worst.table_error_angle, worst.table_error_sigma, "deg")
            yield f"Largest table error {angle}, at {worst.name}"


def write_summary(path: Path, records: Callable[[], Iterable[TargetRecord]]) -> None:
    """Writes one row a target: verdict, why, every parameter with its sigma; unobservable ones are empty.

    `records` are gone through twice, to know all columns first, and not kept.
    """
    columns = list(dict.fromkeys(key for record in records() for key in _row(record)))
    with replacing(path, SUMMARY_KIND, renews=True) as file:
        text = _Utf8(file.write)
        writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
        writer.writerow({column: defused(column) for column in columns})
        for record in records():
            writer.writerow({column: defused(cell) for column, cell in _row(record).items()})


@dataclass(frozen=True, slots=True)
class _Utf8:
    """Takes text for a file of bytes; text that UTF-8 cannot represent is written escaped."""

    put: Callable[[bytes], object]

    def write(self, text: str) -> None:
        self.put(utf8(text))


def screen_summary(run: TurntableRun) -> RenderableType:
    """Returns the main results."""
    return run.screen.rendered()


def json_content(run: TurntableRun, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give the batch without its recordings: what was found, and the files it was written to."""
    batch = run.shared
    reference = batch.reference
    mounting = reference.mounting
    content = {
        "software": batch.software,
        "truth": batch.truth,
        "gravity": gravity_content(batch),
        "options": batch.options,
        "limits": batch.limits,
        "reference": {
            "name": reference.name,
            "serial": reference.serial,
            "calibration_hash": reference.calibration_hash,
            "sha256": reference.log.sha256,
            "missing_samples": reference.missing_samples,
            "bias": reference.bias,
            "bias_sigma": reference.bias_sigma,
            "mounting": mounting and {"rotation_vector": mounting.rotation_vector, "sigma": mounting.sigma},
            "mounting_reason": reference.mounting_reason,
            "uncertainty": asdict(reference.uncertainty),
            "certificate": reference.certificate and reference.certificate.content(),
        },
        "poses": [
            {"name": pose.name, "table_error_angle": pose.table_error_angle, "sigma": pose.table_error_sigma}
            for pose in batch.poses
        ],
        "targets": list(run.targets()),
        "warnings": batch.warnings,
        "files": {**run.calibrations(), **files},
    }
    return {key: finite(value) for key, value in content.items()}


def target_content(record: TargetRecord, calibration: dict[str, Any] | None) -> dict[str, Any]:
    """Returns one target as JSON has it; `calibration` is the content of its file, where this run made it."""
    return {
        "name": record.target,
        "source": record.source,
        "serial": record.serial,
        "attempt": record.attempt,
        "date": record.date,
        "operator": record.operator,
        "station": record.station,
        "sha256": record.log_sha256,
        "duration": record.duration,
        "missing_samples": record.missing_samples,
        "verdict": record.verdict,
        "reason": record.reason,
        "warnings": record.warnings,
        "checks": record.checks,
        "probability": record.probability,
        "calibration": calibration,
        "calibration_sha256": record.calibration_sha256,
    }


def _table(records: Sequence[TargetRecord]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    table.add_column("", no_wrap=True)
    columns = {group: _column(records, group) for group in GROUPS}
    for group, scales in columns.items():
        table.add_column(headed(group_title(group), scales)[0], overflow="fold")
    for record in records:
        table.add_row(Text(f"{record.target}: {VERDICT_TITLES[record.verdict]}", COLOURS[record.verdict]))
        for triad in dict.fromkeys(each.name.partition(" ")[0] for each in record.parameters):
            cells = (_cell(record, triad, group, scales) for group, scales in columns.items())
            table.add_row(f"  {triad}", *map(Text, cells))
    return table


def _chances(records: Sequence[TargetRecord]) -> Iterator[str]:
    """Gives the probability of conformity of each target, in one line; none without a decision rule."""
    known = [record for record in records if record.probability is not None]
    said = ", ".join(f"{record.target} {in_percent(record.probability)}" for record in known)
    if said:
        yield f"Probability of conformity of the least sure parameter: {said}."


def _column(records: Sequence[TargetRecord], group: str) -> dict[str, Scale]:
    """Chooses the units that a group is shown in, of all targets."""
    found = (
        _worst(record.parameters, f"{triad} {group} ") for record in records for triad in CALIBRATED_TRIADS
    )
    return scales_of((each.unit, each.distance) for each in found if each is not None)


def _cell(record: TargetRecord, triad: str, group: str, scales: Mapping[str, Scale]) -> str:
    worst = _worst(record.parameters, f"{triad} {group} ")
    if worst is None:
        return NOT_OBSERVABLE
    scale = scales[worst.unit]
    printed = scale.number if headed(group, scales)[1] else scale.measurement
    return f"{worst.axis} {printed(worst.distance, worst.sigma)}"


@dataclass(frozen=True, slots=True)
class _Furthest:
    """Axis of a group that is furthest from the ideal, and how far."""

    axis: str
    distance: float
    sigma: float
    unit: str


def _worst(parameters: Sequence[RecordedParameter], group: str) -> _Furthest | None:
    found = [each for each in parameters if each.name.startswith(group)]
    ideal = 1.0 if group.endswith(" scale ") else 0.0
    members = [
        (abs(each.value - ideal), each.value - ideal, each.sigma, each)
        for each in found
        if each.value is not None and each.sigma is not None
    ]
    if not members or len(members) < len(found):
        return None
    _, distance, sigma, furthest = max(members, key=lambda member: member[0])
    return _Furthest(furthest.name.removeprefix(group), distance, sigma, furthest.unit)


def _row(record: TargetRecord) -> dict[str, str]:
    low, mean, high = record.temperature or (None, None, None)
    row = {
        "target": record.target,
        "serial": record.serial,
        "verdict": record.verdict,
        "reason": record.reason,
        **({} if record.probability is None else {"probability of conformity": _number(record.probability)}),
        "attempt": str(record.attempt),
        "date": record.date,
        "operator": record.operator,
        "station": record.station,
    }
    row |= record.columns
    row |= {
        "log": record.source,
        "log sha256": record.log_sha256,
        "duration (s)": _number(record.duration or None),
        "samples missing": str(record.missing_samples),
        "temperature (degC)": _number(mean),
        "lowest temperature (degC)": _number(low),
        "highest temperature (degC)": _number(high),
        "reference": record.reference,
        "reference serial": record.reference_serial,
        "reference log sha256": record.reference_sha256,
        "reference calibration sha256": record.reference_calibration,
        "calibration file sha256": record.calibration_sha256,
        "software": record.software,
    }
    for parameter in record.parameters:
        unit = "" if parameter.unit == "1" else f" ({parameter.unit})"
        row[f"{parameter.name}{unit}"] = _number(parameter.value)
        row[f"sigma {parameter.name}{unit}"] = _number(parameter.sigma)
        if parameter.inherited is not None:
            row[f"sigma in common {parameter.name}{unit}"] = _number(parameter.inherited)
    return row


def _number(value: float | None) -> str:
    return "" if value is None else repr(float(value))
