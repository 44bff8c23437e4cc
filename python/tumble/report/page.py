"""What every page is made with: templates, and pictures with their captions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tumble.report.text import VERDICT_SIGNS, VERDICT_TITLES


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure and the sentence below it."""

    svg: Markup
    caption: str


@cache
def environment(package: str) -> Environment:
    """Give what fills the templates of a package, such as `tumble.spin.report`."""
    found = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("tumble.report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["verdict_signs"] = VERDICT_SIGNS
    found.globals["verdict_titles"] = VERDICT_TITLES
    return found
