"""Calibrations of one unit as observations of its triads over temperature."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.calibration.doubts import unmet
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_reading import read_otherwise
from tumble.foundation.recording import FloatArray
from tumble.foundation.serials import refuse_several_units
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad
from tumble.foundation.words import join
from tumble.tools.plateaus import messages
from tumble.tools.plateaus.observation import ELEMENTS, Observation

NEAR = 3.0
"""K within which two sessions are at one plateau."""


@dataclass(frozen=True, slots=True)
class PlateauSession:
    """One calibration and its temperature."""

    calibration: Calibration
    name: str
    file: str
    temperature: float
    """degC."""
    spread: float
    """Highest less lowest within it, K."""
    leg: float
    """1 if the temperature rose from the session before, -1 if it fell, else 0."""
    plateau: int
    """Number of its plateau, the coldest first."""


def sessions_of(
    calibrations: Sequence[Calibration], files: Sequence[str], temperatures: Sequence[float] | None
) -> tuple[PlateauSession, ...]:
    """Puts calibrations and temperatures together.

    Raises `ProcedureError`, in one line, where they are not of one unit and procedure, state no
    temperature, or have too few of them.
    """
    names = [file or each.name for each, file in zip(calibrations, files, strict=True)]
    _refuse_unlike(calibrations, names)
    if temperatures is not None and len(temperatures) != len(calibrations):
        raise ProcedureError(
            f"--temperature is given {len(temperatures)} times for {len(calibrations)} calibrations; give "
            "one for each, in their order"
        )
    at = [
        _temperature(each, name) if temperatures is None else float(temperatures[k])
        for k, (each, name) in enumerate(zip(calibrations, names, strict=True))
    ]
    plateaus = _plateaus(at)
    if (found := len(set(plateaus))) < messages.FEWEST:
        raise ProcedureError(messages.too_few(found))
    return tuple(
        PlateauSession(
            calibration=each,
            name=each.name,
            file=file,
            temperature=at[k],
            spread=0.0 if each.temperature is None else each.temperature.high - each.temperature.low,
            leg=_leg(at, k),
            plateau=plateaus[k],
        )
        for k, (each, file) in enumerate(zip(calibrations, files, strict=True))
    )


def _temperature(calibration: Calibration, name: str) -> float:
    if calibration.temperature is None:
        raise ProcedureError(messages.no_temperature(name))
    return calibration.temperature.mean


def _plateaus(temperatures: Sequence[float]) -> list[int]:
    """Numbers temperatures by plateau, the coldest first."""
    order = np.argsort(temperatures, kind="stable")
    steps = np.diff(np.array(temperatures)[order]) > NEAR
    numbers = np.zeros(len(temperatures), dtype=int)
    numbers[order[1:]] = np.cumsum(steps)
    return [int(each) for each in numbers]


def _leg(temperatures: Sequence[float], k: int) -> float:
    """Returns the direction in which a session was reached; one at the same plateau keeps the leg before."""
    for before in range(k - 1, -1, -1):
        step = temperatures[k] - temperatures[before]
        if abs(step) > NEAR:
            return float(np.sign(step))
    return 0.0


def _refuse_unlike(calibrations: Sequence[Calibration], names: Sequence[str]) -> None:
    refuse_several_units((each.serial for each in calibrations), "calibrations")
    found = {"" if each.method is None else each.method.procedure for each in calibrations}
    if len(found) > 1:
        listed = join(sorted(word or "none stated" for word in found))
        raise ProcedureError(f"are of different procedures, {listed}, whose frames differ; give those of one")
    for (each, name), (other, another) in combinations(zip(calibrations, names, strict=True), 2):
        if _are_one(each, other):
            raise ProcedureError(
                f"{name} and {another} hold the same to the bit, and would count twice; leave one out"
            )
    for each, name in zip(calibrations, names, strict=True):
        for why in read_otherwise(each.log_reading, calibrations[0].log_reading, f"that of {names[0]}"):
            raise ProcedureError(f"its log {why}; give calibrations of logs read alike", about=name)
        if each.axes and calibrations[0].axes and each.axes != calibrations[0].axes:
            raise ProcedureError(
                f"has the axes {each.axes}, {names[0]} {calibrations[0].axes}; give calibrations of logs in "
                "the same axes",
                about=name,
            )
        for doubt in unmet(each):
            raise ProcedureError(f"{doubt}; calibrate again at that temperature, or leave it out", about=name)
        if each.temperature_drifts():
            raise ProcedureError(
                "has a temperature drift already; give the calibrations that it was made of", about=name
            )


def _are_one(one: Calibration, other: Calibration) -> bool:
    """Returns whether two calibrations found the same to the bit, as a file and its copy do."""
    mine, others = dict(one.triads()), dict(other.triads())
    return mine.keys() == others.keys() and all(
        np.array_equal(mine[name].M, others[name].M) and np.array_equal(mine[name].b, others[name].b)
        for name in mine
    )


def triads_in(sessions: Sequence[PlateauSession]) -> Iterator[CalibratedTriad]:
    """Yields triads that every session calibrated.

    Raises `ProcedureError` where some sessions have a triad of the IMU and others have not. A magnetometer
    is left out there, as the field in a chamber may have been disturbed.
    """
    for triad in CALIBRATED_TRIADS:
        having = [getattr(each.calibration, triad) is not None for each in sessions]
        if all(having):
            yield triad
        elif any(having) and triad != "magnetometer":
            lacking = join(
                [each.file or each.name for each, has in zip(sessions, having, strict=True) if not has]
            )
            raise ProcedureError(f"{lacking}: has no {triad}, which others have; leave it out")


def observations(
    sessions: Sequence[PlateauSession], triad: CalibratedTriad, *, is_shared: bool
) -> tuple[Observation, ...]:
    """Returns the observations of a triad; what is inherited is left out where all sessions share it.

    Raises `ProcedureError` where a calibration states no covariance.
    """
    return tuple(
        Observation(
            temperature=each.temperature,
            leg=each.leg,
            values=np.concatenate([section.M.ravel(), section.b]),
            covariance=_covariance(section, each.file or each.name, triad, is_shared=is_shared),
        )
        for each in sessions
        if (section := getattr(each.calibration, triad)) is not None
    )


def _covariance(
    section: TriadCalibration, name: str, triad: CalibratedTriad, *, is_shared: bool
) -> FloatArray:
    found = section.covariance if is_shared else section.total_covariance
    if found is None or not np.isfinite(np.diag(found)).any():
        raise ProcedureError(messages.no_covariance(name, triad))
    assert found.shape == (ELEMENTS, ELEMENTS)
    return found


def shares_inherited(sessions: Sequence[PlateauSession], triad: CalibratedTriad) -> bool:
    """Returns whether all sessions inherit their uncertainty from one source and one reference."""
    sources = set()
    for each in sessions:
        section = getattr(each.calibration, triad)
        reference = each.calibration.reference
        if section is None or section.inherited is None:
            return False
        of = None if reference is None else (reference.name, reference.serial, reference.calibration_hash)
        sources.add((section.inherited.source, of))
    return len(sources) == 1
