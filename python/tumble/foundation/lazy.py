"""Packages that import what is asked of them when it is asked: `tumble --help` waits for no numpy."""

from __future__ import annotations

TYPE_CHECKING = False  # as of the package
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any

    Homes = Mapping[str, Iterable[str]]


def attributes(package: str, homes: Homes | Callable[[], Homes]) -> Callable[[str], Any]:
    """Creates the `__getattr__` of a package; `homes` lists the names that each module gives it.

    A function that returns them is called once a name is asked for.
    """
    home_of: dict[str, str] = {}

    def attribute(name: str) -> Any:  # noqa: ANN401 - a name of any module
        if not home_of:
            listed = homes() if callable(homes) else homes
            home_of.update({each: home for home, names in listed.items() for each in names})
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        # It takes longer to import than the package does, until which Control-C shows a traceback.
        from importlib import import_module

        return getattr(import_module(home_of[name]), name)

    return attribute
