"""Fields of a form, each with its label: native ones, which keys, screen readers and tablets know."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from tumble.bench.parts.elements import Label, block

Take = Callable[[str], object]
"""Takes what was typed or chosen."""


class Field(Element, component="field.js"):
    """A field of text, of a number, or of one of several."""

    def __init__(self, tag: str, content: str, take: Take, choices: Sequence[tuple[str, str]] = ()) -> None:
        super().__init__()
        self._props |= {"tag": tag, "content": content, "choices": [list(each) for each in choices]}
        self._take = take
        self.on("taken", self._taken)

    def show(self, content: str) -> None:
        """Replaces what stands in the field."""
        self._props["content"] = content
        self.update()

    def _taken(self, event: GenericEventArguments) -> None:
        self._take(str(event.args))


def text_field(
    label: str, value: str, take: Take, *, help_text: str = "", classes: str = "", hidden_label: bool = False
) -> Field:
    """Adds a field of text; `take` gets what stands there when it is left, or after Enter."""
    with block(f"field {classes}".strip()):
        field = _labelled(label, hidden_label, lambda: Field("input", value, take))
        field._props |= {"type": "text", "autocomplete": "off", "spellcheck": "false"}
        _help(field, help_text)
    return field


def number_field(
    label: str,
    value: float | None,
    take: Take,
    *,
    unit: str = "",
    least: float | None = None,
    most: float | None = None,
    help_text: str = "",
) -> Field:
    """Adds a field of a number."""
    with block("field"):
        text = "" if value is None else f"{value:g}"
        field = _labelled(f"{label} ({unit})" if unit else label, False, lambda: Field("input", text, take))
        field._props |= {"type": "number", "step": "any"}
        for name, bound in (("min", least), ("max", most)):
            if bound is not None:
                field._props[name] = f"{bound:g}"
        _help(field, help_text)
    return field


def choice_field(
    label: str,
    choices: Sequence[tuple[str, str]],
    value: str,
    take: Take,
    *,
    help_text: str = "",
    hidden_label: bool = False,
) -> Field:
    """Adds a field in which one of several is chosen; `choices` are values and their texts."""
    with block("field"):
        field = _labelled(label, hidden_label, lambda: Field("select", value, take, choices))
        _help(field, help_text)
    return field


def flag_field(label: str, value: bool, take: Callable[[bool], object], *, help_text: str = "") -> Element:
    """Adds a field that is ticked or not."""
    with block("field flag"), block("flag-row", "label"):
        element = Element("input")
        element._props |= {"type": "checkbox", "checked": value}
        element.on("change", lambda event: take(bool(event.args)), js_handler="(e) => emit(e.target.checked)")
        with block():
            Label(label, tag="span")
            if help_text:
                Label(help_text, "help")
    return element


def _labelled(label: str, hidden_label: bool, make: Callable[[], Field]) -> Field:
    name = Label(label, "visually-hidden" if hidden_label else "", tag="label")
    field = make()
    name._props["for"] = field.html_id
    return field


def _help(field: Field, text: str) -> None:
    if text:
        field._props["aria-describedby"] = Label(text, "help").html_id
