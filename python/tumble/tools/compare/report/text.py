"""Common wording of page, screen and notebook on two calibrations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from tumble.foundation.results import GROUPS
from tumble.foundation.words import count_of
from tumble.report.groups import shown_number
from tumble.report.numbers import (
    Scale,
    fixed,
    measurement,
    readable_scale,
    round_like,
    scales_of,
    significant,
)
from tumble.tools.compare.result import (
    LEVEL,
    CompareResult,
    Difference,
    History,
    JointTest,
    MotionError,
    Pair,
)

PARAMETER_COLUMNS = ("first", "second", "difference ± sigma", "sigmas")
TEST_COLUMNS = ("chi-square", "degrees of freedom", "probability")
MOTION_COLUMNS = ("motion", "error, rms", "by uncertainty alone")
HISTORY_COLUMNS = ("a year", "sigmas", "calibrations")
FAR = 3.0
"""Sigmas from which on a parameter counts as different by itself."""
MATTERS = 2.0
"""Error over what uncertainty makes from which on it is more."""
_RAREST = 1e-12
"""Probability below which its digits mean nothing."""


def verdict_sentence(pair: Pair) -> str:
    """Describes whether two calibrations are the same, and the basis of that."""
    if pair.identical:
        return f"{pair.name} are the same number by number"
    if pair.verdict == "cannot be told":
        return f"whether {pair.name} are the same cannot be told: {_why_not(pair)}"
    found = [f"a probability of {probability(pair.probability)}"]
    if pair.joint is not None:
        found.insert(0, f"chi-square {figure(pair.joint.statistic)} for {pair.joint.degrees_of_freedom}")
    if pair.verdict == "same":
        return f"{pair.name} are the same within what is known: {', '.join(found)}"
    most = pair.farthest
    farthest = f"; most in {most.name}, {printed_difference(most)}" if most is not None else ""
    return f"{pair.name} differ: {', '.join(found)}{farthest}"


def differs_sentence(pair: Pair) -> str:
    """Describes the differences in size, before any test."""
    if pair.verdict != "differ":
        return f"{verdict_sentence(pair)}."
    apart = [each for each in pair.differences if each.compared and abs(each.sigmas) > FAR]
    most = pair.farthest
    head = f"{pair.name} differ"
    if most is None or not apart:
        return (
            f"{head}: no parameter by itself, but all together ({probability(pair.probability)} by chance)."
        )
    compared = sum(each.compared for each in pair.differences)
    return (
        f"{head} in {len(apart)} of {count_of('parameter', compared)} by more than {FAR:g} sigmas, most in "
        f"{most.name}: {printed_difference(most)}."
    )


def matters_sentences(pair: Pair) -> Iterator[str]:
    """Describes the effect of using one calibration in place of the other, and whether it is large."""
    for each in pair.motion:
        where = f"{each.triad}, {each.motion}"
        done = f"Used in place of {pair.first}, {pair.second} has an error of {error(each)} rms ({where})"
        if not isfinite(each.expected):
            yield f"{done}."
            continue
        much = "more than" if each.rms > MATTERS * each.expected else "no more than"
        yield f"{done}: {much} the {by_chance(each)} that the uncertainties alone make."


def _why_not(pair: Pair) -> str:
    reasons = {each.reason for each in pair.differences}
    if not reasons:
        return "they have no triad in common"
    return reasons.pop() if len(reasons) == 1 else "nothing that both hold is known with an uncertainty"


def sentences(pair: Pair) -> Iterator[str]:
    """Describes a difference in motion, and its largest parts."""
    for each in pair.motion:
        beside = f", where the uncertainties alone make {expected}" if (expected := by_chance(each)) else ""
        yield f"{each.triad}: {error(each)} rms on {each.motion}{beside}"
    if _only_biases(pair):
        yield (
            "only biases differ: scale and angles agree, as they do where a sensor was switched off and on, "
            "or warmed, in between"
        )


def _only_biases(pair: Pair) -> bool:
    differing = {test.name.split(" ")[-1] for test in pair.groups if test.probability < LEVEL}
    others = {test.name for test in pair.groups if not test.name.endswith(GROUPS[0])}
    return pair.verdict == "differ" and differing == {GROUPS[0]} and bool(others)


def hidden(pair: Pair) -> Iterator[str]:
    """Describes parameters that were not compared, with the reasons."""
    reasons: dict[str, list[Difference]] = {}
    for each in pair.differences:
        if not each.compared:
            reasons.setdefault(each.reason, []).append(each)
    for reason, rows in reasons.items():
        groups = list(dict.fromkeys(row.group for row in rows))
        yield f"{', '.join(groups)}: {reason} ({count_of('parameter', len(rows))})"


def parameter_rows(pair: Pair) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Prints what `PARAMETER_COLUMNS` name of each parameter, all of a kind in one unit."""
    for group in dict.fromkeys(each.group for each in pair.differences):
        members = [each for each in pair.differences if each.group == group]
        scale = scale_of(*members)
        yield from ((each.name, _parameter_cells(each, scale)) for each in members)


def _parameter_cells(each: Difference, scale: Scale) -> tuple[str, ...]:
    """Prints a parameter; a scale as what it differs from one by."""
    shown = [scale.quantity(_value(each, number, scale)) for number in (each.first, each.second)]
    sigmas = fixed(each.sigmas, 1) if each.compared else each.reason
    return (*shown, printed_difference(each, scale), sigmas)


def scale_of(*members: Difference) -> Scale:
    """Chooses the unit that parameters of a kind are shown in."""
    known = [shown_number(each.group, number) for each in members for number in (each.first, each.second)]
    largest = max([abs(number) for number in known if isfinite(number)], default=0.0)
    return readable_scale(members[0].unit, largest)


def _value(each: Difference, number: float, scale: Scale) -> str:
    shown = scale.factor * shown_number(each.group, number)
    return round_like(shown, scale.factor * each.sigma) if each.compared else significant(shown, 4)


def printed_difference(each: Difference, scale: Scale | None = None) -> str:
    """Prints a difference with its sigma; empty where one of the numbers is not known."""
    if not each.compared and each.sigma != 0.0:
        return ""
    scale = scale or scale_of(each)
    return measurement(scale.factor * each.value, scale.factor * each.sigma, scale.unit)


def test_cells(test: JointTest) -> tuple[str, ...]:
    """Prints what `TEST_COLUMNS` name."""
    return figure(test.statistic), str(test.degrees_of_freedom), probability(test.probability)


def tests_of(pair: Pair) -> tuple[JointTest, ...]:
    """Returns all tests of a pair, that of all parameters last but temperature's."""
    last = [test for test in (pair.joint, pair.temperature) if test is not None]
    return (*pair.groups, *last)


def motion_rows(pair: Pair) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Prints what `MOTION_COLUMNS` name of each motion."""
    scales = scales_of((each.unit, each.rms or each.expected) for each in pair.motion)
    return tuple(
        (
            each.triad,
            (each.motion, error(each, scales[each.unit]), by_chance(each, scales[each.unit]) or "not known"),
        )
        for each in pair.motion
    )


def error(each: MotionError, scale: Scale | None = None) -> str:
    """Prints the error of a motion."""
    return (scale or readable_scale(each.unit, each.rms)).figure(each.rms)


def by_chance(each: MotionError, scale: Scale | None = None) -> str:
    """Prints what uncertainty alone would make of it; empty where that is not known."""
    scale = scale or readable_scale(each.unit, each.rms or each.expected)
    return scale.figure(each.expected, 2) if isfinite(each.expected) else ""


def figure(statistic: float) -> str:
    """Prints a chi-square."""
    return f"{statistic:.1f}" if statistic < 1e4 else f"{statistic:.2g}"


def probability(chance: float) -> str:
    """Prints a probability in per cent."""
    if chance < _RAREST:
        return f"less than {_RAREST:.0e}"
    percent = 100.0 * chance
    if percent >= 99.5:
        return "more than 99 %"
    return f"{percent:.2g} %" if chance >= 1e-4 else f"{chance:.1g}"


def history_rows(histories: Sequence[History]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Prints what `HISTORY_COLUMNS` name of each parameter."""
    scales = scales_of((each.unit, max(abs(each.rate), each.rate_sigma)) for each in histories)
    for each in histories:
        sigmas = fixed(each.rate / each.rate_sigma, 1) if each.rate_sigma > 0.0 else ""
        rate = scales[each.unit].measurement(each.rate, each.rate_sigma)
        yield each.name, (rate, sigmas, str(len(each.years)))


def drift_sentence(result: CompareResult) -> str:
    """Describes the parameters that drift with time; empty where there is no history."""
    if not result.history:
        return ""
    span = max(float(each.years[-1] - each.years[0]) for each in result.history)
    drifting = [
        f"{name} by {rate} a year"
        for name, (rate, *_) in history_rows([h for h in result.history if h.drifts])
    ]
    found = "; ".join(drifting) if drifting else "none clearly"
    return f"drift over {fixed(span, 1)} years, of {count_of('parameter', len(result.history))}: {found}"


def method_lines(result: CompareResult) -> tuple[tuple[str, str], ...]:
    """Lists how it was done."""
    dates = zip(result.names, result.dates, result.serials, strict=True)
    made = [
        f"{name}: {date or 'no date'}" + (f", serial {serial}" if serial else "")
        for name, date, serial in dates
    ]
    return (
        ("test", "chi-square of all differences by the sum of both covariances, full where files hold them"),
        ("level", f"differ where chance makes it in less than {100.0 * LEVEL:.0f} of 100 cases"),
        ("calibrations", "; ".join(made)),
        ("software", result.software),
    )
