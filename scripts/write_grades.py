"""Write python/tumble/tools/simulate/grade.py from the lab's grade.rs, or with --check report if it is stale.

A figure of a sensor grade stands in Rust: as a field with its meaning, and in the table of grades. Its
Python form, with types for checkers and editors, is made from there.
"""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Iterator

from made_files import ROOT, write_or_check

SOURCE = ROOT / "crates" / "tumble-lab" / "src" / "simulate" / "grade.rs"
MODULE = ROOT / "python" / "tumble" / "tools" / "simulate" / "grade.py"
LINE = 110

TEXT = '''\
"""Sensor grades, made by scripts/write_grades.py from the lab's `simulate/grade.rs`; edit that instead."""

from __future__ import annotations

from dataclasses import dataclass

from tumble import _core
from tumble.foundation.bounded_json import parse_json


@dataclass(frozen=True, slots=True, kw_only=True)
class TriadGrade:
{triad_meaning}

{triad_fields}

@dataclass(frozen=True, slots=True, kw_only=True)
class Grade:
{meaning}

    name: str
    """One of `grade_names()`, or one's own for a grade made with `dataclasses.replace`."""
{fields}
    @classmethod
    def named(cls, name: str) -> Grade:
        """One of `grade_names()`; raises `ValueError` for another name."""
        figures = parse_json(_core.sensor_grade(name))
        accelerometer = TriadGrade(**figures.pop("accelerometer"))
        gyroscope = TriadGrade(**figures.pop("gyroscope"))
        return cls(name=name, accelerometer=accelerometer, gyroscope=gyroscope, **figures)


def grade_names() -> tuple[str, ...]:
    """Names of the grades there are, best last."""
    return tuple(_core.sensor_grades())
'''


def module_text() -> str:
    """Returns the Python module."""
    source = SOURCE.read_text(encoding="utf-8")
    triad_meaning, triad_fields = body_of(source, "TriadGrade")
    meaning, fields = body_of(source, "SensorGrade")
    return TEXT.format(triad_meaning=triad_meaning, triad_fields=triad_fields, meaning=meaning, fields=fields)


def body_of(source: str, struct: str) -> tuple[str, str]:
    """Returns meaning and fields of a struct as those of a data class."""
    form = rf"((?:^///.*\n)+)(?:^#\[.*\n)+^pub struct {struct} \{{\n((?:^ .*\n)+)"
    found = re.search(form, source, re.MULTILINE)
    if found is None:
        raise SystemExit(f"{SOURCE.name}: no struct {struct} with a meaning")
    lines: list[str] = []
    for meaning, field, kind in re.findall(r"((?:^ +///.*\n)+) +pub (\w+): (\w+),\n", found[2], re.MULTILINE):
        lines += [f"    {field}: {'float' if kind == 'f64' else kind}", *docstring(meaning)]
    return "\n".join(docstring(found[1])), "\n".join([*lines, ""])


def docstring(comment: str) -> Iterator[str]:
    """Returns a doc comment as the lines of a docstring."""
    words = " ".join(line.strip().removeprefix("///").strip() for line in comment.splitlines())
    for line in textwrap.wrap(f'"""{words}"""', LINE - 4, break_on_hyphens=False):
        yield f"    {line}"


if __name__ == "__main__":
    sys.exit(write_or_check([(MODULE, module_text())], __doc__, __file__))
