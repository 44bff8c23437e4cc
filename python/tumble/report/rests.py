"""The table of the rests found in a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.report.numbers import round_like


@dataclass(frozen=True, slots=True)
class RestRow:
    """One rest as printed."""

    number: int
    pose: str
    stretch: str
    samples: int
    specific_force: tuple[str, ...]
    angular_rate: tuple[str, ...]
    used: bool
    remark: str


def rest_rows(rests: Sequence[Rest], time: LogTime) -> tuple[RestRow, ...]:
    """Prints the rests found, numbered from one, with their mean readings to the digits of their sigma."""
    return tuple(
        RestRow(
            number=number,
            pose=rest.pose,
            stretch=time.span(rest.start, rest.end),
            samples=rest.samples,
            specific_force=_to_sigma(rest.specific_force, rest.specific_force_sigma),
            angular_rate=_to_sigma(rest.angular_rate, rest.angular_rate_sigma),
            used=rest.used,
            remark=rest.remark,
        )
        for number, rest in enumerate(rests, start=1)
    )


def _to_sigma(values: FloatArray, sigma: FloatArray) -> tuple[str, ...]:
    return tuple(round_like(float(v), float(s)) for v, s in zip(values, sigma, strict=True))
