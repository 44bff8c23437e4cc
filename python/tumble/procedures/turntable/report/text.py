"""Sentences of the pages: verdicts, goodness of fit, unobservable parameters, method."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tumble.foundation import gravity
from tumble.foundation.results import LARGEST_WIDENING, NOT_SHOWN, LimitCheck, Parameter, TriadResult
from tumble.foundation.units import TRIADS
from tumble.foundation.words import count_of, join
from tumble.procedures.turntable.result import (
    ClockFit,
    CommandedRates,
    ReferenceResult,
    TargetResult,
    TruthSource,
    TurntableResult,
    UncertaintySources,
)
from tumble.report.groups import groups_of
from tumble.report.limits import limit_share, used_share
from tumble.report.numbers import exact, measurement, readable_scale, significant

TRUTHS: dict[TruthSource, str] = {
    "reference": "what the reference measured at the same rest, less its bias",
    "rotate-truth": "the ideal poses, turned by the mounting angle of the reference",
    "rotate-measurement": "the ideal poses, after the readings were turned back by the mounting angle "
    "(the published formula)",
    "table": "of angular rate the rates that the table was commanded, about the axis that the reference "
    "measured; of specific force what the reference measured at the same rest, less its bias",
    "ideal": "the ideal poses, the mounting angle ignored",
}

_MOST_NAMED = 3


def verdict_sentence(target: TargetResult) -> str:
    """Describes the reason for the verdict."""
    match target.verdict:
        case "not calibrated":
            return target.failure_reason or target.failure
        case "model not met":
            return "The " + misfit_sentence(target) + "."
        case "calibrated":
            return "No limits were given, so there is no verdict."
        case "pass":
            return f"{_kept(len(target.checks))} The closest is {closest_sentence(target.checks)}."
        case "conditional pass" | "conditional fail":
            return _conditional(target)
        case _:
            return _exceeded(target.checks)


def reason(target: TargetResult) -> str:
    """Reason why a target failed or has no calibration; empty where neither is so."""
    broken = "; ".join(check_sentence(check) for check in target.checks if not check.passed)
    if target.decision is not None and target.verdict == "conditional fail":
        broken = "; ".join(target.decision.not_passed())
    objections = "; ".join(filter(None, (misfit_sentence(target), broken)))
    return target.failure_reason or target.failure or objections


def misfit_sentence(target: TargetResult) -> str:
    """Describes the residuals that the model does not explain; empty where it explains all."""
    found = [
        f"{triad.triad} residuals are {significant(triad.widening, 2)} times what the noise explains, which "
        "no sigma covers: the unit, its fixture or the reference did something that the model does not hold"
        for triad in target.misfits
        if triad.widening > LARGEST_WIDENING
    ]
    objections = [each for triad in target.misfits for each in triad.objections]
    return "; ".join([*found, *dict.fromkeys(objections)])


def closest_sentence(checks: Sequence[LimitCheck]) -> str:
    """Names the parameter that uses most of its limit, and how much of it."""
    check = worst(checks)
    return f"{check.parameter}, at {used_share(check)} of its limit" if check else "not known"


def worst(checks: Sequence[LimitCheck]) -> LimitCheck | None:
    """Finds the check that uses most of its limit; one whose value is not known comes before all others."""
    return max(checks, key=limit_share, default=None)


def check_sentence(check: LimitCheck) -> str:
    """Prints `accelerometer bias x is 0.412 m/s², its limit 0.300 m/s²`, or why that is not known."""
    if not math.isfinite(check.value):
        return f"{check.parameter} was {check.remark or 'not shown to be within its limit'}"
    value, limit = value_and_limit(check)
    return f"{check.parameter} is {value}, its limit {limit}" + (f" ({check.remark})" if check.remark else "")


def value_and_limit(check: LimitCheck) -> tuple[str, str]:
    """Prints both, in one unit that suits the limit."""
    scale = readable_scale(check.unit, check.limit or check.value)
    value, limit = scale.factor * check.value, scale.factor * check.limit
    return scale.quantity(significant(value)), scale.quantity(exact(limit))


def chi_square_sentence(triad: TriadResult) -> str:
    """Describes chi-square, its degrees of freedom and its p value."""
    freedom = triad.degrees_of_freedom
    if freedom <= 0 or not math.isfinite(triad.chi_square):
        return (
            "As many parameters as measurements: the residuals are always zero, "
            "so they do not test the fit. Add rests in further directions."
        )
    p = triad.p_value
    figures = (
        f"Chi-square {significant(triad.chi_square)} for {freedom} degrees of freedom, p {_probability(p)}: "
    )
    return figures + _meaning_of_p(p)


def fit_in_brief(triad: TriadResult) -> str:
    """Describes the goodness of fit in two or three words."""
    if triad.degrees_of_freedom <= 0 or not math.isfinite(triad.chi_square):
        return "cannot be tested"
    p = triad.p_value
    if p < 0.001:
        return "worse than the noise"
    if p < 0.05:
        return "barely within the noise"
    return "noise overstated" if p > 0.999 else "within the noise"


def unobserved_sentences(target: TargetResult) -> list[str]:
    """Describes all unobservable values of this target, each with its reason; no numbers."""
    sentences: list[str] = []
    for triad in target.triads:
        sentences += _unobserved_by_triad(triad)
    if target.failure:
        return sentences
    for name, found in (("accelerometer", target.accelerometer), ("gyroscope", target.gyroscope)):
        if found is None:
            sentences.append(f"The {name} was not calibrated.")
    return sentences


def clock_sentence(clock: ClockFit | None) -> str:
    """Describes the alignment of the clocks of reference and target."""
    if clock is None:
        return "The clocks were not compared."
    if clock.shared:
        return "Reference and target were stamped by one clock: offset and skew are zero by construction."
    offset = _scaled(clock.offset, clock.offset_sigma, "s")
    skew = measurement(clock.skew, clock.skew_sigma, "ppm")
    turns = count_of("turn", clock.turns)
    return (
        f"Each had its own clock. Target minus reference: offset {offset}, skew {skew}, found from {turns}."
    )


def mounting_sentence(reference: ReferenceResult) -> str:
    """Describes the mounting angle of the reference with its sigma, or why there is none."""
    if reference.mounting is None:
        return f"The mounting angle was not estimated: {reference.mounting_reason}."
    pairs = zip("xyz", reference.mounting.rotation_vector, reference.mounting.sigma, strict=True)
    return ", ".join(f"{axis} {measurement(float(v), float(s), 'deg')}" for axis, v, s in pairs)


def uncertainty_sentence(result: TurntableResult) -> str:
    """Describes the source of the uncertainty of the truth, and values relative to the reference."""
    of_reference = _of_reference(result.reference.uncertainty, by_table=result.commanded is not None)
    return " ".join(filter(None, (_of_table(result.commanded), of_reference)))


def _of_table(commanded: CommandedRates | None) -> str:
    if commanded is None:
        return ""
    origin = "assumed; see --rate-accuracy" if commanded.assumed else "given"
    rates = join([f"{rate:g}" for rate in commanded.rates])
    return (
        f"Truth of gyroscopes: the table at {rates} deg/s, accurate to {commanded.accuracy:g} ppm "
        f"({origin}), within the sigmas of scale."
    )


def _of_reference(sources: UncertaintySources, *, by_table: bool) -> str:
    relative = sources.relative
    stated = {name: getattr(sources, name) for name in TRIADS if name not in relative}
    by = {source: [name for name in stated if stated[name] == source] for source in stated.values()}
    parts = [f"of its {join(names)} by its {source}" for source, names in by.items()]
    said = f"Uncertainty of the reference: stated {'; '.join(parts)}, and within all sigmas." if parts else ""
    if not relative:
        return said
    scaled = [name for name in relative if not (by_table and name == "gyroscope")]
    parts_relative = [f"scale and non-orthogonality of the {join(scaled)}"] if scaled else []
    if len(scaled) < len(relative):
        parts_relative.append("non-orthogonality of the gyroscope")
    subject = join(parts_relative)
    unstated = (
        f"{subject[0].upper()}{subject[1:]} are relative to the reference, whose "
        "uncertainty is not stated (--reference-calibration with a covariance, or --reference-grade)."
    )
    return f"{said} {unstated}".strip()


def gravity_sentence(result: TurntableResult) -> str:
    """Describes the gravity used and its source."""
    return gravity.gravity_sentence(result, "the scale of accelerometers")


def _kept(count: int) -> str:
    return "The one limit is met." if count == 1 else f"All {count} limits are met."


def _conditional(target: TargetResult) -> str:
    """Describes the parameters in the guard band."""
    named = [] if target.decision is None else list(target.decision.not_passed())
    rest = len(named) - _MOST_NAMED
    more = f"; and {rest} more" if rest > 0 else ""
    return f"By the guarded rule: {'; '.join(named[:_MOST_NAMED])}{more}."


def _exceeded(checks: Sequence[LimitCheck]) -> str:
    broken = sorted((check for check in checks if not check.passed), key=limit_share, reverse=True)
    named = "; ".join(check_sentence(check) for check in broken[:_MOST_NAMED])
    rest = len(broken) - _MOST_NAMED
    more = f"; and {rest} more" if rest > 0 else ""
    return f"{len(broken)} of {len(checks)} limits failed: {named}{more}."


def _probability(p: float) -> str:
    if p < 0.001:
        return "below 0.001"
    return f"above {0.999 if p > 0.999 else 0.99}" if p > 0.99 else significant(p, 2)


def _meaning_of_p(p: float) -> str:
    if p < 0.001:
        return (
            "the residuals are larger than the noise explains. The model lacks something, "
            "such as a unit that moved or a table that did not settle; the intervals are too narrow."
        )
    if p < 0.05:
        return (
            f"residuals this large come by chance in about {significant(100 * p, 2)} of 100 sessions. "
            "Look at the residuals before trusting the intervals."
        )
    if p > 0.999:
        return (
            "the residuals are smaller than the noise explains. The noise was assumed larger than it "
            "is, so the intervals are too wide."
        )
    return "the model and the noise explain what was measured."


def _unobserved_by_triad(triad: TriadResult) -> list[str]:
    name = triad.triad.capitalize()
    sentences = [f"{name}: {direction}." for direction in triad.unobservable]
    by_reason: dict[str, list[Parameter]] = {}
    for parameter in triad.parameters:
        if not parameter.observable:
            by_reason.setdefault(parameter.reason or NOT_SHOWN, []).append(parameter)
    return sentences + [
        f"{name} {join(_in_groups(triad, hidden))}: {why}." for why, hidden in by_reason.items()
    ]


def _in_groups(triad: TriadResult, hidden: Sequence[Parameter]) -> list[str]:
    """Names of the parameters; of a group that is hidden as a whole, only the group's."""
    names: dict[str, None] = {}
    for group, members in groups_of(triad).items():
        found = [member.name for member in members if member in hidden]
        names |= dict.fromkeys([group] if len(found) == len(members) else found)
    return list(names)


def _scaled(value: float, sigma: float, unit: str) -> str:
    scale = readable_scale(unit, value)
    return measurement(scale.factor * value, scale.factor * sigma, scale.unit)
