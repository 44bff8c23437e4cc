"""Statements on the axes in which another program corrects readings."""

from __future__ import annotations

from collections.abc import Sequence

from tumble.calibration.document import Calibration
from tumble.foundation.body_axes import in_words
from tumble.tools.exchange.remark_lines import comment

SETTING = "axes"
"""Name of the setting that states the axes of a calibration."""
STATEMENT = "axes: "
"""Beginning of a statement about axes."""


def statement(expected: str, words: str, before: Sequence[Calibration]) -> str:
    """States the axes of a program, `expected` of a vehicle or empty, and those of earlier calibrations."""
    found = list(dict.fromkeys(filter(None, (_about(expected, each) for each in before))))
    return f"{STATEMENT}{'; '.join([words, *found])}"


def _about(expected: str, calibration: Calibration) -> str:
    """States how a calibration got into the axes of the program."""
    if not expected:
        return (
            f"{calibration.name} was calibrated in {in_words(calibration.axes)}" if calibration.axes else ""
        )
    if not calibration.axes:
        return (
            f"the log of {comment(calibration.name)} does not define its axes: they are taken for these, or "
            f"give --set {SETTING}=..."
        )
    if calibration.axes == expected:
        return f"{comment(calibration.name)} was calibrated in these"
    return f"{_calibrated(calibration, calibration.axes)}, and is turned into these"


def _calibrated(calibration: Calibration, axes: str) -> str:
    return f"{comment(calibration.name)} was calibrated in {in_words(axes)}"
