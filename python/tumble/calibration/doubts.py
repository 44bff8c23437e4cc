"""Doubts about a calibration that its own file states: a verdict of fail, or of a model that was not met."""

from __future__ import annotations

from collections.abc import Container, Iterator

from tumble.calibration.document import Calibration
from tumble.foundation.results import LARGEST_WIDENING, Verdict

_MEANINGS: dict[str, str] = {
    "fail": "it is not within its limits",
    "conditional fail": "it is not within its limits",
    "model not met": "its errors are larger than its sigmas say",
}
"""Verdicts that whoever uses a calibration has to know of."""


def doubts(calibration: Calibration) -> Iterator[str]:
    """Returns procedures with a verdict that whoever uses the calibration has to know."""
    return _with_verdict(calibration, _MEANINGS)


def unmet(calibration: Calibration) -> Iterator[str]:
    """Returns procedures whose model was not met: nothing is built on what they found."""
    return _with_verdict(calibration, ("model not met",))


def _with_verdict(calibration: Calibration, bad: Container[str]) -> Iterator[str]:
    procedure = calibration.method.procedure if calibration.method is not None else ""
    verdicts = [(calibration.verdict or _by_sigmas(calibration) or "", procedure, calibration.date)]
    verdicts += [(each.verdict, each.method.procedure, each.date) for each in calibration.contributions or ()]
    for verdict, found_by, date in verdicts:
        if verdict in bad:
            meaning = _MEANINGS[verdict]
            when = f", {date[:10]}" if date else ""
            run = f" ({found_by}{when})" if found_by else ""
            yield f"the calibration {calibration.name} has the verdict {verdict!r}{run}: {meaning}"


def _by_sigmas(calibration: Calibration) -> Verdict | None:
    """Returns the verdict that follows from how far sigmas were widened, for files that state none."""
    widest = max(section.widening or 1.0 for _, section in calibration.triads())
    return "model not met" if widest > LARGEST_WIDENING else None
