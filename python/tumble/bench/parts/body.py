"""A body in 3D, as it stands and as it should."""

from __future__ import annotations

# Registers three.js, which the component imports.
import nicegui.elements.scene  # noqa: F401
from nicegui.element import Element

from tumble.tools.guided.view import BodyView


class Body(Element, component="body.js"):
    """Shows one `BodyView` after another; the picture follows smoothly."""

    def show(self, view: BodyView) -> None:
        """Shows a view."""
        shown_ones = (("now", view.up_now), ("wanted", view.up_wanted), ("attitude", view.turned_now))
        for name, numbers in shown_ones:
            shown = None if numbers is None else [round(each, 4) for each in numbers]
            if self._props.get(name) != shown:
                self._props[name] = shown
