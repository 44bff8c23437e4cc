"""Find the home of each public name of the package, for the API pages of the documentation site.

A hook of mkdocs, named in `mkdocs.yml`. `::: tumble.spin` would be the folder of that name: a public name is
looked up where the package itself does. Pages that docstrings name become links.
"""

from __future__ import annotations

import re

from mkdocs.structure.pages import Page

import tumble

PUBLIC_NAME = re.compile(r"^::: tumble\.(\w+)$", re.MULTILINE)
NAMED_PAGE = re.compile(r"(?<![/\w])docs/([a-z-]+/[a-z-]+)\.md")


def on_page_markdown(markdown: str, **_: object) -> str:
    """Points mkdocstrings to the definition of each public name."""
    return PUBLIC_NAME.sub(lambda found: block(found[1]), markdown)


def on_page_content(page_html: str, page: Page, **_: object) -> str:
    """Links the pages that docstrings name as files of the repository."""
    if not page.file.src_uri.startswith("reference/"):
        return page_html
    return NAMED_PAGE.sub(r'<a href="../\1.html">\1</a>', page_html)


def block(name: str) -> str:
    """Directive for a public name, under the name that users write."""
    home = next(module for module, names in tumble._homes().items() if name in names)
    return f"::: {home}.{name}\n    options:\n      heading: tumble.{name}"
