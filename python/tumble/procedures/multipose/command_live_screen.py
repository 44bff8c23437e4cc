"""Screen of a live session by hand: next orientation and progress on a terminal, else lines; or JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tumble.cli.live_screen import SHOWN, STYLES, TROUBLE, LiveScreen, bar, goal_lines, goal_words
from tumble.foundation.words import LISTENING

if TYPE_CHECKING:
    from rich.console import Group

    from tumble.procedures.multipose.live import MultiposeStep


def prompt(step: MultiposeStep) -> str:
    """Describes the latest event and the next step; empty where nothing is new."""
    return {
        LISTENING: (
            f"Listening to {step.name}. Let it stand still for {step.still_wanted:g} s as it lies. Ctrl-C "
            "ends and calibrates."
        ),
        "rest done": f"{_capital(step.subject)}: {_count(step)}{goal_words(step.goals)}.",
        "orientation wanted": f"Turn it to {step.subject}, and hold it still for {step.still_wanted:g} s.",
        "warning": f"Warning: {step.subject}: {step.text}",
        "done": "Done.",
        "ended early": f"Ended early: {step.text}.",
    }.get(step.kind, "")


def drawn(step: MultiposeStep) -> Group:
    """Draws the next orientation, the present rest, the counts, and sigmas against the goal."""
    from rich.console import Group
    from rich.text import Text

    rate = "" if math.isnan(step.rate) else f"  {step.rate:.4g} Hz"
    condition = Text(f"{step.name}  ").append(SHOWN[step.condition], STYLES[step.condition]).append(rate)
    return Group(
        Text(_where(step), "bold"),
        Text(f"still  {bar(step.still / step.still_wanted)} {_held(step)}"),
        Text(f"shown  {_count(step)}, {step.turns} turns"),
        condition,
        *goal_lines(step.goals),
    )


def _where(step: MultiposeStep) -> str:
    from tumble.poses.by_hand import orientation_words

    if step.up is None:
        return "Let it stand still as it lies."
    off = "" if math.isnan(step.off) else f"  ({step.off:.0f} deg to go)"
    return f"Turn it to {orientation_words(step.up)}.{off}"


def _held(step: MultiposeStep) -> str:
    told = "enough: turn it" if step.still >= step.still_wanted else f"of {step.still_wanted:g} s"
    return f"{step.still:.1f} {'s, ' * (step.still >= step.still_wanted)}{told}"


def _count(step: MultiposeStep) -> str:
    wanted = "" if step.orientations_wanted is None else f" of {step.orientations_wanted}"
    return f"orientation {step.orientations}{wanted}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


SCREEN: LiveScreen[MultiposeStep] = LiveScreen(prompt, drawn, ("rest done", *TROUBLE, "done"))
"""Shows what happens in a session."""
