"""Two results of the registry that are held against each other, of one unit or of two."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, file_link
from tumble.bench.parts.tables import show_table
from tumble.bench.registry_view import ComparedResult, RegistryView
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import message
from tumble.tools.compare.result import CompareResult, Difference, Pair

HEADINGS = {
    "same": (message("The same within what is known"), "✓", "good"),
    "differ": (message("They differ"), "✕", "bad"),
    "cannot be told": (message("Nothing shows whether they differ"), "?", "warn"),
}
"""Words, sign and class of a verdict."""


class Comparison:
    """See the module; hidden until a result is chosen."""

    def __init__(self, page: PageContext, registry: RegistryView) -> None:
        self._page, self._registry = page, registry
        self._chosen: list[ComparedResult] = []
        self._box = block("panel comparison hidden")

    def choose(self, result: ComparedResult) -> None:
        """Chooses a result; the second one is held against the first, a third one begins anew."""
        if result in self._chosen or len(self._chosen) > 1:
            self._chosen = []
        self._chosen.append(result)
        self._show()

    def _show(self) -> None:
        page = self._page
        self._box.classes(remove="hidden")
        self._box.clear()
        with self._box:
            Label(page.words("Comparison"), "section", "h2")
            if len(self._chosen) == 1:
                Label(page.words("{label}: choose another result.", label=self._chosen[0].label), "lead")
            else:
                self._compare()
            button(page.words("Close"), self._close, "small quiet")

    def _close(self) -> None:
        self._chosen = []
        self._box.clear()
        self._box.classes("hidden")

    def _compare(self) -> None:
        try:
            found = self._registry.compared(self._chosen)
        except TumbleError as error:
            Label(self._page.text(message(str(error))), "trouble")
            return
        self._draw(found)

    def _draw(self, found: CompareResult) -> None:
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
            ("Parameter", *(each.label for each in self._chosen), "Difference", "1-sigma", "sigmas"),
            [_cells(each) for each in compared],
            page.words("on the page"),
        )
        first, second = (each.identity for each in self._chosen)
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
