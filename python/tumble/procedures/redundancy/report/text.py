"""Wording of a replay: the summary, each event with its figures, and its remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from tumble.foundation.units import UNITS
from tumble.foundation.words import count_of, join
from tumble.procedures.redundancy.known_faults import COVERED, KnownFault
from tumble.procedures.redundancy.report.difference import QUANTITIES, SENSORS
from tumble.procedures.redundancy.report.timeline import number
from tumble.procedures.redundancy.result import (
    Figure,
    RedundancyEvent,
    RedundancyResult,
    SecondaryError,
    Sensor,
)
from tumble.procedures.redundancy.spans import disagreements
from tumble.report.numbers import NOT_OBSERVABLE, Scale, readable_scale, significant

_TELL_APART = (
    "Let the platform rest, or turn it about its horizontal axes: that may show which unit is wrong; two "
    "units alone cannot always tell."
)
"""Remedy where units contradict each other and the faulty one is unknown."""

_UNFIT = {
    "primary invalid": (
        "Calibrate the primary and give its calibration, or raise primary_accelerometer_threshold and "
        "primary_gyroscope_threshold."
    ),
    "primary unhealthy": "Look at the faults of the primary; nothing is calibrated against it until then.",
    "secondary unhealthy": "Look at the faults of this unit: calibration cannot correct them.",
    "disputed": _TELL_APART,
}
"""With such units no calibration begins, and one under way ends."""

_RECORD = "Remove the record and calibrate again."

REMEDIES: dict[str, dict[str, str]] = {
    "withheld": {
        **_UNFIT,
        COVERED: "Nothing: the calibration under way covers it.",
        "on command only": "Give the command evaluate, or set evaluate_every.",
    },
    "refused": {
        "unsolvable": "Check whether readings of the unit do not change; then move about more axes.",
        "too few pairs": "Collect for longer, or lower fewest_pairs; gaps in either log cost pairs.",
        "residual too large": "Check the clocks with tumble align, and that the unit is mounted rigidly.",
        "implausible bias": "Check the unit; if it has no fault, raise its largest bias.",
        "implausible scale": (
            "Check units and ranges of both logs; if they are right, raise largest_scale_error."
        ),
        "implausible misalignment": (
            "If it is mounted in another orientation, state sensor_from_primary; tumble align finds it."
        ),
        "implausible lever arm": "State the lever arm, or move more about every axis; tumble align finds it.",
        "drifting": "Let the unit warm up, and check that it is mounted rigidly.",
        "disagrees with rest": "Check the clocks with tumble align, and that the unit is mounted rigidly.",
        "not better": (
            "Nothing: the stored error is as good; the threshold is smaller than the unit's errors."
        ),
        "shared by siblings": "Look at the primary: other secondaries are from it as this one is.",
        "beyond support": (
            "Rest in other attitudes, so that gravity proves the primary along all axes, or calibrate the "
            "primary and give a new --store."
        ),
    },
    "abandoned": {
        **_UNFIT,
        "no motion": "Move the platform after it rested, or lower the motion thresholds.",
        "timed out": "Move for longer, or lower collect.",
        "time jumped": "Repair the time stamps: a jump of the clock ends a calibration.",
        "record replaced": "Nothing: the record that was loaded meanwhile is used.",
    },
    "record rejected": {
        "of another unit": "Give the store of this set, or state the identity of the unit.",
        "against another primary": "Give the store of this set, or calibrate again against this primary.",
        "not finite": _RECORD,
        "implausible": _RECORD,
        "corrupt": _RECORD,
    },
    "aiding left out": {
        "not finite": "Give nothing where there is none, and an infinite sigma of axes not measured.",
        "no sigma": "Give a sigma above zero of every axis that is measured.",
        "negative score": "Give innovations squared over their variance.",
        "no such unit": "Name a unit of the set.",
        "late": "Give it within a second, with the time of its measurement on the clock of the primary.",
        "early": "Give it with the time of its measurement on the clock of the primary.",
    },
    "unhealthy": {
        "late": "Look for gaps in its log, its cable and its bus.",
        "frozen": "Restart the unit; it repeats its readings.",
        "stuck": "Restart the unit; one of its axes repeats its reading.",
        "saturated": "Choose a larger range, or reduce the vibration.",
        "not finite": "Look at its driver and its log: its readings are not numbers.",
        "spikes": "Look at its bus and its power supply.",
        "out of family": "Look at the unit and how it is mounted: the others agree without it.",
        "noisy": "Look at how it is mounted, and at its power supply.",
        "isolated": "Look at the unit and how it is mounted: what it says contradicts itself.",
        "refuted": ("Check the axes and units of its log; if they are right, state sensor_from_primary."),
        "implausible at rest": "Look at the unit and the units of its log: no working one deviates as much.",
        "clock jumped": "Repair its time stamps.",
        "duplicated": "Look at its driver: each reading comes twice or more often, and others are missing.",
        "clock": "Stamp its samples with the clock of the others, or correct the rate of its own.",
        "lossy": "Look for gaps in its log, its cable and its bus.",
        "copy": "Check the wiring and the logs: the same sensor is given as two units.",
    },
}
"""Remedies, by event and reason."""

_EVENTS = {
    "rest began": "Rest began",
    "rest ended": "Rest ended",
    "evaluated": "Evaluated",
    "withheld": "Deviates, but not calibrated",
    "triggered": "Triggered",
    "motion began": "Motion began; pairs are collected",
    "fitted": "Fitted",
    "adopted": "Adopted",
    "refused": "Refused",
    "abandoned": "Calibration abandoned",
    "unhealthy": "Unhealthy",
    "healthy": "Healthy again",
    "disagree": "Disagree, and nobody knows which is wrong",
    "agree": "Agree again",
    "aiding left out": "What the aiding measurement said was left out",
    "aiding distrusted": "The aiding measurement contradicts all units, and decides nothing",
    "aiding trusted": "The aiding measurement fits again",
    "selected": "Selected as source",
    "restored": "Stored error restored",
    "record rejected": "Stored error rejected",
    "time jumped": "The common clock jumped",
    "all saturated": "All units are at the ends of their ranges",
}
"""Every event of docs/how-to/redundancy.md."""

STATE_SIGNS = {
    "healthy": "✓",
    "unhealthy": "✕",
    "disagree": "≠",
    "adopted": "●",
    "restored": "●",
    "refused": "○",
    "abandoned": "○",
    "withheld": "○",
    "record rejected": "○",
}
"""Events that report the state of a unit, and their signs."""

_SELECTED = {
    "start": "at the start",
    "primary failed": "because the primary failed",
    "source failed": "because the source before it failed",
    "primary proven": "because the primary has been healthy long enough",
    "command": "on command",
}
"""Why the source changed, where there is one."""


_UNITS_BY_REASON = {
    "late": "s",
    "frozen": "s",
    "clock jumped": "s",
    "clock": "s",
    "lossy": "",
    "too few pairs": "pairs",
    "implausible scale": "",
    "implausible misalignment": "rad",
    "implausible lever arm": "m",
}
"""Units of value and limit; of all other reasons they are those of the sensor."""

_GROUNDS = {
    "own step": "it stepped by what the two are apart",
    "rest": "at rest it left what it said in health",
    "own gyroscope": "gravity, carried by its own gyroscope, is not where it says",
    "aiding": "an aiding measurement contradicts it",
}
"""Grounds on which one of two units is found wrong, and what their figures are."""
_FIGURES_BY_GROUND = {
    "own step": "share of the difference",
    "rest": "log-likelihood ratio",
    "own gyroscope": "log-likelihood ratio",
    "aiding": "log-likelihood ratio",
}
"""Names of figures on grounds where these are plain numbers; elsewhere they are in units of the sensor."""

_MOST_REASONS = 5
"""Reasons listed at the top of the page."""
_OUTCOMES = {"refused": "Refused", "abandoned": "Abandoned", "withheld": "Not calibrated"}


def summary(result: RedundancyResult) -> list[str]:
    """Describes primary, secondaries and sources in a few sentences."""
    span = result.end - result.start
    sentences = [
        f"{result.primary} is the primary of {count_of('secondary unit', len(result.secondaries))}; "
        f"{significant(span, 4) if span > 0 else '0'} s were replayed."
    ]
    if not result.events:
        return [*sentences, "Nothing happened: the monitor found no rest, no fault and no source to select."]
    first = [*known_fault_sentences(result), *output_sentences(result)]
    return [*first, *sentences, _calibrated(result), *_not_calibrated(result), *_sources(result)]


def known_fault_sentences(result: RedundancyResult) -> list[str]:
    """Describes known faults that remained: repeated ones of a unit once, with the first time."""
    alike: dict[tuple[object, ...], list[KnownFault]] = {}
    for fault in result.known_faults:
        sensor = fault.cause.figures.get("sensor") if fault.cause else None
        alike.setdefault((fault.kind, fault.units, sensor), []).append(fault)
    return [_known_fault(result, faults) for faults in alike.values()]


def _known_fault(result: RedundancyResult, faults: Sequence[KnownFault]) -> str:
    first = faults[0]
    who, cause = " and ".join(first.units), first.cause
    details = event_details(cause) if cause is not None else ""
    when = _when(result, faults)
    match first.kind:
        case "no samples":
            return f"No unit said anything {when}, or the clock of all jumped: nothing is known of that time."
        case "no source":
            if not any(span.unit for span in result.selected):
                return "No unit was ever healthy enough to be the source."
            return f"No unit was healthy enough to be the source {when}."
        case "source unhealthy":
            return f"{who} was unhealthy and stayed the source {when}: {details}."
        case "source deviates":
            return f"{who} deviated at rest and stayed the source {when}: {details}."
        case "disagreement":
            return f"{who} disagree {when}, and nobody knows which is wrong: {details}. {_TELL_APART}"
        case "source not calibrated":
            return f"{who} was the source {when} without having been calibrated."
        case "refuted":
            return f"{who} cannot be calibrated {when}: {details}. {REMEDIES['unhealthy']['refuted']}"
        case "not calibrated":
            return f"{who} was not calibrated{f' ({cause.event}: {details})' if cause else ''}."


def _when(result: RedundancyResult, faults: Sequence[KnownFault]) -> str:
    first = faults[0]
    if len(faults) > 1:
        lasted = sum(fault.end - fault.start for fault in faults)
        return f"{len(faults)} times from {first.start:.2f} s on, {significant(lasted)} s in all"
    if first.end >= result.end:
        return f"since {first.start:.2f} s"
    return f"from {first.start:.2f} to {first.end:.2f} s"


def output_sentences(result: RedundancyResult) -> list[str]:
    """Describes failures of the source and takeovers; and the share of degraded output."""
    told = []
    faults = [event for event in reversed(result.events) if event.event == "unhealthy"]
    for before, after in pairwise(result.selected):
        if before.unit and after.unit and after.reason in ("primary failed", "source failed"):
            own = (each for each in faults if each.unit == before.unit and each.time <= after.start)
            cause = next(own, None)
            how = f"{event_details(cause)}, since {cause.time:.2f} s" if cause else "unhealthy"
            told.append(f"{before.unit}: {how}; {after.unit} took over at {after.start:.2f} s.")
    left = len(told) - _MOST_REASONS
    more = [f"{count_of('more failover', left)} below, under Events."] if left > 0 else []
    more += _unhealthy_at_the_end(result)
    if result.degraded > 0:
        share = significant(100 * result.degraded, 2)
        more.append(
            f"Of the output {share} % are degraded: its source was wrong, contradicted, or lacks an axis."
        )
    return [*told[:_MOST_REASONS], *more]


def _unhealthy_at_the_end(result: RedundancyResult) -> Iterator[str]:
    """Describes excluded secondaries that neither were the source nor are known faults."""
    told = {unit for fault in result.known_faults for unit in fault.units}
    told |= {span.unit for span in result.selected}
    for unit in result.secondaries:
        word, details = unit_state(result, unit)
        if word == "unhealthy" and unit not in told:
            yield f"{unit} does not count at the end: {details}."


def unit_state(result: RedundancyResult, unit: str) -> tuple[str, str]:
    """Event that reports the state of a unit at the end, its health before its errors, and its figures."""
    own = [event for event in result.events if event.unit == unit and event.figures.get("reason") != COVERED]
    health = next((event for event in reversed(own) if event.event in ("unhealthy", "healthy")), None)
    if health is not None and health.event == "unhealthy":
        return "unhealthy", f"{event_details(health)}, since {health.time:.2f} s"
    for dispute in disagreements(result.events, result.end):
        if dispute.is_open and unit in dispute.units:
            (other,) = set(dispute.units) - {unit}
            return "disagree", f"with {other}, since {dispute.start:.2f} s"
    stood = STATE_SIGNS.keys() - {"disagree"}
    last = next((event for event in reversed(own) if event.event in stood), None)
    if last is None:
        return "healthy", ""
    reason = str(last.figures.get("reason", ""))
    return last.event, f"{reason}, at {last.time:.2f} s" if reason else f"at {last.time:.2f} s"


def event_title(event: RedundancyEvent) -> str:
    """Names the event in a word or two."""
    if event.event == "selected" and event.figures.get("reason") == "none fit":
        return "No unit is healthy enough to be the source"
    return _EVENTS.get(event.event, event.event.capitalize())


def event_details(event: RedundancyEvent) -> str:
    """Describes the figures of an event."""
    figures = event.figures
    sensor = str(figures.get("sensor", ""))
    parts = [str(figures[key]) for key in ("sensor", "sensors", "channel") if key in figures]
    if event.event == "evaluated":
        sign = ">" if figures.get("exceeded") else "≤"
        shown = [quantity(abs(number(figures.get(key))), sensor) for key in ("deviation", "threshold")]
        parts.append(f"{figures.get('check', '')} {shown[0]} {sign} {shown[1]}")
    if "reason" in figures and event.event != "selected":
        parts.append(f"{figures['reason']}{_value_and_limit(event)}")
    elif event.event == "selected":
        reason = str(figures.get("reason", ""))
        parts.append("" if reason == "none fit" else _SELECTED.get(reason, reason))
    parts += _fit_figures(event)
    parts += _judged_figures(event)
    if "detail" in figures:
        parts.append(str(figures["detail"]))
    if "by" in figures:
        parts.append(f"by {_plain(number(figures['by']))} s")
    return ", ".join(part for part in parts if part)


def remedy(event: RedundancyEvent) -> str:
    """Describes the remedy for an event; empty where none is needed."""
    if event.event == "selected":
        return "Look at the faults of all units." if event.figures.get("reason") == "none fit" else ""
    if event.event == "disagree":
        return _TELL_APART
    if event.event == "aiding distrusted":
        return "Look at the aiding measurement, its sigma and its time: no unit fits what it says."
    if event.event == "time jumped":
        return REMEDIES["abandoned"]["time jumped"]
    if event.event == "all saturated":
        return REMEDIES["unhealthy"]["saturated"]
    reason = str(event.figures.get("reason", ""))
    return REMEDIES.get(event.event, {}).get(reason, "")


def deviation_of_threshold(event: RedundancyEvent, beside: Sequence[RedundancyEvent]) -> str:
    """Prints the deviation of an evaluation and its threshold, in a unit that suits all of `beside`."""
    unit = UNITS["gyroscope" if event.figures["sensor"] == "gyroscope" else "accelerometer"]
    scale = readable_scale(unit, max(abs(number(each.figures["threshold"])) for each in beside))
    found, limit = (abs(number(event.figures[name])) for name in ("deviation", "threshold"))
    return scale.quantity(f"{significant(scale.factor * found)} of {significant(scale.factor * limit)}")


def mark_text(event: RedundancyEvent) -> str:
    """Describes the event at a mark of the time line in a few words."""
    reason = str(event.figures.get("reason", ""))
    if event.event == "unhealthy":
        return reason
    return f"{event.event}: {reason}" if reason else event.event


def quantity(value: float, sensor: str, scales: Mapping[str, Scale] | None = None) -> str:
    """Prints a figure of a sensor in a unit of sensible size, or of these; `unknown` where there is none."""
    if not math.isfinite(value):
        return "unknown"
    unit = UNITS["gyroscope" if sensor.startswith(("gyroscope", "angular rate")) else "accelerometer"]
    scale = scales[unit] if scales else readable_scale(unit, value)
    return scale.figure(value)


def errors_of(result: RedundancyResult, unit: str) -> list[SecondaryError]:
    """Returns what is stored of a unit, accelerometer first."""
    return sorted(
        (error for error in result.errors if error.unit == unit),
        key=lambda error: SENSORS.index(error.sensor),
    )


def fit_sentence(error: SecondaryError) -> str:
    """Describes the source of an error and its residual on held-out pairs."""
    when = "stored before the replay" if error.adopted is None else f"adopted at {error.adopted:.2f} s"
    sentence = (
        f"Model: {error.fit_model}, {error.directions} of 3 directions, {count_of('pair', error.pairs)}, "
        f"calibration {error.sequence}, {when}."
    )
    if not math.isfinite(error.residual):
        return f"{sentence} Its residual was never measured."
    left = quantity(error.residual, error.sensor)
    if not math.isfinite(error.residual_before):
        return f"{sentence} Residual {left}; that before is unknown."
    return f"{sentence} Residual {quantity(error.residual_before, error.sensor)} → {left}."


def unobserved_sentences(result: RedundancyResult) -> list[str]:
    """Describes directions that the motion did not show."""
    return [
        f"{error.unit}, {error.sensor}: shown along {error.directions} of 3 directions only; along the "
        "others it is unchanged."
        for unit in result.secondaries
        for error in errors_of(result, unit)
        if error.directions < 3 and error.fit_model in ("affine", "affine and lever arm")
    ]


def silent_units(result: RedundancyResult) -> list[str]:
    """Names the units without samples in the whole replay."""
    spoke = {
        trace.name
        for trace in result.traces
        if np.isfinite(trace.specific_force).any() or np.isfinite(trace.angular_rate).any()
    }
    return [unit for unit in (result.primary, *result.secondaries) if unit not in spoke]


def _calibrated(result: RedundancyResult) -> str:
    adopted = {event.unit for event in result.events if event.event == "adopted"}
    if not adopted:
        triggered = any(event.event == "triggered" for event in result.events)
        evaluated = any(event.event == "evaluated" for event in result.events)
        if triggered:
            return "No calibration was adopted."
        return (
            "No secondary was calibrated: none deviated enough, or none could be calibrated."
            if evaluated
            else "No secondary was calibrated: the platform never rested long enough to evaluate one."
        )
    named = [unit for unit in result.secondaries if unit in adopted]
    left = [_residual_range(result, sensor, named) for sensor in SENSORS]
    ending = f", with {join([text for text in left if text])} left" if any(left) else ""
    return f"Calibrated: {_list_of(named)}{ending}."


def _residual_range(result: RedundancyResult, sensor: Sensor, units: Sequence[str]) -> str:
    residuals = [
        error.residual
        for error in result.errors
        if error.sensor == sensor and error.unit in units and math.isfinite(error.residual)
    ]
    if not residuals:
        return ""
    low, high = quantity(min(residuals), sensor), quantity(max(residuals), sensor)
    return f"{low if low == high else f'{low} to {high}'} of {QUANTITIES[sensor]}"


def _not_calibrated(result: RedundancyResult) -> Iterator[str]:
    """Describes triggered units that were not calibrated, by reason; each reason once."""
    why: dict[str, list[str]] = {}
    for event in result.events:
        if event.event in ("refused", "abandoned", "withheld"):
            reason = str(event.figures.get("reason", "no reason given"))
            units = why.setdefault(f"{_OUTCOMES[event.event]} ({reason})", [])
            if event.unit not in units and reason != COVERED:
                units.append(event.unit)
    told = [f"{reason}: {_list_of(units)}." for reason, units in why.items() if units]
    yield from told[:_MOST_REASONS]
    if len(told) > _MOST_REASONS:
        yield f"{count_of('further reason', len(told) - _MOST_REASONS)} below, under Events."
    for unit in silent_units(result):
        yield f"{unit} sent nothing."


def _sources(result: RedundancyResult) -> Iterator[str]:
    spans = result.selected
    if len(spans) == 1 and spans[0].unit:
        yield f"{spans[0].unit} was the source all the time."
    if len(spans) > 2:
        last = spans[-1].unit or "none"
        yield f"The source changed {len(spans) - 1} times in all; at the end it is {last}."


def _value_and_limit(event: RedundancyEvent) -> str:
    """Returns the value that broke its limit, in brackets; empty where there is none."""
    shown = value_and_limit(event)
    return f" ({shown})" if shown else ""


def value_and_limit(event: RedundancyEvent) -> str:
    """Returns the value that broke its limit, and the limit, each in its unit; empty where there is none."""
    value, limit = number(event.figures.get("value")), number(event.figures.get("limit"))
    if not math.isfinite(value):
        return ""
    name = _FIGURES_BY_GROUND.get(str(event.figures.get("ground")), "")
    shown = f"{name} {_with_unit(value, event)}".strip()
    shown += " apart" if "scale" in event.figures else ""
    return f"{shown} against {_with_unit(limit, event)}" if math.isfinite(limit) else shown


def _with_unit(value: float, event: RedundancyEvent) -> str:
    reason = str(event.figures.get("reason", ""))
    if reason in _UNITS_BY_REASON:
        return f"{_plain(value)} {_UNITS_BY_REASON[reason]}".strip()
    whose = event.figures.get("sensor", event.figures.get("channel"))
    if event.figures.get("ground") in _FIGURES_BY_GROUND:
        return _plain(value)
    return _plain(value) if whose is None else quantity(value, str(whose))


def _judged_figures(event: RedundancyEvent) -> Iterator[str]:
    """Describes the units that disagree or agree, the time scale, and the evidence."""
    figures = event.figures
    if "other" in figures:
        yield f"with {_named(figures['other'])}{_value_and_limit(event)}"
    if "ground" in figures:
        yield f"on the ground of {figures['ground']}: {_GROUNDS[str(figures['ground'])]}"
    if event.event == "aiding distrusted":
        yield f"mean square misfit with the unit that fits best, in sigmas{_value_and_limit(event)}"
    if "scale" in figures:
        yield f"over {_plain(number(figures['scale']))} s"
    if "agreeing" in figures:
        yield f"agreeing: {_named(figures['agreeing'])}"


def _named(units: Figure) -> str:
    return _list_of(units) if isinstance(units, tuple) else str(units)


def _fit_figures(event: RedundancyEvent) -> Iterator[str]:
    figures, sensor = event.figures, str(event.figures.get("sensor", ""))
    if "fit_model" in figures:
        yield f"{figures['fit_model']}, {figures.get('directions', '?')} of 3 directions"
    if "pairs" in figures:
        yield f"{figures['pairs']} pairs"
    if "residual" in figures:
        before, left = (quantity(number(figures.get(key)), sensor) for key in ("residual_before", "residual"))
        yield f"residual {before} → {left}"
    if "sequence" in figures:
        yield f"calibration {figures['sequence']}"


def _list_of(units: Sequence[str]) -> str:
    most = 8
    return join(units if len(units) <= most else [*units[:most], f"{len(units) - most} more"])


def _plain(value: float) -> str:
    text = significant(value)
    return "unknown" if text == NOT_OBSERVABLE else text
