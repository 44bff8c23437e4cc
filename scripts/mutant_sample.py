"""Mutants, the order in which they are drawn, and the share of them that tests find."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from scipy.stats import binomtest


class Span(NamedTuple):
    """A piece of a file; lines and columns count from one, and the end is behind the last letter."""

    line: int
    column: int
    end_line: int
    end_column: int

    def contains(self, other: Span) -> bool:
        """True where the other span lies within this one."""
        return self[:2] <= other[:2] and other[2:] <= self[2:]


@dataclass(frozen=True, slots=True, order=True)
class Mutant:
    """One fault that a tool can put into a file."""

    part: str
    """Crate, or folder of the package."""
    file: str
    span: Span
    change: str
    """Text in place of the span for Rust; operator and its occurrence for Python."""
    function: Span | None = None
    """Function of Rust that holds the span."""

    @property
    def name(self) -> str:
        """Identifies it."""
        return f"{self.file}:{self.span.line}:{self.span.column}: {self.change}"


def shuffled(mutants: Iterable[Mutant], seed: int) -> dict[str, list[Mutant]]:
    """Returns one mutant of each place, the places of each part in an order that follows from the seed.

    A tool has one change for some places and ten for others, so that places are drawn, not changes.
    """
    parts: dict[str, dict[tuple[str, Span], list[Mutant]]] = defaultdict(lambda: defaultdict(list))
    for mutant in sorted(mutants, key=lambda each: (each.part, each.file, each.span, each.change)):
        parts[mutant.part][mutant.file, mutant.span].append(mutant)
    drawn = {}
    for part, places in parts.items():
        # Each part has a generator of its own: a change in one leaves the draws of all others.
        generator = random.Random(f"{seed} {part}")
        drawn[part] = [generator.choice(changes) for changes in places.values()]
        generator.shuffle(drawn[part])
    return drawn


def merged(drawn: Mapping[str, Sequence[Mutant]], lines: Mapping[str, int]) -> list[Mutant]:
    """Returns all in one order. In each beginning of it a part has its share of the lines, to within one."""
    order = [
        ((place + 0.5) / lines[part], part, mutant)
        for part, mutants in drawn.items()
        for place, mutant in enumerate(mutants)
    ]
    return [mutant for _, _, mutant in sorted(order, key=lambda each: each[:2])]


def wilson(found: int, tried: int) -> tuple[float, float]:
    """Returns the ends of the 95 % interval of a share (Wilson)."""
    if not tried:
        return 0.0, 1.0
    low, high = binomtest(found, tried).proportion_ci(method="wilson")
    return float(low), float(high)


def table(outcomes: Iterable[tuple[str, bool]]) -> list[str]:
    """Returns a line for each part, and one for all: tried, found, their share and its interval."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for part, is_found in outcomes:
        for name in (part, "together"):
            counts[name][0] += 1
            counts[name][1] += is_found
    rows = [f"{'part':<26}{'tried':>6}{'found':>6}{'share':>8}   95 % interval"]
    for name in sorted(counts, key=lambda each: (each == "together", each)):
        tried, found = counts[name]
        low, high = wilson(found, tried)
        rows.append(f"{name:<26}{tried:>6}{found:>6}{found / tried:>8.1%}   {low:.1%} to {high:.1%}")
    return rows
