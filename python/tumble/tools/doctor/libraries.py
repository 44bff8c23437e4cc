"""Which libraries are installed, in which version, and whether they can be imported."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module, metadata

from tumble.tools.doctor.result import Diagnosed, State

PACKAGE = "tumble-imu"
_REQUIREMENT = re.compile(
    r"(?P<name>[\w.-]+)(?:\[[^\]]*\])?\s*(?P<versions>[^;]*)(?:;.*extra == ['\"](?P<extra>[\w-]+)['\"])?"
)
_EARLIER_PYTHON = re.compile(r"python(?:_full)?_version\s*<\s*['\"](?P<version>[\d.]+)['\"]")
_VERSION = re.compile(r"(>=|<)\s*([\d.]+)")


@dataclass(frozen=True, slots=True)
class Requirement:
    """A library as `pyproject.toml` asks for it."""

    name: str
    versions: str
    """`>=0.12,<0.29`; empty where any will do."""
    extra: str
    """Extra with which it comes; empty where it is always needed."""

    def holds(self, version: str) -> bool:
        """Returns whether a version is within the bounds.

        >>> Requirement("typer", ">=0.12,<0.29", "").holds("0.9.1")
        False
        """
        return all(
            (_numbers(version) >= _numbers(bound)) == (sign == ">=")
            for sign, bound in _VERSION.findall(self.versions)
        )


def requirements() -> Iterator[Requirement]:
    """Reads what the installed package asks for."""
    for line in metadata.requires(PACKAGE) or ():
        found = _REQUIREMENT.match(line)
        if found and found["name"] != PACKAGE and _applies(line):
            yield Requirement(found["name"], found["versions"].strip(), found["extra"] or "")


def _applies(line: str) -> bool:
    """Returns whether a requirement is one of this Python: a later one includes some of these libraries."""
    earlier = _EARLIER_PYTHON.search(line)
    return earlier is None or sys.version_info[:2] < _numbers(earlier["version"])


def library(requirement: Requirement, remedy: str) -> Diagnosed:
    """Checks a library: installed, of a suitable version, and importable."""
    name = requirement.name
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return Diagnosed(name, State.MISSING, "not installed", remedy)
    if not requirement.holds(version):
        return Diagnosed(name, State.BROKEN, f"{version}; needed is {requirement.versions}", remedy)
    for module in _modules().get(_normal(name), ()):
        if why := why_not_imported(module):
            return Diagnosed(name, State.BROKEN, f"{version}; {why}", remedy)
    return Diagnosed(name, State.WORKS, version)


def why_not_imported(module: str) -> str:
    """Imports a module; returns the reason of a failure, empty where there is none."""
    try:
        import_module(module)
    except Exception as error:
        return f"import {module}: {' '.join(str(error).split()) or type(error).__name__}"
    return ""


@lru_cache(maxsize=1)
def _modules() -> Mapping[str, list[str]]:
    """Finds the modules that each library brings, those of its own only."""
    found: dict[str, list[str]] = {}
    for module, names in metadata.packages_distributions().items():
        if len(names) == 1 and not module.startswith("_") and module.isidentifier():
            found.setdefault(_normal(names[0]), []).append(module)
    return found


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _numbers(version: str) -> tuple[int, ...]:
    """Returns the numbers of a version, those after its first letter left out."""
    plain = re.match(r"[\d.]*", version)
    return tuple(int(part) for part in (plain[0] if plain else "").split(".") if part)
