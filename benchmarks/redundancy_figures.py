"""Figures and tables of many missions, by kind of fault and number of units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.redundancy_fault import Kind
from benchmarks.redundancy_judgement import OUTCOMES
from benchmarks.results import Content

SETS: dict[str, tuple[int, ...]] = {"N = 2": (2,), "N >= 3": (3, 4)}
"""Numbers of units that are judged together."""
GROUPS: dict[str, tuple[Kind, ...]] = {
    "jump, scale": ("jump", "scale"),
    "ramp": ("ramp",),
    "broken signals": ("noise", "stuck", "frozen", "swapped axes", "spikes", "wrong sign"),
    "lost samples": ("dead", "late", "not a number"),
}
"""Kinds that have a goal together."""
WIDTH = 180
"""Characters of a row of the widest table."""
SOON = 0.3
"""s within which a contradiction is to be seen."""
LONG = 90.0
"""s after which an answer is of no use."""


def wide_console() -> Console:
    """Returns a console on which the tables have room."""
    console = Console()
    return Console(width=max(console.width, WIDTH))


def by_kind(missions: Sequence[Mapping[str, Any]], groups: Mapping[str, Sequence[Kind]] = GROUPS) -> Content:
    """Returns the figures of each kind of fault, and of each group of them."""
    return {
        "kinds": {kind: of_kind(_of(missions, (kind,))) for kind in get_args(Kind)},
        "groups": {name: of_kind(_of(missions, group)) for name, group in groups.items()},
    }


def flown(kinds: Mapping[str, Content]) -> dict[str, Content]:
    """Returns the kinds of which there were missions."""
    return {kind: of for kind, of in kinds.items() if of["missions"]}


def _of(missions: Sequence[Mapping[str, Any]], kinds: Sequence[str]) -> list[Mapping[str, Any]]:
    return [each for each in missions if each["kind"] in kinds]


def of_kind(missions: Sequence[Mapping[str, Any]]) -> Content:
    """Returns the figures of missions with a fault."""
    primary = [each for each in missions if each["faulty"] == 0]
    return {
        "missions": len(missions),
        "outcomes": {name: sum(each["outcome"] == name for each in missions) for name in OUTCOMES},
        "right_within": sum(_within(each["isolated"], LONG) for each in missions),
        "seen_within": sum(_within(each["seen"], SOON) for each in missions),
        "also a sound unit": sum(each["also"] > 0 for each in missions),
        "isolated": percentiles(each["isolated"] for each in missions),
        "seen": percentiles(each["seen"] for each in missions),
        "velocity": percentiles(each["velocity"] for each in primary if each["sensor"] == "accelerometer"),
        "angle": percentiles(each["angle"] for each in primary if each["sensor"] == "gyroscope"),
        "misled": sum(each["misled"] for each in missions),
        "changes": percentiles(each["changes"] for each in missions),
        "without_source": percentiles(each["without_source"] for each in missions),
    }


def _within(value: float | None, limit: float) -> bool:
    return value is not None and value <= limit


IN_HEALTH = {
    "units named": "faulty_in_health",
    "disagree": "disagree_in_health",
    "changes of the source": "changes_in_health",
    "s without a source": "without_source_in_health",
    "adopted": "adopted",
    "wrongly": "wrongly adopted",
    "refused that were right": "refused that were right",
}
"""Counts while all units are sound, by their titles in tables."""


def of_health(missions: Sequence[Mapping[str, Any]]) -> Content:
    """Returns the reports while all units were healthy."""
    hours = sum(each["health"] for each in missions) / 3600.0
    return {"hours": hours, **{name: sum(each[name] for each in missions) for name in IN_HEALTH.values()}}


def percentiles(values: Iterable[float | None]) -> Content:
    """Median, 95 % and largest; nothing of nothing."""
    known = np.array([value for value in values if value is not None])
    if not len(known):
        return {"number": 0}
    median, high = np.percentile(known, [50.0, 95.0])
    return {"number": len(known), "median": float(median), "high": float(high), "max": float(known.max())}


def show(figures: Content, console: Console) -> None:
    """Prints the tables."""
    for title, of in figures["sets"].items():
        table = Table(*header(), title=title)
        for kind, each in flown({**of["kinds"], "not calibrated": of["not calibrated"]}).items():
            table.add_row(*cells(kind, each))
        console.print(table)
        console.print(_health(of["health"]))


def header() -> tuple[str, ...]:
    """Returns the titles of the columns of `cells`."""
    return (
        *("fault", "n", *OUTCOMES, "also", "isolated, s", "95 %", "seen", "s", "95 %"),
        *("m/s", "deg", "misled", "changes", "none, s"),
    )


def cells(kind: str, of: Content) -> Iterator[str]:
    """Returns a row of the table."""
    yield from (kind, str(of["missions"]))
    yield from (str(of["outcomes"][name]) for name in OUTCOMES)
    yield str(of["also a sound unit"])
    yield from _two(of["isolated"])
    yield str(of["seen"]["number"])
    yield from _two(of["seen"])
    yield from (_two(of[name])[0] for name in ("velocity", "angle"))
    yield from (str(of["misled"]), _two(of["changes"])[0], _two(of["without_source"])[1])


def _two(figures: Content) -> tuple[str, str]:
    if not figures["number"]:
        return "", ""
    return f"{figures['median']:.3g}", f"{figures['high']:.3g}"


def _health(of: Content) -> str:
    counts = ", ".join(f"{title} {of[name]:g}" for title, name in IN_HEALTH.items())
    return f"{of['hours']:.1f} h of health: {counts}"
