"""When no unit is there any more: said at once, and after a while the end of a session."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from tumble.record.objections import Objection
from tumble.record.procedure import RecordStep
from tumble.words import join

GONE_AFTER = 30.0
"""s without a word from any unit, after which a session ends with what it has."""


@dataclass(slots=True)
class Silence:
    """How long no unit has been heard of; `clock` is s for which units were listened to."""

    clock: Callable[[], float]
    _heard: float = field(init=False)
    """s at which any unit was last there."""

    def __post_init__(self) -> None:
        self._heard = self.clock()

    def objections(self, step: RecordStep) -> Iterator[Objection]:
        """Say that all units are gone that were there."""
        if any(unit.condition in ("rest", "motion") for unit in step.units):
            self._heard = self.clock()
        elif any(unit.samples for unit in step.units):
            text = f"no unit sends any more; the session ends after {GONE_AFTER:.0f} s, unless one returns"
            yield Objection(join([unit.name for unit in step.units]), f"all gone {self._heard}", text)

    @property
    def reason(self) -> str:
        """Why the session is to end; empty while it may go on."""
        lasts = self.clock() - self._heard > GONE_AFTER
        return f"no unit has sent anything for {GONE_AFTER:.0f} s" if lasts else ""
