"""Fields of a form, each with its label: native ones, which keys, screen readers and tablets know."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from tumble.bench.parts.elements import Label, block

LONGEST = 4096
"""Letters of an answer that are taken."""
Take = Callable[[str], object]
"""Takes what was typed or chosen."""


class Field(Element, component="field.js"):
    """A field of text, of a number, or of one of several."""

    def __init__(self, tag: str, content: str, take: Take, choices: Sequence[tuple[str, str]] = ()) -> None:
        super().__init__()
        listed = [list(each) for each in choices]
        self._props |= {"tag": tag, "content": content, "turn": 0, "choices": listed}
        self._take = take
        self.on("taken", self._taken)

    @property
    def content(self) -> str:
        """Content that was shown, or typed, last."""
        return str(self._props["content"])

    def show(self, content: str) -> None:
        """Replaces what stands in the field, whatever was typed there meanwhile."""
        self._props["content"] = content
        self._props["turn"] += 1
        self.update()

    def _taken(self, event: GenericEventArguments) -> object:
        self._props["content"] = text = str(event.args)[:LONGEST]
        return self._take(text)


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
        text = number_text(value)
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


def flag_field(label: str, value: bool, take: Callable[[bool], object], *, help_text: str = "") -> Field:
    """Adds a field that is ticked or not."""
    with block("field flag"), block("flag-row", "label"):
        field = Field("input", flag_text(value), lambda text: take(bool(text)))
        field._props["type"] = "checkbox"
        with block():
            Label(label, tag="span")
            if help_text:
                Label(help_text, "help")
    return field


def flag_text(value: bool) -> str:
    """Returns the content of a field that is ticked or not."""
    return "true" if value else ""


def number_text(value: float | None) -> str:
    """Returns the content of a field of a number."""
    return "" if value is None else f"{value:g}"


def _labelled(label: str, hidden_label: bool, make: Callable[[], Field]) -> Field:
    name = Label(label, "visually-hidden" if hidden_label else "", tag="label")
    field = make()
    name._props["for"] = field.html_id
    return field


def _help(field: Field, text: str) -> None:
    if text:
        field._props["aria-describedby"] = Label(text, "help").html_id
