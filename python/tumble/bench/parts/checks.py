"""Things to be shown, ticked one by one: a tile each, with a bar and a tick a unit."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, set_attribute, set_class
from tumble.tools.guided.view import CheckGroup, CheckItem

LONG_NAME = 12
"""Letters of a name from which it is written smaller."""


class Checks:
    """Groups of tiles."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._box = block("checks")
        self._names: tuple[tuple[str, ...], ...] = ()
        self._tiles: list[_Tile] = []

    def show(self, groups: tuple[CheckGroup, ...]) -> None:
        """Shows groups; tiles are made anew only where others are wanted."""
        names = tuple(tuple(item.name for item in group.items) for group in groups)
        if names != self._names:
            self._names = names
            self._build(groups)
        for tile, item in zip(self._tiles, (item for group in groups for item in group.items), strict=True):
            tile.show(item)

    def _build(self, groups: tuple[CheckGroup, ...]) -> None:
        self._box.clear()
        self._tiles = []
        with self._box:
            for group in groups:
                Label(self._page.text(group.title), "section", "h2")
                with block("tiles", role="list"):
                    self._tiles += [_Tile(self._page, item.name) for item in group.items]


class _Tile:
    """One thing."""

    def __init__(self, page: PageContext, name: str) -> None:
        self._page = page
        self._shown: CheckItem | None = None
        self._box = block("tile", role="listitem")
        with self._box:
            with block("tile-head"):
                self._sign = Label("○", "tile-sign")
                Label(page.words(name), "tile-name long" if len(name) > LONG_NAME else "tile-name")
            with block("bar"):
                self._bar = block("bar-fill")
            self._detail = Label("", "tile-detail")
            self._units = Label("", "tile-units")

    def show(self, item: CheckItem) -> None:
        """Shows it as it stands."""
        if item == self._shown:
            return
        self._shown = item
        page = self._page
        set_class(self._box, "done", item.done)
        set_class(self._box, "current", item.current and not item.done)
        self._sign.show("✓" if item.done else "◆" if item.current else "○")
        self._bar._style["width"] = f"{100 * item.share:.0f}%"
        self._bar.update()
        self._detail.show(page.text(item.detail))
        lacking = [name for name, done in item.units if not done]
        behind = lacking if 0 < len(lacking) < len(item.units) else []
        self._units.show(page.words("still: {names}", names=", ".join(behind)) if behind else "")
        state = page.words("done") if item.done else page.words("now") if item.current else page.words("open")
        set_attribute(self._box, "aria-label", f"{item.name}: {state}")
