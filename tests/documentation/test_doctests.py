"""Examples of docstrings; pytest's own search would import all modules, and tests twice, in each process."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import tumble

PACKAGE = Path(tumble.__file__).parent


def module_name(path: Path) -> str:
    """Name by which a file of the package is imported."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


EXAMPLES = [
    module_name(path) for path in sorted(PACKAGE.rglob("*.py")) if ">>> " in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_of_docstrings_print_what_they_show(name: str, simulated_clock) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_examples_are_found() -> None:
    assert "tumble.procedures.spin.machine" in EXAMPLES
