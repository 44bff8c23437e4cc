"""Draw `docs/images/map.svg`: the parts of Tumble, and which uses which, as `check_layers.py` finds them.

`.venv/bin/python scripts/draw_map.py [--check]`
"""

from __future__ import annotations

import graphlib
import sys
from collections.abc import Mapping
from pathlib import Path

from markupsafe import escape

sys.path.insert(0, str(Path(__file__).parent))
import check_layers
from made_files import ROOT, write_or_check

from tumble.report.svg import INK, PANEL, SOFT

DRAWING = ROOT / "docs" / "images" / "map.svg"
PARTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "core": ("error model, estimators, redundant sets: no heap", ("tumble-core", "tumble-processor")),
    "devices": ("records in flash, the library for C", ("tumble-store", "tumble-capi")),
    "laboratory mathematics": ("rests and turns, fits, Allan deviation, simulators", ("tumble-lab",)),
    "binding": ("arrays in, arrays out", ("tumble-py",)),
    "page in a browser": ("the core for WebAssembly, and its page", ("tumble-web",)),
    "foundation": ("clock, files, units, recordings, results", ("foundation",)),
    "logs and streams": ("readers and writers of logs, live sources", ("logs", "live")),
    "calibrations": (
        "the calibration file; samples as the core takes them",
        ("acquisition", "calibration", "poses"),
    ),
    "pages and commands": ("all that pages share, and commands", ("report", "cli")),
    "procedures and tools": ("a folder each: result, procedure, page, command", ("procedures", "tools")),
    "station": ("bench page, registry and certificates, fleets", ("bench", "laboratory", "fleet")),
}
"""Each part: what it holds, and its crates or rooms of the package."""
OUTSIDE = {"tumble-fuzz", "__init__", "__main__"}
"""No parts: tests, and the doors of the package."""
NATIVE = "_core"
"""Module of the package that is the binding."""
WIDTH, BOX_WIDTH, BOX_HEIGHT, ROW, MARGIN = 760, 330, 52, 88, 20


def uses() -> dict[str, set[str]]:
    """Which parts each part uses, by the dependencies of crates and the imports of rooms.

    Raises `ValueError` for a crate or a room that is in no part.
    """
    part_of = {member: part for part, (_, members) in PARTS.items() for member in members}
    between = {**check_layers.CRATES, **check_layers.uses_between_rooms()}
    if lost := set(between) - set(part_of) - OUTSIDE:
        raise ValueError(f"{', '.join(sorted(lost))}: in no part of the map")
    found: dict[str, set[str]] = {part: set() for part in PARTS}
    for member, used in between.items():
        for other in used:
            part, of = part_of.get(member), part_of.get("tumble-py" if other == NATIVE else other)
            if part and of and part != of:
                found[part].add(of)
    return found


def nearest(between: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """Leaves out what a part uses by way of another, too."""

    def reached(part: str) -> set[str]:
        return {each for used in between[part] for each in ({used} | reached(used))}

    return {
        part: {each for each in used if not any(each in reached(other) for other in used - {each})}
        for part, used in between.items()
    }


def rows(between: Mapping[str, set[str]]) -> list[list[str]]:
    """Parts by rows, each above all that it uses."""
    level: dict[str, int] = {}
    for part in graphlib.TopologicalSorter(between).static_order():
        level[part] = 1 + max((level[each] for each in between[part]), default=-1)
    return [
        [part for part in PARTS if level[part] == row] for row in sorted(set(level.values()), reverse=True)
    ]


def drawing() -> str:
    """Boxes in rows, with a line from each to what it uses."""
    between = nearest(uses())
    places = {}
    lines = rows(between)
    for row, parts in enumerate(lines):
        for column, part in enumerate(parts):
            x = (WIDTH - len(parts) * (BOX_WIDTH + MARGIN) + MARGIN) // 2 + column * (BOX_WIDTH + MARGIN)
            places[part] = (x, MARGIN + row * ROW)
    height = len(lines) * ROW + MARGIN
    drawn = [_line(places[part], places[each]) for part in PARTS for each in sorted(between[part])]
    drawn += [_box(*places[part], part, PARTS[part][0]) for part in PARTS]
    title = "The parts of Tumble: each stands above those that it uses"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" '
        f'aria-label="{escape(title)}">'
    )
    return "\n".join([head, f'<rect width="{WIDTH}" height="{height}" fill="white"/>', *drawn, "</svg>", ""])


def _line(user: tuple[int, int], used: tuple[int, int]) -> str:
    x, y = user[0] + BOX_WIDTH // 2, user[1] + BOX_HEIGHT
    to_x, to_y = used[0] + BOX_WIDTH // 2, used[1]
    middle = (y + to_y) // 2
    return f'<path d="M{x} {y}C{x} {middle} {to_x} {middle} {to_x} {to_y}" fill="none" stroke="{SOFT}"/>'


def _box(x: int, y: int, name: str, holds: str) -> str:
    centre = x + BOX_WIDTH // 2
    return (
        f'<rect x="{x}" y="{y}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="4" '
        f'fill="{PANEL}" stroke="{INK}"/>'
        f'<text x="{centre}" y="{y + 22}" text-anchor="middle" font-family="sans-serif" font-size="15" '
        f'font-weight="bold" fill="{INK}">{escape(name)}</text>'
        f'<text x="{centre}" y="{y + 41}" text-anchor="middle" font-family="sans-serif" font-size="12" '
        f'fill="{INK}">{escape(holds)}</text>'
    )


if __name__ == "__main__":
    sys.exit(write_or_check([(DRAWING, drawing())], __doc__, __file__))
