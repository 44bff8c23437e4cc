"""Plain parts of HTML. Text is always text, whatever a name holds: nothing here takes markup."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui import ui
from nicegui.element import Element

Act = Callable[[], object]


def block(classes: str = "", tag: str = "div", **attributes: str) -> Element:
    """Adds an element, into which others are put with `with`."""
    element = Element(tag)
    if classes:
        element.classes(classes)
    for name, value in attributes.items():
        element._props[name.rstrip("_").replace("_", "-")] = value
    return element


class Label(Element):
    """A text that may change."""

    def __init__(self, text: str = "", classes: str = "", tag: str = "div") -> None:
        super().__init__(tag)
        if classes:
            self.classes(classes)
        self._text = text

    def show(self, text: str) -> None:
        """Shows another text; does nothing where it is the same."""
        if text != self._text:
            self._text = text
            self.update()


def button(text: str, act: Act, classes: str = "", *, label: str = "") -> Element:
    """Adds a button; `label` is its name for those who do not see it, where the text does not do."""
    element = Element("button").classes(f"button {classes}".strip())
    element._props["type"] = "button"
    if label:
        element._props["aria-label"] = label
    with element:
        Label(text, tag="span")
    element.on("click", lambda _: act(), [])
    return element


def link(text: str, target: str, classes: str = "") -> Element:
    """Adds a link within the bench, which keeps the page."""
    element = Element("a").classes(classes)
    element._props["href"] = target
    with element:
        Label(text, tag="span")
    element.on(
        "click", lambda _: ui.navigate.to(target), [], js_handler="(e) => { e.preventDefault(); emit(); }"
    )
    return element


def file_link(text: str, target: str, classes: str = "") -> Element:
    """Adds a link to a file, which opens beside the bench."""
    element = Element("a").classes(classes)
    element._props |= {"href": target, "target": "_blank", "rel": "noopener"}
    with element:
        Label(text, tag="span")
    return element


def set_class(element: Element, name: str, wanted: bool) -> None:
    """Gives an element a class, or takes it."""
    if (name in element._classes) != wanted:
        element.classes(add=name) if wanted else element.classes(remove=name)


def set_state(element: Element, state: str, states: Sequence[str]) -> None:
    """Gives an element one class of several."""
    for each in states:
        set_class(element, each, each == state)


def set_attribute(element: Element, name: str, value: str | bool | None) -> None:
    """Sets an attribute, or removes it."""
    if element._props.get(name) != value:
        if value is None:
            element._props.pop(name, None)
        else:
            element._props[name] = value
        element.update()
