"""Messages of pages that come late, by the clock of the page and that of the server."""

from __future__ import annotations

import math

import pytest

from tumble.bench.lateness import MOST_LATE, is_late, measured
from tumble.foundation import clock


class Page:
    """Stands in for a page of NiceGUI."""


def late(page, sent):
    with measured(page, sent):
        return is_late()


@pytest.mark.parametrize("zero", [0.0, -1e6, 3e9])
def test_a_message_is_late_by_the_least_delay_of_its_page(simulated_clock, zero):
    page, other = Page(), Page()

    def now():
        return zero + 1e3 * clock.now()

    assert not late(page, now())
    for delay, expected in ((0.5 * MOST_LATE, False), (1.5 * MOST_LATE, True), (0.0, False)):
        sent = now()
        clock.sleep(delay)
        assert late(page, sent) is expected
        assert not late(other, sent + zero)
    assert not is_late()


def test_a_late_first_message_of_a_page_is_no_measure_of_others(simulated_clock):
    page = Page()
    sent = 1e3 * clock.now()
    clock.sleep(3.0 * MOST_LATE)
    assert not late(page, sent)
    assert not late(page, 1e3 * clock.now())
    assert late(page, sent)


@pytest.mark.parametrize("sent", [None, True, "1", math.nan, math.inf, [1.0], {}])
def test_a_message_without_a_time_is_not_late(sent):
    assert not late(Page(), sent)
