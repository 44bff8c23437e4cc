"""Common parts of the screens of live sessions: state of a unit, bars, and sigmas against a goal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tumble.cli.errors import tell_as_event
from tumble.cli.screen import print_json_line
from tumble.foundation.errors import TumbleError
from tumble.foundation.words import LISTENING

if TYPE_CHECKING:
    from rich.text import Text

    from tumble.foundation.goal import GoalProgress

BAR_WIDTH = 10
DONE, OPEN, BAR, EMPTY = "✓", " ", "█", "░"
STYLES = {"waiting": "dim", "rest": "green", "motion": "cyan", "silent": "red", "lost": "red"}
SHOWN = {"waiting": "waiting", "rest": "still", "motion": "moves", "silent": "SILENT", "lost": "LOST"}


@contextmanager
def failures_told(as_json: bool) -> Iterator[None]:
    """Reports an error as an event too, with `--json`."""
    try:
        yield
    except TumbleError as error:
        if as_json:
            tell_as_event(error)
        raise


def print_listening(names: Sequence[str]) -> None:
    """Prints, as JSON, that the lines of all these units are open; for commands whose steps do not say so."""
    print_json_line({"event": LISTENING, "units": names})


def goal_contents(goals: Iterable[GoalProgress]) -> list[dict[str, Any]]:
    """Returns goals as plain data, by their name."""
    return [
        {
            "name": goal.term.name,
            "unit": goal.unit,
            "sigma": goal.sigma,
            "wanted": goal.term.sigma,
            "target": goal.target,
        }
        for goal in goals
    ]


def goal_words(goals: Iterable[GoalProgress]) -> str:
    """Describes the progress of known goals, behind a semicolon each."""
    return "".join(f"; {_goal(goal)}" for goal in goals if math.isfinite(goal.sigma))


def goal_lines(goals: Iterable[GoalProgress]) -> Iterator[Text]:
    """Draws a line for each goal, ticked where it is met."""
    from rich.text import Text

    for goal in goals:
        met = goal.ratio <= 1.0
        yield Text(f"[{DONE if met else OPEN}] {_goal(goal)}", style="green" if met else "")


def bar(share: float) -> str:
    """Draws how much of something is done."""
    full = round(BAR_WIDTH * min(share, 1.0))
    return BAR * full + EMPTY * (BAR_WIDTH - full)


def _goal(goal: GoalProgress) -> str:
    if not math.isfinite(goal.sigma):
        return f"{goal.term.name}: not shown yet, {goal.term.sigma:g} wanted"
    unit = "" if goal.unit == "1" else f" {goal.unit}"
    return f"{goal.term.name} {goal.sigma:.2g} of {goal.term.sigma:g}{unit}"
