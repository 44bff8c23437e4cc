"""Draw the pictures of results in the documentation: figures of reports that the commands of a page write.

`.venv/bin/python scripts/draw_results.py`
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from check_commands import ROOT, run, snippets

from tumble.report.svg import PAGE_COLOURS

PAGES = ROOT / "docs" / "getting-started"
IMAGES = ROOT / "docs" / "images"
PICTURES = {
    "multipose-orientations": ("by-hand", "results/multipose.html", "Orientations of"),
    "multipose": ("by-hand", "results/multipose.html", "Length of specific force"),
    "spin": ("robot", "results/spin.html", "spin 1: specific force forward"),
    "redundancy": ("redundant-set", "results/redundancy.html", "Time line"),
}
"""Page of each picture, the report that its commands write, and the beginning of its text for screen
readers."""
COLOURS = {f"var(--{name})": colour for colour, name in PAGE_COLOURS.items()}
FONTS = "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"


def as_file(report: str, label: str) -> str:
    """Returns a figure of a report as a file of its own: with fixed colours, on white."""
    found = re.search(
        rf'<svg viewBox="0 0 ([\d.]+) ([\d.]+)"[^>]*aria-label="{label}.*?</svg>', report, re.DOTALL
    )
    if not found:
        raise LookupError(f"the report has no figure '{label}'")
    width, height = found[1], found[2]
    figure = re.sub(r"var\(--[a-z]+\)", lambda colour: COLOURS[colour[0]], found[0])
    opening, body = figure.split(">", 1)
    return (
        f'{opening} width="{width}" height="{height}" font-family="{FONTS}">'
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>{body}\n'
    )


def main() -> None:
    """Runs the commands of the pages, and writes the pictures."""
    with tempfile.TemporaryDirectory() as place:
        for page in sorted({page for page, _, _ in PICTURES.values()}):
            folder = Path(place) / page
            folder.mkdir()
            for snippet in snippets((PAGES / f"{page}.md").read_text(encoding="utf-8")):
                run(snippet, folder)
        for name, (page, report, label) in PICTURES.items():
            text = (Path(place) / page / report).read_text(encoding="utf-8")
            (IMAGES / f"{name}.svg").write_text(as_file(text, label), encoding="utf-8")
            print(f"docs/images/{name}.svg")


if __name__ == "__main__":
    main()
