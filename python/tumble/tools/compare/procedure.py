"""Calibrations held against each other, and over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from os import PathLike
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.calibration.turned_axes import in_axes, on_axes
from tumble.foundation.errors import ProcedureError
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad
from tumble.logs.spec import parse_spec
from tumble.tools.compare.chi_square import group_tests, joint_test, largest_of
from tumble.tools.compare.common import (
    ACCELEROMETER,
    brought_to,
    common_temperature,
    in_own_axes,
    turned_to_own_axes,
)
from tumble.tools.compare.history import FEWEST, histories, years_of
from tumble.tools.compare.inheritance import inherited_apart
from tumble.tools.compare.messages import INDEPENDENT, notes_on, temperature_notes, warnings_on
from tumble.tools.compare.motion import motion_errors
from tumble.tools.compare.parameters import differences
from tumble.tools.compare.result import CompareResult, History, Pair
from tumble.tools.compare.source import CalibrationSource, date_of, open_calibration
from tumble.tools.compare.temperature import drift_differences
from tumble.tools.compare.unit import UnitModel, unit_model
from tumble.tools.exchange.calibration_parts import TYPICAL

LARGEST_RATE = TYPICAL["gyroscope"]
"""rad/s of the turns that a difference of gyroscopes is stated at."""


def compare(sources: Sequence[CalibrationSource], *, largest_rate: float = LARGEST_RATE) -> CompareResult:
    """Compares the first calibration with each of the others.

    A source is a `Calibration`, a file of one, or a file of another program that `import_calibrations` reads,
    as FILE:NAME where it holds several IMUs. All are brought to one temperature and one frame. Three or more
    of one unit with different dates are also laid over time. `largest_rate`, rad/s, is that of the turns for
    which a difference is stated as an error.

    Raises `TumbleError`, in one line, where a file cannot be read, there are fewer than two, or the rate is
    not above zero.

    Method: docs/theory/compare.md.
    """
    if isinstance(sources, str | PathLike) or not isinstance(sources, Sequence):
        raise ProcedureError(f"{sources!r}: is one source; give a list of two calibrations or more")
    if len(sources) < len(("first", "second")):
        raise ProcedureError("give two calibrations or more")
    if not 0.0 < largest_rate < np.inf:
        raise ProcedureError(f"--turn-rate {largest_rate:g}: give a rate above zero, rad/s")
    opened = [open_calibration(source) for source in sources]
    axes = next((each.axes for each in opened if each.axes), None)
    calibrations = [in_axes(each, axes) for each in opened]
    labels = _labels(sources, calibrations)
    units = [unit_model(*each) for each in zip(calibrations, labels, strict=True)]
    temperatures = {
        triad: temperature
        for triad in CALIBRATED_TRIADS
        if (temperature := common_temperature(calibrations, triad)) is not None
    }
    units = [
        _at(temperatures, unit, calibration) for unit, calibration in zip(units, calibrations, strict=True)
    ]
    own_axes = [ACCELEROMETER in unit.triads and in_own_axes(unit) for unit in units]
    framed = [own for own, unit in zip(own_axes, units, strict=True) if ACCELEROMETER in unit.triads]
    turned = any(framed) and not all(framed)
    if turned:
        units = [turned_to_own_axes(unit) for unit in units]

    def pair_with(k: int) -> Pair:
        both = calibrations[0], calibrations[k]
        models = units[0], units[k]
        if apart := inherited_apart(*both):
            whole = [
                _at(temperatures, unit_model(each, unit.label, apart), each)
                for each, unit in zip(both, models, strict=True)
            ]
            first, second = (turned_to_own_axes(unit) if turned else unit for unit in whole)
            models = first, second
        return _pair(both, models, temperatures, largest_rate, turned)

    pairs = [pair_with(k) for k in range(1, len(units))]
    dates = tuple(date_of(each) for each in calibrations)
    history, history_notes = _history(calibrations, units, dates, own_axes=any(framed))
    return CompareResult(
        names=tuple(labels),
        files=tuple("" if isinstance(source, Calibration) else str(source) for source in sources),
        serials=tuple(each.serial for each in calibrations),
        dates=dates,
        pairs=tuple(pairs),
        history=history,
        notes=(
            INDEPENDENT,
            *(notice for each in opened for notice in on_axes(each, axes)),
            *temperature_notes(calibrations, labels, temperatures),
            *history_notes,
        ),
        warnings=tuple(
            warning
            for each, label in zip(calibrations, labels, strict=True)
            for warning in warnings_on(each, label)
        ),
        options={"largest_rate": largest_rate},
        software=f"tumble {_core.__version__}",
    )


def _at(
    temperatures: Mapping[CalibratedTriad, float], unit: UnitModel, calibration: Calibration
) -> UnitModel:
    """Returns a unit at the temperatures of the comparison."""
    for triad, temperature in temperatures.items():
        if (drift := calibration.temperature_drifts((triad,)).get(triad)) is not None:
            unit = brought_to(unit, triad, drift, temperature)
    return unit


def _pair(
    calibrations: tuple[Calibration, Calibration],
    units: tuple[UnitModel, UnitModel],
    temperatures: dict[CalibratedTriad, float],
    largest_rate: float,
    turned: bool,
) -> Pair:
    own_axes = all(in_own_axes(unit) for unit in units)
    found = differences(*units, own_axes=own_axes)
    drifts = [
        row
        for triad, temperature in temperatures.items()
        for row in drift_differences(*calibrations, triad, temperature)
    ]
    return Pair(
        first=units[0].label,
        second=units[1].label,
        differences=(*found.rows, *drifts),
        groups=tuple(group_tests(found)),
        joint=joint_test(found),
        temperature=largest_of(drifts),
        motion=tuple(motion_errors(*units, largest_rate)),
        notes=tuple(notes_on(*calibrations, units, turned=turned)),
    )


def _history(
    calibrations: Sequence[Calibration],
    units: Sequence[UnitModel],
    dates: Sequence[str],
    *,
    own_axes: bool,
) -> tuple[tuple[History, ...], list[str]]:
    """Returns what three calibrations or more show over time, or why they do not."""
    if len(units) < FEWEST:
        return (), []
    if len({each.serial for each in calibrations}) > 1:
        return (), ["nothing is laid over time, as the serials differ"]
    found = tuple(histories(units, years_of(dates), own_axes))
    return found, [] if found else ["nothing is laid over time, as there are no three different dates"]


def _labels(sources: Sequence[CalibrationSource], calibrations: Sequence[Calibration]) -> list[str]:
    """Names each by its file, or itself, with a number where names are alike."""
    labels: list[str] = []
    for source, calibration in zip(sources, calibrations, strict=True):
        wanted = calibration.name if isinstance(source, Calibration) else _name_of(source)
        others = (f"{wanted} ({n})" for n in count(2))
        labels.append(wanted if wanted not in labels else next(each for each in others if each not in labels))
    return labels


def _name_of(source: Path | str) -> str:
    """Returns `vehicle` of `logs/vehicle.params`, `vehicle:imu1` of `logs/vehicle.params:imu1`."""
    spec = parse_spec(source)
    return spec.path.stem if spec.imu is None else f"{spec.path.stem}:{spec.imu}"
