"""Share of a limit that a value uses."""

from __future__ import annotations

import math

from tumble.foundation.results import LimitCheck
from tumble.report.numbers import significant


def limit_share(check: LimitCheck) -> float:
    """Returns magnitude over limit; infinite where the value is not known or the limit is zero."""
    if not math.isfinite(check.value):
        return math.inf
    if check.limit > 0:
        return abs(check.value) / check.limit
    return math.inf if check.value else 0.0


def used_share(check: LimitCheck) -> str:
    """Prints value over limit in per cent; words where the value is not known or the limit is zero."""
    ratio = limit_share(check)
    if math.isinf(ratio):
        return "an unknown share" if not math.isfinite(check.value) else "more than all"
    return f"{significant(100 * ratio, 2)} %"
