"""No text of others becomes a formula of a spreadsheet, whatever separates cells in its country."""

import csv
import io

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tumble.foundation.words import defused

TEXTS = st.text(st.sampled_from("=+-@\uff1d\uff0b\uff0d\uff20;|,\t\n\r \"'x1."), max_size=12)
FORMULAS = tuple("=+-@\uff1d\uff0b\uff0d\uff20")


def is_number(cell):
    try:
        float(cell)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("separator", [",", ";", "|", "\t"])
@example(texts=["\n,="])
@given(texts=st.lists(TEXTS, min_size=1, max_size=3))
def test_no_cell_begins_a_formula(separator, texts):
    file = io.StringIO()
    csv.writer(file).writerow(map(defused, texts))
    for line in file.getvalue().splitlines():
        for row in csv.reader([line], delimiter=separator):
            for cell in row:
                # A part between commas is no cell of a program that separates by other signs.
                begun = cell.lstrip(' "')
                assert not begun.startswith(FORMULAS) or is_number(cell), (texts, cell)


@pytest.mark.parametrize("number", ["-5", "+0.5", "1e-3", "-inf", "nan"])
def test_numbers_stay_as_they_are(number):
    assert defused(number) == number
