"""How a live session shows: faces that are ticked on a terminal, else a line for what matters; or JSON."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from tumble.turntable.goal import GoalProgress
    from tumble.turntable.live import TurntableStep

Show: TypeAlias = "Callable[[TurntableStep], None]"
"""Told every step of the session."""

BAR_WIDTH = 10
DONE, OPEN, BAR, EMPTY = "✓", " ", "█", "░"
STYLES = {"waiting": "dim", "rest": "green", "motion": "cyan", "silent": "red", "lost": "red"}
SHOWN = {"waiting": "waiting", "rest": "still", "motion": "moves", "silent": "SILENT", "lost": "LOST"}
TROUBLE = ("warning", "ended early")
"""What is said even where little is."""
A_ROW = 6
"""Poses beside each other."""


@contextmanager
def shown(as_json: bool, quiet: bool) -> Iterator[Show]:
    """Give what shows each step while the block runs, on standard error; JSON on standard output."""
    from rich.console import Console
    from rich.live import Live

    console = Console(file=sys.stderr)
    if as_json:
        yield lambda step: print_event(event_of(step))
    elif not console.is_terminal or quiet:
        yield lambda step: _print_line("" if quiet and step.kind not in TROUBLE else prompt(step))
    else:
        with Live(console=console, auto_refresh=False) as screen:

            def show(step: TurntableStep) -> None:
                if step.kind in (*TROUBLE, "done"):
                    screen.console.print(prompt(step), style="yellow" if step.text else "", highlight=False)
                screen.update(drawn(step), refresh=True)

            yield show


def print_event(content: Mapping[str, Any]) -> None:
    """Print one event as a line of JSON on standard output."""
    from tumble.plain import finite

    print(json.dumps(finite(content), allow_nan=False), flush=True)


def event_of(step: TurntableStep) -> dict[str, Any]:
    """Give a step as plain data: `event` first, goals by their name."""
    content = asdict(step)
    goals = [
        {
            "name": goal.term.name,
            "unit": goal.unit,
            "sigma": goal.sigma,
            "wanted": goal.term.sigma,
            "target": goal.target,
        }
        for goal in step.goals
    ]
    return {"event": content.pop("kind"), **content, "goals": goals}


def prompt(step: TurntableStep) -> str:
    """Say what happened, and what to do now; empty where nothing is new."""
    names = ", ".join(unit.name for unit in step.units)
    done = sum(pose.done for pose in step.poses)
    return {
        "listening": f"Listening to {names}. Ctrl-C ends; --resume goes on.",
        "pose wanted": f"Go to {step.subject}, and let it stand still.",
        "pose done": f"{step.subject} done, {done} of {len(step.poses)}{_reached(step)}.",
        "turn wanted": f"Turn about {step.subject} by a quarter or more, then let it stand still.",
        "turn done": f"Turn about {step.subject} done.",
        "warning": f"Warning: {step.subject}: {step.text}",
        "done": "Done.",
        "ended early": f"Ended early: {step.text}.",
    }.get(step.kind, "")


def drawn(step: TurntableStep) -> Group:
    """Draw poses and turns with ticks, each unit, and sigmas against the goal."""
    from rich.console import Group

    return Group(_poses(step), *_turns(step), *_table(step), _units(step), *_goals(step))


def _print_line(text: str) -> None:
    if text:
        print(text, file=sys.stderr, flush=True)


def _reached(step: TurntableStep) -> str:
    known = [goal for goal in step.goals if math.isfinite(goal.sigma)]
    return "".join(f"; {_goal(goal)}" for goal in known)


def _goal(goal: GoalProgress) -> str:
    if not math.isfinite(goal.sigma):
        return f"{goal.term.name}: not shown yet, {goal.term.sigma:g} wanted"
    unit = "" if goal.unit == "1" else f" {goal.unit}"
    return f"{goal.term.name} {goal.sigma:.2g} of {goal.term.sigma:g}{unit}"


def _bar(share: float) -> str:
    full = round(BAR_WIDTH * min(share, 1.0))
    return BAR * full + EMPTY * (BAR_WIDTH - full)


def _poses(step: TurntableStep) -> Table:
    from rich.box import ROUNDED
    from rich.table import Table
    from rich.text import Text

    faces = Table(box=ROUNDED, show_header=False, show_lines=True)
    cells = [
        Text(
            f"[{DONE if pose.done else OPEN}] {pose.name}\n{_bar(pose.seconds / pose.wanted)}\n"
            f"{pose.seconds:.0f} of {pose.wanted:.0f} s",
            style="green" if pose.done else "bold cyan" if pose.name == step.at else "",
        )
        for pose in step.poses
    ]
    for first in range(0, len(cells), A_ROW):
        faces.add_row(*cells[first : first + A_ROW])
    return faces


def _turns(step: TurntableStep) -> Iterator[Text]:
    from rich.text import Text

    if step.turns:
        each = (
            f"[{DONE if turn.done else OPEN}] {turn.name} {turn.count}/{turn.wanted}" for turn in step.turns
        )
        yield Text("turns  " + "  ".join(each))


def _table(step: TurntableStep) -> Iterator[Text]:
    from rich.text import Text

    if step.table:
        yield Text(f"table  {step.table}")


def _units(step: TurntableStep) -> Table:
    from rich.table import Table

    units = Table(box=None, show_header=False)
    for unit in step.units:
        rate = "" if math.isnan(unit.rate) else f"{unit.rate:.4g} Hz"
        units.add_row(unit.name, f"[{STYLES[unit.condition]}]{SHOWN[unit.condition]}", rate)
    return units


def _goals(step: TurntableStep) -> Iterator[Text]:
    from rich.text import Text

    for goal in step.goals:
        met = goal.ratio <= 1.0
        yield Text(f"[{DONE if met else OPEN}] {_goal(goal)}", style="green" if met else "")
