"""Ask every procedure whether a recording can serve it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module

from tumble.foundation.procedures import PROCEDURES
from tumble.foundation.services import Evidence, Service
from tumble.logs.units import FASTEST_HZ, SLOWEST_HZ, is_imu_step


def services_of(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording for all procedures."""
    for procedure in PROCEDURES:
        if procedure.serves:
            yield from import_module(f"{procedure.folder}.serves").services(evidence)


def faults_of(interval: float, stuck: Sequence[str]) -> tuple[str, ...]:
    """Describes faults that rule out every procedure; `interval` is that of samples, s."""
    return (
        *_lacking_rate(interval),
        *(f"{'an' if name.startswith('a') else 'a'} {name} that is not stuck" for name in stuck),
    )


def _lacking_rate(interval: float) -> tuple[str, ...]:
    if is_imu_step(interval):
        return ()
    return (f"{SLOWEST_HZ:g} to {FASTEST_HZ:g} samples a second, {1.0 / interval:.3g} found",)
