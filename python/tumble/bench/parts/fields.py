"""Fields of a form, each with its label: native ones, which keys, screen readers and tablets know."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from tumble.bench.parts.elements import Text, block

Take = Callable[[str], object]
"""Takes what was typed or chosen."""


def text_field(
    label: str, value: str, take: Take, *, help_text: str = "", classes: str = "", hidden_label: bool = False
) -> Element:
    """Adds a field of text; `take` gets what stands there when it is left, or after Enter."""
    with block(f"field {classes}".strip()):
        element = _input(label, hidden_label)
        element._props |= {"type": "text", "value": value, "autocomplete": "off", "spellcheck": "false"}
        _on_change(element, take)
        _help(element, help_text)
    return element


def number_field(
    label: str,
    value: float | None,
    take: Take,
    *,
    unit: str = "",
    least: float | None = None,
    most: float | None = None,
    help_text: str = "",
) -> Element:
    """Adds a field of a number."""
    with block("field"):
        element = _input(f"{label} ({unit})" if unit else label, False)
        element._props |= {"type": "number", "value": "" if value is None else f"{value:g}", "step": "any"}
        for name, bound in (("min", least), ("max", most)):
            if bound is not None:
                element._props[name] = f"{bound:g}"
        _on_change(element, take)
        _help(element, help_text)
    return element


def choice_field(
    label: str,
    choices: Sequence[tuple[str, str]],
    value: str,
    take: Take,
    *,
    help_text: str = "",
    hidden_label: bool = False,
) -> Element:
    """Adds a field in which one of several is chosen; `choices` are values and their texts."""
    with block("field"):
        element = _labelled("select", label, hidden_label)
        with element:
            for key, text in choices:
                option = Text(text, tag="option")
                option._props["value"] = key
                if key == value:
                    option._props["selected"] = True
        _on_change(element, take)
        _help(element, help_text)
    return element


def flag_field(label: str, value: bool, take: Callable[[bool], object], *, help_text: str = "") -> Element:
    """Adds a field that is ticked or not."""
    with block("field flag"), block("flag-row", "label"):
        element = Element("input")
        element._props |= {"type": "checkbox", "checked": value}
        element.on("change", lambda event: take(bool(event.args)), js_handler="(e) => emit(e.target.checked)")
        with block():
            Text(label, tag="span")
            if help_text:
                Text(help_text, "help")
    return element


def _input(label: str, hidden_label: bool) -> Element:
    return _labelled("input", label, hidden_label)


def _labelled(tag: str, label: str, hidden_label: bool) -> Element:
    name = Text(label, "visually-hidden" if hidden_label else "", tag="label")
    element = Element(tag)
    name._props["for"] = element.html_id
    return element


def _on_change(element: Element, take: Take) -> None:
    def taken(event: GenericEventArguments) -> None:
        element._props["value"] = str(event.args)
        take(str(event.args))

    element.on("change", taken, js_handler="(e) => emit(e.target.value)")


def _help(element: Element, text: str) -> None:
    if text:
        element._props["aria-describedby"] = Text(text, "help").html_id
