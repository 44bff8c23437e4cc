"""Noise as filters take it: N and K of a triad, one figure for its three axes, inflated on demand."""

from __future__ import annotations

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.noise_terms import KALIBR as NOISE_NAMES
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.tools.exchange.target import Setting, Settings

RATE = Setting("rate", "samples a second")
INFLATION = Setting(
    "inflation", "factor on the calibration's noise, for errors that a unit at rest does not show", "1"
)
NOISE_SETTINGS = (
    INFLATION,
    *(
        Setting(name.replace("_", "-"), f"{name}, in place of the calibration's", "")
        for triad in TRIADS
        for name in NOISE_NAMES[triad]
    ),
)
NOISE_ONLY = "it holds noise alone: give the program measurements that tumble apply has corrected"
_AT_REST = (
    "noise is that of a unit at rest, and a vehicle adds vibration, aliasing and errors of scale: where the "
    "filter trusts the IMU too much, give --set inflation=10 (OpenVINS advises 10 to 20)"
)


def noise_in_words(settings: Settings) -> str:
    """Returns what the figures of noise are, for the head of a file."""
    factor = settings.positive_number(INFLATION.name)
    inflated = "" if factor == 1.0 else f", {factor:g} times that of the calibration"
    return f"root mean square over the axes{inflated}"


def noise_remarks(settings: Settings) -> tuple[str, ...]:
    """Returns the advice to inflate, where the user has not."""
    return (_AT_REST,) if settings.positive_number(INFLATION.name) == 1.0 else ()


def noise_figures(calibration: Calibration, triad: Triad, settings: Settings) -> list[float]:
    """Returns N and K of a triad as filters need them, root mean square over its axes.

    Raises `ProcedureError` where one is not known, as programs take none that is missing or zero.
    """
    section = getattr(calibration, triad)
    found = (None, None) if section is None else _for_filters(section)
    return [
        _figure(calibration, name, values, settings)
        for name, values in zip(NOISE_NAMES[triad], found, strict=True)
    ]


def _for_filters(section: TriadCalibration) -> tuple[FloatArray | None, FloatArray | None]:
    density, walk = section.noise_density_for_filters, section.random_walk_for_filters
    return (
        section.noise_density if density is None else density,
        section.random_walk if walk is None else walk,
    )


def _figure(calibration: Calibration, name: str, values: FloatArray | None, settings: Settings) -> float:
    typed = name.replace("_", "-")
    if settings.text(typed):
        return settings.positive_number(typed)
    known = np.empty(0) if values is None else values[np.isfinite(values)]
    # Kalibr and what is built on it refuse zero.
    if not known.any():
        raise ProcedureError(
            f"{calibration.name}: {name} is not in the calibration: add it with tumble noise --calibration, "
            f"or give --set {typed}=..."
        )
    return settings.positive_number(INFLATION.name) * float(np.sqrt(np.mean(known**2)))
