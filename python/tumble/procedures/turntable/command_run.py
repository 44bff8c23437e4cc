"""A run of targets for its report: takes targets one by one, and keeps the parts that are shown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tumble.foundation.results import Verdict
from tumble.procedures.turntable.batch import CALIBRATION_ENDING
from tumble.procedures.turntable.production import Made, Production, write_views
from tumble.procedures.turntable.result import worst_of
from tumble.procedures.turntable.summary import ScreenSummary, target_content


class TurntableRun:
    """Results of all targets of a run."""

    def __init__(self, production: Production, expected: int, *, everything: bool, as_json: bool) -> None:
        self.shared = production.session.batch
        self.batch = production.batch
        self.screen = ScreenSummary(self.shared, expected, everything=everything)
        self.unchanged = 0
        """Targets that were done before."""
        self.moved: list[Path] = []
        """Files of earlier attempts that were put aside."""
        self._as_json = as_json
        self._contents: dict[str, dict[str, Any]] = {}

    def add(self, made: Made) -> None:
        """Take a target."""
        self.screen.add(made.record)
        self.unchanged += not made.fresh
        self.moved += made.moved
        if self._as_json:
            self._contents[made.record.target] = target_content(made.record, made.calibration)

    @property
    def is_well(self) -> bool:
        """True if every target has a calibration within its limits."""
        return not self.screen.failed

    @property
    def verdict(self) -> Verdict:
        """That of the worst target."""
        return worst_of(self.screen.verdicts)

    def save(self, _folder: Path | str) -> dict[str, Path]:
        """Write summary and report of all targets in the folder of the batch; their own files are written."""
        return write_views(self.shared, self.batch)

    def targets(self) -> Iterator[dict[str, Any]]:
        """Give all targets of the folder; those of earlier runs without the content of their calibration."""
        for record in self.batch.latest():
            yield self._contents.get(record.target) or target_content(record, None)

    def calibrations(self) -> dict[str, Path]:
        """Give the calibration files of the folder by target."""
        return {
            name: self.batch.folder / f"{last.stem}{CALIBRATION_ENDING}"
            for name, last in self.batch.last.items()
            if last.calibration_sha256
        }
