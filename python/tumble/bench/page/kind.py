"""Screen of one kind of run that has a place of its own among the screens: its run, or what the next asks."""

from __future__ import annotations

from typing import Literal, TypeAlias

from tumble.bench.page.context import PageContext
from tumble.bench.page.run import PREPARED
from tumble.bench.page.run_form import RunForm
from tumble.bench.page.run_view import RunPanel
from tumble.bench.parts.elements import Label, block, link

KindPart: TypeAlias = Literal["form", "run", "other"]


class KindScreen:
    """See the module; it prepares the kind for whoever holds the bench."""

    def __init__(self, page: PageContext, word: str) -> None:
        self._page = page
        self._word = word
        self._content = block("run-screen")
        self._shown: KindPart | None = None
        self._part: RunForm | RunPanel | None = None

    def update(self) -> None:
        """Shows the run of the kind while there is one, else its form."""
        wanted = self._wanted()
        if wanted != self._shown:
            self._shown = wanted
            self._content.clear()
            with self._content:
                self._part = self._built(wanted)
        if self._part is not None:
            self._part.update()

    def _wanted(self) -> KindPart:
        bench = self._page.bench
        if bench.engine.state not in PREPARED:
            folder = bench.engine.folder
            return "run" if folder is not None and folder.word == self._word else "other"
        is_chosen = bench.choice.word == self._word
        # Only whoever opens the screen chooses by that: what another page chooses later counts.
        return "form" if is_chosen or (self._shown is None and self._page.operates) else "other"

    def _built(self, wanted: KindPart) -> RunForm | RunPanel | None:
        page = self._page
        if wanted == "form":
            if page.bench.choice.word != self._word:
                page.bench.choose(self._word)
            return RunForm(page)
        if wanted == "run":
            return RunPanel(page)
        kind = next(each for each in page.bench.kinds if each.word == self._word)
        with block("screen-head"):
            Label(page.text(kind.title), "title", "h1")
            Label(page.words("Another run is prepared, or under way."), "lead")
        link(page.words("Show it"), "/run", "file-link")
        return None
