"""Reports: what procedures found, as pages to read and print. Sees results only, never logs.

`write_reports`, `write_spin_page`, `write_redundancy_page` and `figure_overview` draw, and so bring
matplotlib; they are fetched when first asked for, so that `tumble.report.numbers` and the tables of a
notebook do not wait for it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tumble.report.overview import figure_overview
    from tumble.report.pages import write_reports
    from tumble.report.redundancy_page import write_redundancy_page
    from tumble.report.spin_page import write_spin_page

__all__ = ["figure_overview", "write_redundancy_page", "write_reports", "write_spin_page"]

_HOMES = {
    "figure_overview": "tumble.report.overview",
    "write_redundancy_page": "tumble.report.redundancy_page",
    "write_reports": "tumble.report.pages",
    "write_spin_page": "tumble.report.spin_page",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
