"""A page of recordings keeps few curves, and the bench computes one at a time, whoever clicks how often."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

from tumble.bench.log import bounds
from tumble.bench.log.bounds import MOST_KEPT, Turn, keep_newest


class Curve:
    """A child of an element, which leaves it once it is deleted."""

    def __init__(self, children):
        self._children = children
        children.append(self)

    def delete(self):
        self._children.remove(self)


def test_a_page_keeps_the_newest_curves():
    children = []
    place = SimpleNamespace(default_slot=SimpleNamespace(children=children))
    made = []
    for _ in range(3 * MOST_KEPT):
        made.append(Curve(children))
        keep_newest(place)
        assert children == made[-MOST_KEPT:]


def test_one_curve_is_computed_at_a_time_none_for_a_page_gone(monkeypatch):
    under_way, most = 0, 0

    async def io_bound(compute):
        nonlocal under_way, most
        under_way += 1
        most = max(most, under_way)
        for _ in range(3):
            await asyncio.sleep(0)
        under_way -= 1
        return compute()

    monkeypatch.setattr(bounds.run, "io_bound", io_bound)

    async def asked():
        turn = Turn()
        return await asyncio.gather(
            *(turn.computed(lambda number=number: number, lambda: True) for number in range(5)),
            turn.computed(lambda: 1 / 0, lambda: False),
        )

    assert asyncio.run(asked()) == [0, 1, 2, 3, 4, None]
    assert most == 1
