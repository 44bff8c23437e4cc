"""Screen of a live session by hand: next orientation and progress on a terminal, else lines; or JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
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
        "orientation wanted": _request(step),
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
        *(Text(line) for line in _field_lines(step)),
        condition,
        *goal_lines(step.goals),
    )


def _where(step: MultiposeStep) -> str:
    from tumble.poses.by_hand import orientation_words

    if step.up is None:
        return "Let it stand still as it lies."
    off = "" if math.isnan(step.off) else f"  ({step.off:.0f} deg to go)"
    return f"Turn it to {orientation_words(step.up)}.{off}"


def _request(step: MultiposeStep) -> str:
    """Asks for the next orientation, and for a heading where the field has to be met from a direction."""
    from tumble.poses.by_hand import direction_words

    if step.field is None or step.field.wanted is None:
        return f"Turn it to {step.subject}, and hold it still for {step.still_wanted:g} s."
    return (
        f"Turn it to {step.subject}, then about the vertical until the magnetic field points "
        f"{direction_words(step.field.wanted)}, and hold it still for {step.still_wanted:g} s."
    )


def _field_words(step: MultiposeStep) -> str:
    """Describes the part of the field that was met, behind a semicolon; empty before it is known."""
    if step.field is None or not step.field.directions:
        return ""
    return f"; magnetic field from {100.0 * step.field.coverage:.0f} % of all directions"


def _field_lines(step: MultiposeStep) -> Iterator[str]:
    """Draws the field: the share that was met, and how far it is from where it is to point."""
    field = step.field
    if field is None:
        return
    if not field.directions:
        yield f"field  {bar(0.0)} not shown yet"
        return
    shown = f"field  {bar(field.coverage)} {100.0 * field.coverage:.0f} % of all directions"
    if field.wanted is None:
        yield shown
        return
    from tumble.poses.by_hand import direction_words

    off = "" if math.isnan(field.off) else f" ({field.off:.0f} deg to go)"
    yield f"{shown}; next it is to point {direction_words(field.wanted)}{off}"


def _held(step: MultiposeStep) -> str:
    told = "enough: turn it" if step.still >= step.still_wanted else f"of {step.still_wanted:g} s"
    return f"{step.still:.1f} {'s, ' * (step.still >= step.still_wanted)}{told}"


def _count(step: MultiposeStep) -> str:
    if step.orientations_wanted is None:
        return f"orientation {step.orientations}"
    return f"orientation {step.orientations} of {step.orientations_wanted}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


SCREEN: LiveScreen[MultiposeStep] = LiveScreen(prompt, drawn, ("rest done", *TROUBLE, "done"))
"""Shows what happens in a session."""
