"""Conformity: a parameter and its uncertainty held against a limit by a decision rule.

Sources: JCGM 106:2012, ILAC-G8:09/2019. Derivation: docs/theory/uncertainty.md, section 7.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from pydantic import Field

from tumble.foundation.documents import Document

Conformity: TypeAlias = Literal["pass", "conditional pass", "conditional fail", "fail"]
"""Verdicts of ILAC-G8:09, section 4.2.3, the best first."""


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
