r"""Show bars in code of tables on the documentation site as repositories show them: `a\|b` is `a|b`.

A hook of mkdocs, named in `mkdocs.yml`.
"""

from __future__ import annotations

import re

CELL = re.compile(r"<td\b.*?</td>", re.DOTALL)
CODE = re.compile(r"<code>.*?</code>", re.DOTALL)


def on_page_content(page_html: str, **_: object) -> str:
    """Removes the backslash."""
    return CELL.sub(lambda cell: CODE.sub(lambda code: code[0].replace("\\|", "|"), cell[0]), page_html)
