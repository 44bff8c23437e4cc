"""List every procedure in the documentation site: its page, its function and its result.

A hook of mkdocs, named in `mkdocs.yml`. Pages stand in the list of pages under `Calibrate and measure`,
functions and results take the place of `<!-- procedures -->` and `<!-- results of procedures -->`.
"""

from __future__ import annotations

from mkdocs.config.defaults import MkDocsConfig

from tumble.foundation.procedures import PROCEDURES

SHELF = "Calibrate and measure"
PLACES = {
    "<!-- procedures -->": [procedure.word for procedure in PROCEDURES],
    "<!-- results of procedures -->": [procedure.result for procedure in PROCEDURES],
}
"""Names by the mark that they replace."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the pages into the list, before all else of their shelf."""
    for shelf in shelves(config.nav or []):
        shelf[:0] = [{procedure.title: f"how-to/{procedure.word}.md"} for procedure in PROCEDURES]
    return config


def on_page_markdown(markdown: str, **_: object) -> str:
    """Put functions and results into the page that asks for them."""
    for place, names in PLACES.items():
        markdown = markdown.replace(place, "\n\n".join(f"::: tumble.{name}" for name in names))
    return markdown


def shelves(entries: list[object]) -> list[list[object]]:
    """Find the shelf among entries, and entries of entries."""
    found = []
    for entry in entries:
        for title, below in entry.items() if isinstance(entry, dict) else ():
            if title == SHELF:
                found.append(below)
            elif isinstance(below, list):
                found += shelves(below)
    return found
