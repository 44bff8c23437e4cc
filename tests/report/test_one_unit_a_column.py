"""A column of a table has one unit of a quantity; its head bears the unit that all cells share."""

from __future__ import annotations

import html
import re

import pytest

from tumble.report.numbers import MINUS, headed, readable_scale, scales_of

NUMBER = rf"[{MINUS}-]?\d[\d.,]*"
NUMERIC = re.compile(rf"^(?:[xyz]{{1,2}} )?(?:below )?{NUMBER}(?!\w)")
"""Begins a cell that holds numbers: those of an axis, or a bound, too."""
UNIT = re.compile(r"(?<=\d[ )])[ ]?(\(?[numµ]?(?:m/s|rad|deg|s|m|Hz|K)\b[^\s,]*|%|ppm[^\s,]*|°C)")
PREFIXED = re.compile(r"^(\(?)[numµ](?=(?:m/s|rad|s\b|m\b))")
SHARES = {"%", "ppm"}


def units_of(cell):
    return set(UNIT.findall(cell)) if NUMERIC.match(cell) else set()


def quantity_of(unit):
    """Unit without its prefix: of all units of one quantity a column has one."""
    return "1" if unit in SHARES else PREFIXED.sub(r"\1", unit)


def broken(columns):
    """Columns, head and cells, that mix units of a quantity, or repeat one unit in all cells."""
    for head, cells in columns:
        numbers = [cell for cell in cells if NUMERIC.match(cell)]
        units = set().union(*map(units_of, numbers))
        if len({quantity_of(unit) for unit in units}) < len(units):
            yield head, sorted(units)
        elif len(units) == 1 and len(numbers) > 1 and all(map(units_of, numbers)):
            yield head, f"all in {units.pop()}, which its head does not say"


def columns_of_page(page):
    for table in re.findall(r"<table.*?</table>", page, re.DOTALL):
        head, *rows = map(cells_of_row, re.findall(r"<tr.*?</tr>", table, re.DOTALL))
        for place, name in enumerate(head):
            yield name, [row[place] for row in rows if len(row) == len(head)]


def cells_of_row(row):
    cells = re.findall(r"<t[hd]\b[^>]*>(.*?)</t[hd]>", row, re.DOTALL)
    return [" ".join(html.unescape(re.sub(r"<svg.*?</svg>|<[^>]*>", " ", cell)).split()) for cell in cells]


def columns_of_screen(screen):
    lines = screen.splitlines()
    for place, line in enumerate(lines):
        if re.fullmatch(r" *─+ *", line):
            below = lines[place + 1 :]
            rows = below[: next((k for k, each in enumerate(below) if not each.strip()), len(below))]
            starts = [found.start() for found in re.finditer(r"(?<!\S)\S+(?: \S+)*", lines[place - 1])]
            for start, end in zip(starts, [*starts[1:], None], strict=True):
                yield lines[place - 1][start:end].strip(), [row[start:end].strip() for row in rows]


def test_every_column_of_a_page_has_one_unit_of_a_quantity(shown):
    found = 0
    for each in shown.values():
        for name, page in each.pages.items():
            columns = list(columns_of_page(page))
            found += sum(len(units_of(cell)) for _, cells in columns for cell in cells)
            assert list(broken(columns)) == [], name
    assert found > 50


def test_every_column_on_screen_has_one_unit_of_a_quantity(shown):
    found = 0
    for procedure, each in shown.items():
        columns = list(columns_of_screen(each.screen))
        found += sum(len(units_of(cell)) for _, cells in columns for cell in cells)
        assert list(broken(columns)) == [], procedure
    assert found > 100


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        (["0.25 ± 0.01 m/s²", "2.1 ± 0.3 mm/s²"], ["m/s²", "mm/s²"]),
        (["12.7 mrad/s", "3 m", "0.2 rad/s"], ["m", "mrad/s", "rad/s"]),
        (["x 0.2 ± 0.1 %", "z 20 ± 3 ppm"], ["%", "ppm"]),
        (["0.4 m/s², then 2 mm/s²", "3 mm/s²"], ["m/s²", "mm/s²"]),
        (["0.1 deg", "0.2 deg"], "all in deg, which its head does not say"),
    ],
)
def test_the_check_finds_units_that_are_mixed_or_repeated(cells, says):
    assert list(broken([("bias", cells)])) == [("bias", says)]


def test_the_check_passes_cells_of_different_quantities():
    assert (
        list(broken([("value", ["0.2 ± 0.1 m/s²", "3 ± 1 rad/s", "2 %", "none"]), ("n", ["1", "2"])])) == []
    )


def test_all_numbers_of_a_unit_are_in_the_scale_of_the_largest():
    scales = scales_of([("rad/s", 2e-5), ("rad/s", -0.02), ("1", 3e-6), ("m/s^2", float("nan"))])
    assert scales["rad/s"] == readable_scale("rad/s", 0.02)
    assert scales["1"].unit == "ppm"
    assert scales["m/s^2"].unit == "m/s²"
    assert headed("bias", scales) == ("bias", False)
    assert headed("bias", {"rad/s": scales["rad/s"]}) == ("bias, mrad/s", True)
