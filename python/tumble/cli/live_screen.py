"""Common parts of the screens of live sessions: state of a unit, bars, and sigmas against a goal."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from tumble.cli.errors import tell_as_event
from tumble.cli.screen import print_json_line
from tumble.foundation.errors import TumbleError
from tumble.foundation.translation import translated
from tumble.foundation.words import LISTENING

if TYPE_CHECKING:
    from rich.console import Group
    from rich.text import Text

    from tumble.foundation.goal import GoalProgress

BAR_WIDTH = 10
DONE, OPEN, BAR, EMPTY = "✓", " ", "█", "░"
STYLES = {"waiting": "dim", "rest": "green", "motion": "cyan", "silent": "red", "lost": "red"}
TROUBLE = ("warning", "ended early")
"""Kinds of steps that are shown even in quiet mode."""
SHOWN = {"waiting": "waiting", "rest": "still", "motion": "moves", "silent": "SILENT", "lost": "LOST"}


class ShownStep(Protocol):
    """Step of a live session."""

    @property
    def kind(self) -> str:
        """Kind of what happened."""

    @property
    def text(self) -> str:
        """Text of a warning or of an early end."""

    @property
    def goals(self) -> tuple[GoalProgress, ...]:
        """Progress towards what was asked for."""


Step = TypeVar("Step", bound=ShownStep)


@dataclass(frozen=True, slots=True)
class LiveScreen(Generic[Step]):
    """Shows the steps of a session: drawn on a terminal, else as lines on standard error, or as JSON."""

    prompt: Callable[[Step], str]
    """Describes the latest event and the next step; empty where nothing is new."""
    drawn: Callable[[Step], Group]
    """Draws the state of the session."""
    stays: tuple[str, ...]
    """Kinds of steps that stay on a terminal, above what is drawn."""

    @contextmanager
    def shown(self, as_json: bool, quiet: bool) -> Iterator[Callable[[Step], None]]:
        """Gives what shows each step while the block runs."""
        from rich.live import Live

        from tumble.cli.drawn_translation import translated_drawing
        from tumble.cli.screen import message_console

        console = message_console()
        if as_json:
            yield lambda step: print_json_line(event_of(step))
        elif not console.is_terminal or quiet:
            yield lambda step: _print_line("" if quiet and step.kind not in TROUBLE else self.prompt(step))
        else:
            with Live(console=console, auto_refresh=False) as screen:

                def show(step: Step) -> None:
                    if step.kind in self.stays:
                        style = "yellow" if step.text else ""
                        screen.console.print(translated(self.prompt(step)), style=style, highlight=False)
                    screen.update(translated_drawing(self.drawn(step)), refresh=True)

                yield show


def event_of(step: Any) -> dict[str, Any]:  # noqa: ANN401 - a data class
    """Returns a step as plain data: `event` first, goals by their name."""
    from tumble.foundation.plain import plain

    content = {field.name: plain(getattr(step, field.name)) for field in fields(step)}
    return {"event": content.pop("kind"), **content, "goals": goal_contents(step.goals)}


def _print_line(text: str) -> None:
    if text:
        print(translated(text), file=sys.stderr, flush=True)


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
    """Prints, as JSON, that the lines of all these units are open; for commands whose steps do not."""
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
