"""Templates and captioned pictures of all pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tumble.foundation.errors import TumbleError
from tumble.foundation.files import PAGE, write_text
from tumble.foundation.translation import language
from tumble.foundation.words import printable
from tumble.report.identity import Identity
from tumble.report.numbers import typeset
from tumble.report.text import VERDICT_SIGNS
from tumble.report.translation import translated_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure and the sentence below it."""

    svg: Markup
    caption: str


Result = TypeVar("Result")
_wanted: ContextVar[bool] = ContextVar("wanted", default=True)


@contextmanager
def without_pages() -> Iterator[None]:
    """Leaves pages unwritten while the block runs: nobody reads those of a million results."""
    token = _wanted.set(False)
    try:
        yield
    finally:
        _wanted.reset(token)


@dataclass(frozen=True, slots=True)
class ResultPage(Generic[Result]):
    """The page of a procedure's result: one HTML file that needs nothing else."""

    package: str
    """Which holds the templates, such as `tumble.procedures.spin.report`."""
    template: str
    gather: Callable[[Result], object]
    """Makes of a result what the template calls `page`."""
    identify: Callable[[Result], Identity]
    """Returns the unit, date and operator of a result."""

    def render(self, result: Result) -> str:
        """Returns the page as HTML."""
        return render(self.package, self.template, self.identify(result), page=self.gather(result))

    def plot(self, result: Result, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        return plot(self.gather(result), figure, type(result).__name__)

    def write(self, result: Result, path: Path) -> None:
        """Writes the page; the file takes its name only once it is whole.

        Raises `OutputError` where it cannot be written; what stood there before is untouched. Nothing is
        written within `without_pages`.
        """
        if _wanted.get():
            write_text(path, self.render(result), PAGE)


def plot(page: object, figure: str | None, owner: str) -> Figure:
    """Draws the figures of a page with matplotlib; `owner` is what errors name.

    Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
    """
    try:
        import_module("matplotlib.figure")
    except ImportError:
        raise TumbleError(
            "plot() needs matplotlib, which is not installed; run pip install 'tumble-imu[plot]', or save() "
            "the page, which has the same figures"
        ) from None
    from tumble.report.matplotlib_figure import drawn

    return drawn(page, figure, owner)


def render(package: str, template: str, identity: Identity, **values: object) -> str:
    """Fills a template of a package, such as `tumble.procedures.spin.report`, in the context's language.

    Signs of text from outside that steer a terminal, or turn the direction of what follows, are escaped.
    """
    stated = {"identity": identity, "language": language()}
    page = _environment(package).get_template(template).render(values | stated)
    return printable(translated_page(page, identity.names, package.split(".")[-2]))


@cache
def _environment(package: str) -> Environment:
    found = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("tumble.report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters["typeset"] = typeset
    found.globals["verdict_signs"] = VERDICT_SIGNS
    return found
