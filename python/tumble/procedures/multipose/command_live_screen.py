"""Screen of a live session by hand: next orientation and progress on a terminal, else lines; or JSON."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeAlias

from tumble.cli.live_screen import SHOWN, STYLES, bar, goal_contents, goal_lines, goal_words
from tumble.cli.screen import print_json_line
from tumble.foundation.words import LISTENING

if TYPE_CHECKING:
    from rich.console import Group

    from tumble.procedures.multipose.live import MultiposeStep

Show: TypeAlias = "Callable[[MultiposeStep], None]"
"""Told every step of the session."""

TROUBLE = ("warning", "ended early")
"""Steps that are reported even if quiet."""
SAID = ("rest done", "orientation wanted", "warning", "done", "ended early")
"""Kinds of steps that stay on a terminal, above what is drawn."""


@contextmanager
def shown(as_json: bool, quiet: bool) -> Iterator[Show]:
    """Give what shows each step while the block runs, on standard error; JSON on standard output."""
    from rich.live import Live

    from tumble.cli.screen import message_console

    console = message_console()
    if as_json:
        yield lambda step: print_json_line(event_of(step))
    elif not console.is_terminal or quiet:
        yield lambda step: _print_line("" if quiet and step.kind not in TROUBLE else prompt(step))
    else:
        with Live(console=console, auto_refresh=False) as screen:

            def show(step: MultiposeStep) -> None:
                if step.kind in SAID and step.kind != "orientation wanted":
                    screen.console.print(prompt(step), style="yellow" if step.text else "", highlight=False)
                screen.update(drawn(step), refresh=True)

            yield show


def event_of(step: MultiposeStep) -> dict[str, Any]:
    """Returns a step as plain data: `event` first, goals by their name."""
    content = asdict(step)
    return {"event": content.pop("kind"), **content, "goals": goal_contents(step.goals)}


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


def _print_line(text: str) -> None:
    if text:
        print(text, file=sys.stderr, flush=True)
