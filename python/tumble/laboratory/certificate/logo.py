"""The logo of a laboratory: a picture whose size is known before a library unpacks it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from struct import error as too_short
from struct import unpack_from
from typing import Final

from lxml import etree

from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import read_whole

LARGEST: Final = 1 << 19
"""Bytes."""
_MOST_PIXELS: Final = 1 << 24
"""Pixels: a page printed at 400 dots per inch has fewer."""
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_JPEG: Final = b"\xff\xd8"
_FRAMES: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of JPEG that state the size of a picture."""
_ALONE: Final = frozenset((*range(0xD0, 0xDA), 0x01))
"""Markers of JPEG that no length follows."""
_DRAWN: Final = frozenset(
    (
        *("svg", "g", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "text", "tspan"),
        *("defs", "linearGradient", "radialGradient", "stop", "style", "title", "desc", "metadata"),
    )
)
"""Elements of SVG that take no more time and memory than they take bytes: none draws another one again."""
_SVG: Final = "http://www.w3.org/2000/svg"
_FILTER: Final = re.compile(r"(?<![\w-])filter(?![\w-])|\\", re.IGNORECASE)
"""Part of a style that computes pictures of any size, or could hide that word by an escape."""
_REMEDY: Final = "give a smaller SVG, PNG or JPEG"


@dataclass(frozen=True, slots=True)
class Logo:
    """A picture that is shown on certificates."""

    path: str
    content: bytes


def load_logo(path: str) -> Logo | None:
    """Returns the logo in a file, SVG, PNG or JPEG; None for no path.

    Raises `TumbleError` for any other file, too many pixels, and more than shapes, text and gradients.
    """
    if not path:
        return None
    content = read_whole(path, LARGEST, "logo", remedy=_REMEDY)
    try:
        pixels = max(_pixels_of(content), default=0)
        stray = None if content.startswith((_PNG, _JPEG)) else next(_strays(content), None)
    except (too_short, ValueError) as error:
        raise TumbleError(f"{path}: is no SVG, PNG or JPEG, or damaged; {_REMEDY}") from error
    if pixels > _MOST_PIXELS:
        raise TumbleError(f"{path}: has {pixels} pixels, more than {_MOST_PIXELS}; {_REMEDY}")
    if stray:
        raise TumbleError(
            f"{path}: {stray}, and a logo has shapes, text and gradients alone; draw it so, or give a PNG"
        )
    return Logo(path, content)


def _pixels_of(content: bytes) -> Iterator[int]:
    """Yields how many pixels each frame of a PNG or JPEG has; raises `ValueError`, or `struct.error`."""
    if content.startswith(_PNG):
        width, height = unpack_from(">4x4x2I", content, len(_PNG))
        yield width * height
    elif content.startswith(_JPEG):
        yield from _frames_of(content)


def _frames_of(content: bytes) -> Iterator[int]:
    """Yields how many pixels each frame of a JPEG has: a decoder may take any of them."""
    place = 0
    while (place := content.find(b"\xff", place)) >= 0:
        marker = content[place + 1] if place + 1 < len(content) else 0
        if marker in (0x00, 0xFF) or marker in _ALONE:
            place += 1
            continue
        if marker in _FRAMES:
            height, width = unpack_from(">2H", content, place + 5)
            yield width * height
        place += 2 + max(2, unpack_from(">H", content, place + 2)[0])


def _strays(content: bytes) -> Iterator[str]:
    """Describes what a logo may not have of an SVG; raises `ValueError` for what is none."""
    parser = etree.XMLParser(encoding="utf-8", resolve_entities="internal", no_network=True, huge_tree=False)
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise ValueError("is no SVG") from error
    if etree.QName(root).localname != "svg":
        raise ValueError("is no SVG")
    for each in root.iter(etree.Element):
        name = etree.QName(each)
        if name.namespace in (None, _SVG) and name.localname not in _DRAWN:
            yield f"line {each.sourceline}: has {name.localname}"
        styles = (each.get("style") or "", "".join(each.itertext()) if name.localname == "style" else "")
        if any(map(_FILTER.search, (*map(str, each.keys()), *styles))):
            yield f"line {each.sourceline}: has a filter"
