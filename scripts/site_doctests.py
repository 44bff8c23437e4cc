"""Show the doctests of docstrings as code on the API pages of the documentation site.

Options of doctest are left out. An extension of griffe, named in `mkdocs.yml`.
"""

from __future__ import annotations

import re

import griffe

DOCTEST = re.compile(r"^[ \t]*>>> .*(?:\n[ \t]*\S.*)*", re.MULTILINE)
OPTION = re.compile(r"[ \t]*# doctest: .*")


class Doctests(griffe.Extension):
    """Put a fence around every doctest."""

    def on_object(self, *, obj: griffe.Object, **_: object) -> None:
        """Changes the docstring of an object, once it has been read."""
        if obj.docstring:
            obj.docstring.value = fenced(obj.docstring.value)


def fenced(docstring: str) -> str:
    """Returns a docstring with its doctests as blocks of code."""
    return DOCTEST.sub(lambda found: f"```pycon\n{OPTION.sub('', found[0])}\n```", docstring)
