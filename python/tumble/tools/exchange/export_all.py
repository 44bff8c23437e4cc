"""Calibrations in the formats of all programs that they suffice for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import short
from tumble.tools.exchange.registry import TARGETS
from tumble.tools.exchange.target import Exported


def export_all(
    calibrations: Sequence[Calibration], typed: Mapping[str, str], *, strict: bool = False
) -> tuple[dict[str, Exported], dict[str, str]]:
    """Returns the file of each format, and of each other format the reason why there is none.

    A setting goes to all formats that have it. With `strict` a format that cannot hold all of a
    calibration is among the others.

    Raises `ProcedureError` where no format has a setting.
    """
    known = {setting.name for target in TARGETS.values() for setting in target.settings}
    if unknown := [name for name in typed if name not in known]:
        raise ProcedureError(
            f"no format has a setting {short(unknown[0])}; see tumble export --format list --json"
        )
    exported, refused = {}, {}
    for word, target in TARGETS.items():
        own = {setting.name for setting in target.settings}
        try:
            found = target.export(calibrations, {name: typed[name] for name in typed if name in own})
        except ProcedureError as error:
            refused[word] = str(error)
            continue
        if strict and found.losses:
            refused[word] = "; ".join(map(str, found.losses))
        else:
            exported[word] = found
    return exported, refused
