"""Rates that a table was commanded, as truth of gyroscopes: which ones, and how accurate they are."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tumble import _core
from tumble.acquisition.imu import Imu
from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import join
from tumble.poses.pose_list import PoseList
from tumble.procedures.turntable.result import CommandedRates, TruthSource

USUAL_ACCURACY = 100.0
"""ppm, 1-sigma, of the rate of a table where nobody states it: makers promise 10 to 100 over a whole turn."""


def commanded_rates(
    truth: TruthSource, poses: PoseList | None, rates: Sequence[float] | None, accuracy: float | None
) -> CommandedRates | None:
    """Returns the magnitudes given, deg/s, or else those of the pose list; None where not the truth.

    Raises `ProcedureError` where none are known, or what was given is of no use.
    """
    if truth != "table":
        given = [
            name for name, value in (("--rates", rates), ("--rate-accuracy", accuracy)) if value is not None
        ]
        if given:
            raise ProcedureError(f"{join(given)}: used with --truth table only; add that, or leave it out")
        return None
    if rates is None:
        rates = [math.degrees(rate) for rate in poses.rates] if poses else []
    if not rates:
        raise ProcedureError(
            "truth 'table' needs the rates that the table was commanded; give --rates 10,30,60, in deg/s, or "
            "a pose list with rates: [10, 30, 60]"
        )
    for rate in rates:
        if not (math.isfinite(rate) and rate > 0.0):
            raise ProcedureError(
                f"--rates {rate:g}: give magnitudes above zero in deg/s; the reference shows the sign"
            )
    if accuracy is not None and not (math.isfinite(accuracy) and accuracy >= 0.0):
        raise ProcedureError(f"--rate-accuracy {accuracy:g}: give the 1-sigma in ppm, zero or more")
    known = USUAL_ACCURACY if accuracy is None else accuracy
    return CommandedRates(tuple(float(rate) for rate in rates), known, accuracy is None)


def refuse_without_gyroscope(unit: Imu) -> None:
    """Raises `ProcedureError` where the reference has no gyroscope."""
    if "gyroscope" not in unit.triads:
        raise ProcedureError(
            "truth 'table' needs a gyroscope in the reference, which shows when the table turned, about "
            "which axis and which way; name a unit that has one",
            about=unit.name,
        )


def rates_not_shown(commanded: CommandedRates | None, fitted: _core.Reference, name: str) -> Iterator[str]:
    """Describes commanded rates at which the reference never turned."""
    if commanded is None:
        return
    shown = np.degrees(fitted.figures["commanded"])
    lost = [f"{rate:g}" for rate in commanded.rates if not np.isclose(shown, rate).any()]
    if lost:
        yield f"{name}: never turned at the commanded {join(lost)} deg/s for 2 s or longer"
