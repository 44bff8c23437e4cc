"""Sigma so far against the goal, a bar each: full is where the goal is met."""

from __future__ import annotations

import math

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, set_class
from tumble.report.numbers import typeset
from tumble.tools.guided.view import GoalShare


class GoalBars:
    """Bars of the goal; nothing where none is stated."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._box = block("goals")
        self._shown: tuple[GoalShare, ...] = ()

    def show(self, goals: tuple[GoalShare, ...]) -> None:
        """Shows the sigmas."""
        if goals == self._shown:
            return
        self._shown = goals
        self._box.clear()
        with self._box:
            for goal in goals:
                self._bar(goal)

    def _bar(self, goal: GoalShare) -> None:
        page = self._page
        known, wanted = math.isfinite(goal.sigma), goal.wanted
        is_met = known and wanted is not None and goal.sigma <= wanted
        with block("goal"):
            with block("goal-head"):
                Label("✓" if is_met else "○", "tile-sign")
                Label(page.words(goal.name), "goal-name")
                sigma = typeset(f"{goal.sigma:.2g} {goal.unit}") if known else page.words("not known yet")
                aim = "" if wanted is None else f" / {wanted:g}"
                Label(f"sigma {sigma}{aim}", "goal-figures")
            with block("bar"):
                fill = block("bar-fill")
                share = min(1.0, wanted / goal.sigma) if known and wanted and goal.sigma > 0.0 else 0.0
                fill._style["width"] = f"{100 * share:.0f}%"
                set_class(fill, "met", is_met)
