"""Packages that import what is asked of them when it is asked: `tumble --help` waits for no numpy."""

from __future__ import annotations

TYPE_CHECKING = False  # as of the package
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any


def attributes(package: str, homes: Mapping[str, Iterable[str]]) -> Callable[[str], Any]:
    """Creates the `__getattr__` of a package; `homes` lists the names that each module gives it."""
    home_of = {name: home for home, names in homes.items() for name in names}

    def attribute(name: str) -> Any:  # noqa: ANN401 - a name of any module
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        # It takes longer to import than the package does, until which Control-C shows a traceback.
        from importlib import import_module

        return getattr(import_module(home_of[name]), name)

    return attribute
