"""Screen of a live session: checked faces on a terminal, else a line for each notable event; or JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tumble.cli.live_screen import DONE, OPEN, SHOWN, STYLES, TROUBLE, LiveScreen, bar, goal_lines, goal_words
from tumble.foundation.words import LISTENING

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from tumble.procedures.turntable.live import PoseProgress, TurntableStep

A_ROW = 6
"""Poses beside each other."""


def prompt(step: TurntableStep) -> str:
    """Describes the latest event and the next step; empty where nothing is new."""
    names = ", ".join(unit.name for unit in step.units)
    done = sum(pose.done for pose in step.poses)
    again = f" again: {step.text}" if step.text else ""
    return {
        LISTENING: f"Listening to {names}. Ctrl-C ends; --resume goes on.",
        "pose wanted": f"Go to {step.subject}, and let it stand still{again}.",
        "pose done": f"{step.subject} done, {done} of {len(step.poses)}{goal_words(step.goals)}.",
        "turn wanted": f"Turn about {step.subject} by a quarter or more, then let it stand still.",
        "turn done": f"Turn about {step.subject} done.",
        "warning": f"Warning: {step.subject}: {step.text}",
        "done": "Done.",
        "ended early": f"Ended early: {step.text}.",
    }.get(step.kind, "")


def drawn(step: TurntableStep) -> Group:
    """Draws poses and turns with ticks, each unit, and sigmas against the goal."""
    from rich.console import Group

    return Group(_poses(step), *_turns(step), *_table(step), _units(step), *goal_lines(step.goals))


def _poses(step: TurntableStep) -> Table:
    from rich.box import ROUNDED
    from rich.table import Table
    from rich.text import Text

    faces = Table(box=ROUNDED, show_header=False, show_lines=True)
    cells = [
        Text(
            f"[{DONE if pose.done else OPEN}] {pose.name}\n{bar(pose.seconds / pose.wanted)}\n"
            f"{pose.seconds:.0f} of {pose.wanted:.0f} s{_ticks(pose)}",
            style="green" if pose.done else "bold cyan" if pose.name == step.at else "",
        )
        for pose in step.poses
    ]
    for first in range(0, len(cells), A_ROW):
        faces.add_row(*cells[first : first + A_ROW])
    return faces


def _ticks(pose: PoseProgress) -> str:
    """Draws a tick for each target, a line each."""
    return "".join(f"\n[{DONE if unit.done else OPEN}] {unit.name}" for unit in pose.units)


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


SCREEN: LiveScreen[TurntableStep] = LiveScreen(prompt, drawn, (*TROUBLE, "done"))
"""Shows what happens in a session."""
