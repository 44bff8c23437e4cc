"""Conformity: a parameter and its uncertainty held against a limit by a decision rule.

Sources: JCGM 106:2012, ILAC-G8:09/2019. Derivation: docs/theory/uncertainty.md, section 7.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from pydantic import Field

from tumble.foundation.documents import Document
from tumble.foundation.errors import ProcedureError
from tumble.foundation.results import LimitCheck

Conformity: TypeAlias = Literal["pass", "conditional pass", "conditional fail", "fail"]
"""Verdicts of ILAC-G8:09, section 4.2.3, the best first."""
BEST_FIRST: tuple[Conformity, ...] = get_args(Conformity)
_NEARLY_ALL = 99.9
"""Per cent beyond which a probability is not distinguished from certainty."""


class DecisionRule(Document):
    """Rule by which uncertainty counts in a verdict."""

    rule: Literal["simple", "guarded"] = "guarded"
    """simple: within its limit a parameter passes; guarded: the acceptance limit is what counts."""
    guard: float = Field(default=1.0, ge=0.0)
    """Width of the guard band in expanded uncertainties U; the acceptance limit is limit - guard U."""


class ParameterDecision(Document):
    """Verdict on one parameter."""

    parameter: str
    """`accelerometer bias x`."""
    unit: str
    value: float | None
    """Deviation from the ideal value (scale counts from 1); null where the data did not show it."""
    expanded_uncertainty: float | None
    """U, in `unit`; null where it is not known."""
    limit: float
    """Largest magnitude allowed."""
    acceptance_limit: float | None
    """limit - guard U, not below 0; null where U is not known."""
    verdict: Conformity
    probability: float | None = Field(ge=0.0, le=1.0)
    """Probability of conformity: that the true value is within the limit; null where it is not known."""
    remark: str = ""
    """Reason why the data could not show the parameter to be within its limit."""

    def sentence(self) -> str:
        """Describes the verdict, with value, limit and probability."""
        if self.value is None:
            return f"{self.parameter} was {self.remark or 'not shown to be within its limit'}"
        side = "within" if abs(self.value) <= self.limit else "beyond"
        near = " by less than the guard band" if self.verdict.startswith("conditional") else ""
        chance = "" if self.probability is None else f", conforming with a probability of {self.percent}"
        figures = f"{self.value:.3g} {self.unit} is {side} its limit {self.limit:g}"
        return f"{self.parameter} {figures}{near}: {self.verdict}{chance}"

    @property
    def percent(self) -> str:
        """Probability of conformity as text."""
        return in_percent(self.probability)


class Decision(Document):
    """Verdicts on one unit, by one rule."""

    rule: Literal["simple", "guarded"]
    guard: float
    """0 by the simple rule."""
    verdict: Conformity
    """The worst of all parameters."""
    probability: float | None = Field(ge=0.0, le=1.0)
    """Least probability of conformity of a parameter; null where one is not known."""
    parameters: tuple[ParameterDecision, ...] = Field(strict=False)

    def not_passed(self) -> Iterator[str]:
        """Describes each parameter that did not pass, the worst first."""
        worst_first = sorted(self.parameters, key=lambda each: -BEST_FIRST.index(each.verdict))
        yield from (each.sentence() for each in worst_first if each.verdict != "pass")


def rule_named(text: str) -> DecisionRule:
    """Returns the rule that `simple`, `guarded` or `guarded:GUARD` stands for; raises `ProcedureError`."""
    word, colon, width = text.partition(":")
    if text in ("simple", "guarded"):
        return DecisionRule.model_validate({"rule": text})
    if word == "guarded" and colon and re.fullmatch(r"\d+(\.\d+)?", width):
        return DecisionRule(rule="guarded", guard=float(width))
    raise ProcedureError(f"decision {text}: give simple, guarded, or guarded:GUARD such as guarded:0.5")


def in_percent(probability: float | None) -> str:
    """Prints a probability, rounded so that no chance is called certain."""
    if probability is None:
        return "not known"
    chance = 100.0 * probability
    if chance > _NEARLY_ALL:
        return f"more than {_NEARLY_ALL:g} %"
    least = 100.0 - _NEARLY_ALL
    return f"less than {least:.1f} %" if chance < least else f"{chance:.3g} %"


def rule_in_words(rule: DecisionRule | Decision) -> str:
    """Returns `simple`, or `guarded` with the width of the guard band."""
    return "simple" if rule.rule == "simple" else f"guarded, guard band {rule.guard:g} U"


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Uncertainty of a parameter, in its unit."""

    standard: float
    expanded: float


def decide(
    rule: DecisionRule, checks: Sequence[LimitCheck], uncertainties: Mapping[str, Uncertainty]
) -> Decision | None:
    """Returns the verdicts on parameters that were held against limits; None where there are none.

    `uncertainties` are by the name of the parameter. One without is decided by its value alone.
    """
    guard = rule.guard if rule.rule == "guarded" else 0.0
    found = tuple(_decided(check, guard, uncertainties.get(check.parameter)) for check in checks)
    if not found:
        return None
    known = [each.probability for each in found if each.probability is not None]
    return Decision(
        rule=rule.rule,
        guard=guard,
        verdict=max((each.verdict for each in found), key=BEST_FIRST.index),
        probability=min(known, default=None),
        parameters=found,
    )


def conformity(value: float, limit: float, sigma: float) -> float:
    """Probability that the truth is within -limit and limit, by a normal posterior of that sigma."""
    if sigma <= 0.0:
        return float(abs(value) <= limit)
    above, below = (limit - value) / sigma, (-limit - value) / sigma
    return max(0.0, 0.5 * (math.erfc(-above / math.sqrt(2.0)) - math.erfc(-below / math.sqrt(2.0))))  # eq. 22


def verdict_of(value: float, limit: float, guard_band: float) -> Conformity:
    """Returns the verdict by limit and guard band, of a deviation from the ideal."""
    distance = abs(value)
    if distance <= limit - guard_band:  # eq. 20
        return "pass"
    if distance <= limit:
        return "conditional pass"
    return "conditional fail" if distance <= limit + guard_band else "fail"  # eq. 21


def _decided(check: LimitCheck, guard: float, uncertainty: Uncertainty | None) -> ParameterDecision:
    value = check.value if math.isfinite(check.value) else None
    band = guard * uncertainty.expanded if uncertainty is not None else 0.0
    verdict: Conformity = "fail" if check.remark or value is None else verdict_of(value, check.limit, band)
    probability = None
    if value is not None and uncertainty is not None:
        probability = conformity(value, check.limit, uncertainty.standard)
    return ParameterDecision(
        parameter=check.parameter,
        unit=check.unit,
        value=value,
        expanded_uncertainty=uncertainty.expanded if uncertainty is not None else None,
        limit=check.limit,
        acceptance_limit=max(0.0, check.limit - band) if uncertainty is not None else None,
        verdict=verdict,
        probability=probability,
        remark=check.remark,
    )
