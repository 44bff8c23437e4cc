"""Lamp of a unit: a shape and a word beside its colour, so that colour never stands alone."""

from __future__ import annotations

from tumble.bench.parts.elements import Label, set_class
from tumble.foundation.message import Message, message

CONDITIONS: dict[str, Message] = {
    "waiting": message("waiting"),
    "rest": message("still"),
    "motion": message("moves"),
    "silent": message("silent"),
    "lost": message("lost"),
    "good": message("good"),
    "warning": message("look at it"),
    "faulty": message("faulty"),
}
"""Word beside the lamp, by the state."""
_SIGNS = {
    **{"waiting": "○", "rest": "■", "motion": "◆", "silent": "✕", "lost": "✕"},
    **{"good": "✓", "warning": "▲", "faulty": "✕"},
}
_KINDS = {
    **{"waiting": "idle", "rest": "good", "motion": "busy", "silent": "bad", "lost": "bad"},
    **{"good": "good", "warning": "warn", "faulty": "bad"},
}


class Lamp(Label):
    """A sign in a colour."""

    def __init__(self) -> None:
        super().__init__("○", "lamp")
        self._props["aria-hidden"] = "true"
        self._state = ""

    def show(self, state: str) -> None:
        """Shows a state of a source or of a unit."""
        if state != self._state:
            set_class(self, _KINDS.get(self._state, "idle"), False)
            self._state = state
            set_class(self, _KINDS[state], True)
            super().show(_SIGNS[state])
