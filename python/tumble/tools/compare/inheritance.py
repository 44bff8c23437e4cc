"""The inherited part of two calibrations: shared, so that it is in no difference, or of each by itself.

Method: docs/theory/compare.md, "Inherited errors".
"""

from __future__ import annotations

from tumble.calibration.document import Calibration, Reference
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad
from tumble.tools.compare.common import ACCELEROMETER

BY_TABLE = "table"
"""Truth of a gyroscope that was held against the rates of a table."""


def inherited_apart(first: Calibration, second: Calibration) -> frozenset[CalibratedTriad]:
    """Returns the triads whose inherited errors differ, and so are part of a difference."""
    return frozenset(triad for triad in CALIBRATED_TRIADS if not _share(first, second, triad))


def _share(first: Calibration, second: Calibration, triad: CalibratedTriad) -> bool:
    """Returns whether both inherit of a triad from one reference, one gravity and one table."""
    sections = getattr(first, triad), getattr(second, triad)
    inherits = [section is not None and section.inherited is not None for section in sections]
    if not any(inherits):
        return True
    if not all(inherits) or not _same_reference(first.reference, second.reference):
        return False
    if triad == ACCELEROMETER:
        return _same_gravity(first, second)
    tables = [each.station if _truth(each) == BY_TABLE else None for each in (first, second)]
    return tables[0] == tables[1] and tables[0] != ""


def _same_reference(first: Reference | None, second: Reference | None) -> bool:
    """Returns whether two references are one, of one calibration.

    Without a calibration they are one by log, or by name and serial.
    """
    if first is None or second is None:
        return first is second
    if first.calibration_hash or second.calibration_hash:
        return first.calibration_hash == second.calibration_hash
    logs = [each.log.sha256 if each.log is not None else "" for each in (first, second)]
    if logs[0] and logs[0] == logs[1]:
        return True
    return bool(first.serial) and (first.name, first.serial) == (second.name, second.serial)


def _same_gravity(first: Calibration, second: Calibration) -> bool:
    stated = (each for each in (first.gravity, second.gravity) if each is not None)
    used = [(each.value, each.source) if each.sigma else None for each in stated]
    return len(set(used)) <= 1


def _truth(calibration: Calibration) -> str:
    return calibration.method.truth if calibration.method is not None else ""
