"""Draw `docs/images/structure.svg`: what carries reference and targets on a turntable.

`.venv/bin/python scripts/draw_structure.py`
"""

from __future__ import annotations

from pathlib import Path

from markupsafe import escape

from tumble.report.svg import ALARM, INK, PANEL, REST, SOFT, X_AXIS

DRAWING = Path(__file__).parent.parent / "docs" / "images" / "structure.svg"
WIDTH, HEIGHT = 760, 330
FONT = 'font-family="sans-serif"'
UNITS = (("target 1", 170), ("reference", 330), ("target 2", 490))
"""Each box on the structure, and where it begins."""
UNIT_WIDTH, UNIT_TOP, STRUCTURE_TOP, PLATE_TOP = 100, 96, 152, 192
NOTES = (
    (1, 220, 148, "flat to 0.02 mm"),
    (2, 640, 172, "stiff: first resonance above 100 Hz"),
    (3, 290, 192, "screws of one torque"),
    (4, 540, 148, "thermal contact, all within 1 K"),
    (5, 120, 118, "cables held"),
)
"""Number, place, and what it is about."""


def drawing() -> str:
    """Side view: the plate of the table, the structure on it, the units on that."""
    parts = [
        f'<path d="M380 40V246" stroke="{SOFT}" stroke-dasharray="8 4 2 4"/>',
        _text(388, 54, "axis of the table", SOFT),
        _box(110, PLATE_TOP, 540, 30, REST, "plate of the turntable"),
        _box(150, STRUCTURE_TOP, 460, 40, PANEL, "structure, in one piece"),
        *(_screw(x, STRUCTURE_TOP + 1, 50) for x in (290, 470)),
        *(part for name, x in UNITS for part in _unit(name, x)),
        f'<path d="M170 {UNIT_TOP + 20}C120 {UNIT_TOP + 20} 130 150 150 160" fill="none" stroke="{INK}"/>',
        *(_note(number, x, y) for number, x, y, _ in NOTES),
        *(_legend(number, place, words) for place, (number, _, _, words) in enumerate(NOTES)),
    ]
    title = "Structure on a turntable that carries a reference and two targets, seen from the side"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{escape(title)}">'
    )
    return "\n".join([head, f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', *parts, "</svg>", ""])


def _box(x: int, y: int, width: int, height: int, fill: str, label: str) -> str:
    outline = f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="{fill}" stroke="{INK}"/>'
    return outline + _text(x + width // 2, y + height // 2 + 5, label, INK, "middle")


def _unit(name: str, x: int) -> list[str]:
    pad = f'<rect x="{x}" y="{STRUCTURE_TOP - 6}" width="{UNIT_WIDTH}" height="6" fill="{ALARM}"/>'
    box = _box(x, UNIT_TOP, UNIT_WIDTH, STRUCTURE_TOP - 6 - UNIT_TOP, "white", name)
    top = STRUCTURE_TOP - 14
    return [pad, box, _screw(x + 10, top, 20), _screw(x + UNIT_WIDTH - 10, top, 20)]


def _screw(x: int, y: int, length: int) -> str:
    return f'<path d="M{x} {y}v{length}M{x - 5} {y}h10" stroke="{INK}" stroke-width="3"/>'


def _note(number: int, x: int, y: int) -> str:
    circle = f'<circle cx="{x}" cy="{y}" r="11" fill="{X_AXIS}"/>'
    return circle + _text(x, y + 5, str(number), "white", "middle")


def _legend(number: int, place: int, words: str) -> str:
    x, y = 24 + 250 * (place % 3), 268 + 30 * (place // 3)
    return _note(number, x, y) + _text(x + 18, y + 5, words, INK)


def _text(x: int, y: int, words: str, colour: str, anchor: str = "start") -> str:
    place = f'x="{x}" y="{y}" fill="{colour}" text-anchor="{anchor}"'
    return f'<text {place} {FONT} font-size="14">{escape(words)}</text>'


if __name__ == "__main__":
    DRAWING.write_text(drawing(), encoding="utf-8")
