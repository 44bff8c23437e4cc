"""Silence of all units: reported at once, and after a while the end of a session."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from tumble.foundation.words import join
from tumble.tools.record.objections import Objection
from tumble.tools.record.procedure import RecordStep

GONE_AFTER = 30.0
"""s without a word from any unit, after which a session ends with what it has."""


@dataclass(slots=True)
class Absence:
    """Duration of an absence that a session waits for; `clock` is s for which units were listened to."""

    clock: Callable[[], float]
    since: float = field(init=False)
    """s at which it was last there."""

    def __post_init__(self) -> None:
        self.end()

    def end(self) -> None:
        """Reports the end of the absence."""
        self.since = self.clock()

    @property
    def lasts(self) -> bool:
        """Returns whether the absence is longer than a session waits."""
        return self.clock() - self.since > GONE_AFTER


class Silence:
    """Duration for which no unit has sent samples; `clock` is s for which units were listened to."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._absence = Absence(clock)

    def objections(self, step: RecordStep) -> Iterator[Objection]:
        """Reports that all units have disappeared."""
        if any(unit.condition in ("rest", "motion") for unit in step.units):
            self._absence.end()
        elif any(unit.samples for unit in step.units):
            text = f"no unit sends any more; the session ends after {GONE_AFTER:.0f} s, unless one returns"
            yield Objection(join([unit.name for unit in step.units]), f"all gone {self._absence.since}", text)

    @property
    def reason(self) -> str:
        """Reason for the session to end; empty while it may go on."""
        return f"no unit has sent anything for {GONE_AFTER:.0f} s" if self._absence.lasts else ""
