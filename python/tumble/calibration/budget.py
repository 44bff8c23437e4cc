"""The budget of an uncertainty: a headline parameter's sources, their shares, and the expanded uncertainty.

Source: JCGM 100:2008 (GUM), annexes G and H. Derivation: docs/theory/uncertainty.md, section 6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, TypeAlias

from pydantic import Field

from tumble import _core
from tumble.foundation.documents import Document
from tumble.foundation.results import INTERVAL

COVERAGE = 0.95
"""Probability with which a value lies within its expanded uncertainty."""

Distribution: TypeAlias = Literal["normal", "rectangular"]


class BudgetEntry(Document):
    """One source of uncertainty, and its part in that of a parameter."""

    source: str
    """Source in words: `repeatability`, `reference: calibration`, `local gravity`."""
    type: Literal["A", "B"]
    """A: by statistics of the session; B: by other means."""
    distribution: Distribution
    standard_uncertainty: float = Field(ge=0.0)
    """1-sigma of the source, in `unit`."""
    unit: str
    sensitivity: float
    """Contribution over standard uncertainty, unit of the parameter by `unit`."""
    contribution: float = Field(ge=0.0)
    """1-sigma of the parameter by this source alone, unit of the parameter."""
    share: float = Field(ge=0.0, le=1.0)
    """Square of the contribution over that of the combined uncertainty."""
    degrees_of_freedom: float | None = Field(default=None, gt=0.0)
    """Absent where infinite."""
    common: bool = False
    """States whether all targets of that reference, or place, share the error."""


class Budget(Document):
    """Uncertainty of one parameter of a triad, source by source."""

    parameter: str
    """Field term with axis: `bias x`, `scale y`, `non-orthogonality xy`, `mounting z`."""
    unit: str
    value: float
    entries: tuple[BudgetEntry, ...] = Field(strict=False)
    combined_uncertainty: float = Field(ge=0.0)
    """1-sigma of all entries together, in `unit`."""
    degrees_of_freedom: float | None = Field(default=None, gt=0.0)
    """Effective, by Welch and Satterthwaite; absent where infinite."""
    coverage_probability: float = Field(default=COVERAGE, gt=0.0, lt=1.0)
    coverage_factor: float = Field(gt=0.0)
    """k: the quantile of Student's t by the effective degrees of freedom."""
    expanded_uncertainty: float = Field(ge=0.0)
    """U = k u, in `unit`."""


class BudgetSource(Document):
    """A source before its share is known; its fields are those of an entry."""

    source: str
    type: Literal["A", "B"]
    distribution: Distribution
    standard_uncertainty: float
    unit: str
    contribution: float
    degrees_of_freedom: float | None = None
    common: bool = False


def budget_of(parameter: str, unit: str, value: float, sources: Sequence[BudgetSource]) -> Budget:
    """Combines independent sources of one parameter: docs/theory/uncertainty.md, equations (17) to (19)."""
    combined = math.hypot(*(each.contribution for each in sources))  # eq. 17
    freedom = effective_degrees_of_freedom(sources)
    k = INTERVAL if freedom is None else _core.student_quantile(0.5 * (1.0 + COVERAGE), freedom)
    return Budget(
        parameter=parameter,
        unit=unit,
        value=value,
        entries=tuple(_entry(each, combined) for each in sources),
        combined_uncertainty=combined,
        degrees_of_freedom=freedom,
        coverage_factor=k,
        expanded_uncertainty=k * combined,  # eq. 19
    )


def effective_degrees_of_freedom(sources: Sequence[BudgetSource]) -> float | None:
    """Returns nu by Welch and Satterthwaite; None where it is infinite."""
    combined = math.hypot(*(each.contribution for each in sources))
    shares = [
        (each.contribution / combined) ** 4 / each.degrees_of_freedom
        for each in sources
        if each.degrees_of_freedom is not None and each.contribution > 0.0
    ]
    return 1.0 / sum(shares) if sum(shares) > 0.0 else None  # eq. 18


def _entry(source: BudgetSource, combined: float) -> BudgetEntry:
    u = source.standard_uncertainty
    return BudgetEntry(
        **source.model_dump(),
        sensitivity=source.contribution / u if u > 0.0 else 0.0,
        share=min(1.0, (source.contribution / combined) ** 2) if combined > 0.0 else 0.0,
    )
