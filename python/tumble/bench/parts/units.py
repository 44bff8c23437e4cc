"""Lamps of the units of a run."""

from __future__ import annotations

import math

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block
from tumble.bench.parts.lamp import CONDITIONS, Lamp
from tumble.tools.guided.view import UnitLamp


class UnitLamps:
    """A lamp, a name, a word and a rate for each unit."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._box = block("lamps", role="list", aria_label=page.words("Units"))
        self._rows: dict[str, tuple[Lamp, Label, Label]] = {}

    def show(self, lamps: tuple[UnitLamp, ...]) -> None:
        """Shows the lamps."""
        if tuple(self._rows) != tuple(lamp.name for lamp in lamps):
            self._build(lamps)
        page = self._page
        for each in lamps:
            lamp, word, rate = self._rows[each.name]
            lamp.show(each.state)
            word.show(page.text(each.text) if each.text else page.text(CONDITIONS[each.state]))
            rate.show("" if math.isnan(each.rate) else f"{each.rate:.4g} Hz")

    def _build(self, lamps: tuple[UnitLamp, ...]) -> None:
        self._box.clear()
        self._rows = {}
        with self._box:
            for each in lamps:
                with block("lamp-row", role="listitem"):
                    lamp = Lamp()
                    Label(each.name, "unit-name")
                    self._rows[each.name] = lamp, Label("", "condition"), Label("", "rate")
