"""Samples that did not come: how many, and whether this computer or the way to it lost them."""

from __future__ import annotations

from dataclasses import dataclass

HEAVY_LOSS = 0.02
"""Share of missing samples beyond which what was recorded is not whole."""


@dataclass(frozen=True, slots=True)
class SampleLoss:
    """Samples of one unit that are missing between those that came, and after them."""

    name: str
    """Name of the unit."""
    samples: int
    """That came."""
    missing: int
    """That would fill the gaps in their times, and the times in which none came."""
    unread: int
    """Datagrams that the system dropped because nobody read them in time; of all units of that port."""
    refusal: str = ""
    """Reason why its source was read no further, with the name of the unit; empty where it was."""

    @property
    def is_heavy(self) -> bool:
        """Returns whether the share of missing samples is above `HEAVY_LOSS`, or the source was refused."""
        return bool(self.refusal) or self.missing > HEAVY_LOSS * (self.samples + self.missing)

    def __str__(self) -> str:
        if self.refusal:
            return self.refusal
        share = self.missing / (self.samples + self.missing)
        is_ours = 2 * self.unread >= self.missing
        why = (
            "this computer was too slow to read them; close other programs, or send less often"
            if is_ours
            else "they were lost on the way; check cable, network and what the device can send"
        )
        return f"{self.name}: {self.missing} samples are missing ({100.0 * share:.2g} %): {why}"
