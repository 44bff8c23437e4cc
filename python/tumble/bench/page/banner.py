"""Lines above a screen: somebody asks for the bench, or a run may go on."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, set_class


class Banner:
    """Both lines; empty ones are hidden."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._number = 0
        """Number of the browser that is shown as asking."""
        access = page.bench.access
        self._asked = block("banner")
        with self._asked:
            self._asker = Label("", "banner-text")
            button(page.words("Hand over"), self._hand_over, "small")
            button(page.words("Keep"), lambda: access.keep(page.browser.key), "small quiet")
        self._offered = block("banner")
        with self._offered:
            self._offer = Label("", "banner-text")
            button(page.words("Go on"), page.guarded(page.bench.adopt_offer), "small")
            button(page.words("Leave it"), page.guarded(page.bench.discard_offer), "small quiet")

    def update(self) -> None:
        """Shows what is asked and offered now."""
        page = self._page
        asking, offered = page.bench.access.asking, page.bench.offered
        set_class(self._asked, "shown", asking is not None and page.operates)
        set_class(self._offered, "shown", offered is not None)
        self._number = 0 if asking is None else asking.number
        if asking is not None:
            text = page.words(
                "Browser {number} at {address} asks for the bench.",
                number=asking.number,
                address=asking.address,
            )
            self._asker.show(text)
        if offered is not None:
            self._offer.show(page.words("The run {name} was not finished.", name=offered.path.name))

    def _hand_over(self) -> None:
        page = self._page
        page.bench.access.hand_over(page.browser.key, self._number)
