"""Colours of charts on light and on dark pages; those of axes are the same as in reports."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of one page."""

    paper: str
    ink: str
    soft: str
    grid: str
    rest: str
    rest_edge: str
    turn: str
    turn_edge: str
    axes: tuple[str, str, str]
    """Colours of x, y and z."""
    other: str
    """Colour of quantities without an axis."""


LIGHT = Palette(
    paper="#ffffff",
    ink="#1b2227",
    soft="#5d6870",
    grid="#dfe4e8",
    rest="#cfe3f2",
    rest_edge="#7fb2d6",
    turn="#f6e8cf",
    turn_edge="#d2a650",
    axes=("#0072b2", "#d55e00", "#009e73"),
    other="#7a4f9c",
)
DARK = Palette(
    paper="#13181c",
    ink="#e6eaed",
    soft="#9aa6ae",
    grid="#2d363d",
    rest="#1f3a4f",
    rest_edge="#4f88b0",
    turn="#443517",
    turn_edge="#a07f38",
    axes=("#56b4e9", "#e69f00", "#2fc295"),
    other="#c49be4",
)
"""Okabe and Ito's palette, which colour-blind readers distinguish, lighter on a dark page.

Source: https://jfly.uni-koeln.de/color/.
"""
