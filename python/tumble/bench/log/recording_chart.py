"""The chart as an element of a page: ECharts in the browser, samples from the server."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from nicegui.element import Element
from nicegui.elements.echart import EChart

from tumble.bench.log.chart_options import ChartPlan
from tumble.foundation.translation import translated
from tumble.tools.view.marks import SegmentMark

# Its import makes ECharts known to the page.
assert EChart is not None


class RecordingChart(Element, component="recording_chart.js"):
    """A chart of recordings, or of curves.

    Events: `choose` has the section, [start, end] s, or none; `window` has `start`, `end` and, of each
    series, the lowest and highest value; `trouble` has why samples did not come.
    """

    def __init__(self, plan: ChartPlan, *, label: str, title: str, file: str, source: str = "") -> None:
        super().__init__()
        self._title, self._file = title, file
        self._props["source"] = source
        self._props["marks"] = []
        self._props["hidden"] = []
        self._props["duration"] = 0.0
        self.plan(plan, label)

    def plan(self, plan: ChartPlan, label: str, *, subtitle: str = "", x_unit: str = " s") -> None:
        """Takes another plan; what is visible stays."""
        self._props["label"] = label
        self._props["options"] = plan.options
        self._props["lines"] = [asdict(line) for line in plan.lines]
        self._props["drawing"] = {
            "title": self._title,
            "subtitle": subtitle,
            "file": self._file,
            "x_unit": x_unit,
            "quantities": plan.quantities,
            "units": plan.units,
            "words": {
                "rest": translated("rest"),
                "turn": translated("turn"),
                "no rest": translated("not used as a rest"),
                "segments": translated("segments, too narrow to be shown"),
            },
        }
        self.style(f"height: {plan.height}px")
        self.update()

    def show_marks(self, marks: Sequence[SegmentMark], duration: float) -> None:
        """Shows segments, and the time up to `duration`, s."""
        self._props["marks"] = [asdict(mark) for mark in marks]
        self._props["duration"] = duration
        self.update()

    def hide(self, names: Sequence[str]) -> None:
        """Shows no lines of these units or forms."""
        self._props["hidden"] = list(names)
        self.update()

    def command(self, name: str, *arguments: Any) -> None:  # noqa: ANN401 - as NiceGUI has it
        """Calls a method of the chart in the browser: `zoom`, `choose`, `set_mode`, `picture`, `rest`."""
        self.run_method(name, *arguments)
