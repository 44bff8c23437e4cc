"""Two results of the registry that are held against each other, of one unit or of two."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeAlias

from nicegui.element import Element

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, file_link
from tumble.bench.parts.tables import show_table
from tumble.bench.registry_view import ComparedResult, RegistryView
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import message
from tumble.tools.compare.result import CompareResult, Difference, Pair

Ask: TypeAlias = Callable[[Callable[[RegistryView], CompareResult]], Awaitable[CompareResult]]
"""Asks the registry beside the page."""
HEADINGS = {
    "same": (message("The same within what is known"), "✓", "good"),
    "differ": (message("They differ"), "✕", "bad"),
    "cannot be told": (message("Nothing shows whether they differ"), "?", "warn"),
}
"""Words, sign and class of a verdict."""


class Comparison:
    """See the module; hidden until a result is chosen."""

    def __init__(self, page: PageContext, ask: Ask) -> None:
        self._page, self._ask = page, ask
        self._chosen: list[ComparedResult] = []
        self._box = block("panel comparison hidden")

    async def choose(self, result: ComparedResult) -> None:
        """Chooses a result; the second one is held against the first, a third one begins anew."""
        if result in self._chosen or len(self._chosen) > 1:
            self._chosen = []
        self._chosen.append(result)
        page = self._page
        self._box.classes(remove="hidden")
        self._box.clear()
        with self._box:
            Label(page.words("Comparison"), "section", "h2")
            label = self._chosen[0].label
            said = Label(page.words("{label}: choose another result.", label=label), "lead")
            place = block()
            button(page.words("Close"), self._close, "small quiet")
        if len(self._chosen) > 1:
            said.show(page.words("Reading the registry …"))
            await self._compare(tuple(self._chosen), said, place)

    def _close(self) -> None:
        self._chosen = []
        self._box.clear()
        self._box.classes("hidden")

    async def _compare(self, chosen: tuple[ComparedResult, ...], said: Label, place: Element) -> None:
        """Shows the comparison at a place, unless others were chosen, or the screen is gone, by then."""
        try:
            found = await self._ask(lambda registry: registry.compared(chosen))
        except TumbleError as error:
            if not said.is_deleted:
                said.classes("trouble").show(self._page.text(message(str(error))))
            return
        if said.is_deleted:
            return
        said.delete()
        with place:
            self._draw(found, chosen)

    def _draw(self, found: CompareResult, chosen: tuple[ComparedResult, ...]) -> None:
        page, (pair,) = self._page, found.pairs
        heading, sign, kind = HEADINGS[pair.verdict]
        with block(f"wrong {kind}", role="status"):
            Label(sign, "wrong-sign")._props["aria-hidden"] = "true"
            Label(page.text(heading), "wrong-name")
            Label(self._farthest(pair), "wrong-why")
        compared = [each for each in pair.differences if each.compared]
        compared.sort(key=lambda each: -abs(each.sigmas))
        show_table(
            page,
            page.words("Parameters, the furthest apart first"),
            ("Parameter", *(each.label for each in chosen), "Difference", "1-sigma", "sigmas"),
            [_cells(each) for each in compared],
            page.words("on the page"),
        )
        first, second = (each.identity for each in chosen)
        with block("file-links"):
            file_link(page.words("Page of the comparison"), f"/compared/{first}/{second}", "file-link")

    def _farthest(self, pair: Pair) -> str:
        most = pair.farthest
        if most is None:
            return ""
        sigmas = f"{abs(most.sigmas):.1f}"
        return self._page.words("most in {name}: {sigmas} sigmas", name=most.name, sigmas=sigmas)


def _cells(each: Difference) -> tuple[str, ...]:
    unit = "" if each.unit == "1" else f" {each.unit}"
    numbers = (f"{each.first:.5g}{unit}", f"{each.second:.5g}{unit}", f"{each.value:+.3g}{unit}")
    return (each.name, *numbers, f"{each.sigma:.2g}", f"{each.sigmas:+.1f}")
