"""Make the certificate that the documentation shows, as PDF and as a picture of its pages.

`.venv/bin/python scripts/draw_certificate.py`: runs the commands of docs/how-to/laboratory.md; needs a font
with Chinese letters.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import typst
from check_commands import ROOT, run, snippets

PAGE = ROOT / "docs" / "how-to" / "laboratory.md"
PDF = ROOT / "docs" / "images" / "certificate.pdf"
PICTURE = ROOT / "docs" / "images" / "certificate.png"
SETTINGS = {"TUMBLE_LANGUAGE": "en,zh", "SOURCE_DATE_EPOCH": "1795694400"}  # 2026-11-26
PAGES_SIDE_BY_SIDE = """\
#set page(width: auto, height: auto, margin: 6pt, fill: luma(215))
#grid(columns: 2, gutter: 6pt, ..(1, 2).map(page => box(fill: white, image("certificate.pdf", page: page))))
"""


def main() -> None:
    """Runs the commands of the page, and writes both files."""
    os.environ.update(SETTINGS)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for snippet in snippets(PAGE.read_text(encoding="utf-8")):
            run(snippet, folder)
            if "certificate results" in snippet.text:
                break
        PDF.write_bytes((folder / "certificates" / "IMU-0001.pdf").read_bytes())
    compiler = typst.Compiler(PAGES_SIDE_BY_SIDE.encode(), root=str(PDF.parent))
    picture = compiler.compile(format="png", ppi=72.0)
    assert isinstance(picture, bytes)
    PICTURE.write_bytes(picture)
    for path in (PDF, PICTURE):
        print(path.relative_to(ROOT), path.stat().st_size)


if __name__ == "__main__":
    main()
