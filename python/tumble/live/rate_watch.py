"""Rate at which something comes, from its first arrival on."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class RateWatch:
    """Counts arrivals; those that came with the first may have waited, so that counting begins after them."""

    began: float | None = None
    """s of `clock.now()` of the first arrival."""
    count: int = 0

    def push(self, count: int, now: float) -> None:
        """Adds arrivals at an instant, s of `clock.now()`."""
        if count and self.began is None:
            self.began = now
        elif count:
            self.count += count

    def rate(self, now: float) -> float:
        """Returns arrivals a second, Hz, up to an instant; zero where nothing came."""
        return 0.0 if self.began is None or now <= self.began else self.count / (now - self.began)
