"""Calibrations at several temperatures become one over temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.calibration.temperature_drift import HIGHEST_ORDER
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CalibratedTriad
from tumble.tools.plateaus import messages
from tumble.tools.plateaus.base import base_of
from tumble.tools.plateaus.constancy import constancies
from tumble.tools.plateaus.fit import Fit, Terms, fit
from tumble.tools.plateaus.observation import BIAS, ELEMENTS, MATRIX, Observation
from tumble.tools.plateaus.order import choose_order
from tumble.tools.plateaus.result import (
    PlateauFacts,
    PlateausResult,
    PolynomialScore,
    Prediction,
    TriadOverTemperature,
)
from tumble.tools.plateaus.sessions import (
    PlateauSession,
    observations,
    sessions_of,
    shares_inherited,
    triads_in,
)
from tumble.tools.plateaus.uncertainty import widened, widenings

Orders = tuple[int, int, int]


def plateaus(
    sources: Sequence[Calibration | Path | str],
    *,
    temperatures: Sequence[float] | None = None,
    reference: float | None = None,
) -> PlateausResult:
    """Makes one calibration over temperature of several of one unit, each at its own temperature.

    A source is a `Calibration` or a file of one, with its covariance, in the order of their recording. Each
    holds at the mean temperature that it states, or at that of `temperatures`, degC, one for each. Bias and
    scale of each axis become polynomials of temperature; non-orthogonality and mounting are fitted as
    constants, and tested for change. M and b hold at `reference`, degC; the middle of the range if not given.

    Raises `TumbleError`, in one line, where a file cannot be read, fewer than three temperatures are given,
    or calibrations are not of one unit, state no covariance or no temperature.

    Method: docs/theory/plateaus.md.
    """
    if isinstance(sources, str | PathLike) or not isinstance(sources, Sequence):
        raise ProcedureError(f"{sources!r}: is one source; give a list of calibrations")
    calibrations = [each if isinstance(each, Calibration) else Calibration.load(each) for each in sources]
    files = ["" if isinstance(each, Calibration) else str(each) for each in sources]
    sessions = sessions_of(calibrations, files, temperatures)
    at = [each.temperature for each in sessions]
    ends = min(at), max(at)
    held_at = 0.5 * (ends[0] + ends[1]) if reference is None else float(reference)
    if not ends[0] <= held_at <= ends[1]:
        raise ProcedureError(
            f"--reference-temperature {held_at:g}: is beyond the plateaus, {ends[0]:.1f} to {ends[1]:.1f} "
            "degC"
        )
    triads = tuple(_triad(sessions, triad, held_at) for triad in triads_in(sessions))
    facts = tuple(
        PlateauFacts(each.name, each.file, each.calibration.hash(), each.temperature, each.spread)
        for each in sessions
    )
    return PlateausResult(
        name=calibrations[0].name,
        serial=next((each.serial for each in calibrations if each.serial), ""),
        reference=held_at,
        range=ends,
        plateaus=facts,
        triads=triads,
        base=base_of(sessions, held_at),
        warnings=(*_left_out(calibrations), *messages.warnings_of(facts, triads)),
        options={
            "reference": reference,
            "temperatures": None if temperatures is None else list(temperatures),
        },
        software=f"tumble {_core.__version__}",
    )


def _left_out(calibrations: Sequence[Calibration]) -> Iterator[str]:
    """Reports a magnetometer that not all calibrations hold."""
    if 0 < sum(each.magnetometer is not None for each in calibrations) < len(calibrations):
        yield messages.MAGNETOMETER_LEFT_OUT


def _triad(
    sessions: Sequence[PlateauSession], triad: CalibratedTriad, reference: float
) -> TriadOverTemperature:
    is_shared = shares_inherited(sessions, triad)
    found = observations(sessions, triad, is_shared=is_shared)
    numbers = [each.plateau for each in sessions]
    ends = min(each.temperature for each in found), max(each.temperature for each in found)
    width = max(ends[1] - reference, reference - ends[0])
    empty = Terms((0, 0, 0), (0, 0, 0), _has_both_legs(found, numbers), reference, width)
    scores = dict(_scores(found, numbers, empty))
    terms = Terms(
        bias=_orders(scores, "bias"),
        scale=_orders(scores, "scale"),
        hysteresis=empty.hysteresis,
        reference=reference,
        width=width,
    )
    whole = fit(found, terms)
    factors = widenings(whole, found)
    covariance = widened(whole, factors)
    missing = ~np.array([each.shown for each in found]).any(axis=0)
    covariance[:ELEMENTS][missing], covariance[:, :ELEMENTS][:, missing] = np.nan, np.nan
    bias, scale, drift_covariance = _arranged(whole, covariance)
    hysteresis, hysteresis_sigma = _hysteresis(whole, covariance)
    return TriadOverTemperature(
        triad=triad,
        reference=reference,
        range=ends,
        M=whole.solution[MATRIX].reshape(3, 3),
        b=whole.solution[BIAS],
        bias=bias,
        scale=scale,
        covariance=drift_covariance,
        hysteresis=hysteresis,
        hysteresis_sigma=hysteresis_sigma,
        chi_square=whole.chi_square,
        degrees_of_freedom=whole.degrees_of_freedom,
        widening=factors,
        orders=scores,
        constancies=tuple(constancies(found, whole.solution[MATRIX].reshape(3, 3))),
        predictions=tuple(_predictions(found, numbers, terms)),
        temperatures=np.array([each.temperature for each in found]),
        legs=np.array([each.leg for each in found]),
        measured=np.array([each.values for each in found]),
        measured_sigma=np.array([np.sqrt(np.diag(each.covariance)) for each in found]),
    )


def _has_both_legs(found: Sequence[Observation], plateaus: Sequence[int]) -> bool:
    """Returns whether a plateau was reached by warming and by cooling, and so shows hysteresis."""
    both = [
        {each.leg for each, number in zip(found, plateaus, strict=True) if number == plateau}
        for plateau in set(plateaus)
    ]
    return any({-1.0, 1.0} <= legs for legs in both)


def _scores(
    found: Sequence[Observation], plateaus: Sequence[int], terms: Terms
) -> Iterator[tuple[str, tuple[PolynomialScore, ...]]]:
    """Yields the scores of all orders for bias and scale of each axis that every session shows.

    Numbers that were stated without any uncertainty, as of a frame, are not fitted.
    """
    x = np.array([terms.x(each.temperature) for each in found])
    legs = np.array([[0.5 * each.leg] for each in found])
    none = np.zeros((len(found), 0))
    shown = np.array([each.shown for each in found]).min(axis=0)
    for axis, name in enumerate("xyz"):
        if shown[BIAS][axis]:
            values, sigma = _biases(found, axis)
            if not sigma.all():
                continue
            yield f"bias {name}", choose_order(x, legs if terms.hysteresis else none, values, sigma, plateaus)
    for axis, name in enumerate("xyz"):
        if shown[3 * axis : 3 * axis + 3].all():
            values, sigma = _scales(found, axis)
            if not sigma.all():
                continue
            yield f"scale {name}", choose_order(x, none, values, sigma, plateaus)


def _biases(found: Sequence[Observation], axis: int) -> tuple[FloatArray, FloatArray]:
    place = BIAS.start + axis
    values = np.array([each.values[place] for each in found])
    return values, np.sqrt([each.covariance[place, place] for each in found])


def _scales(found: Sequence[Observation], axis: int) -> tuple[FloatArray, FloatArray]:
    """(n,) length of a row of M, and its 1-sigma."""
    place = slice(3 * axis, 3 * axis + 3)
    rows = np.array([each.values[place] for each in found])
    lengths = np.linalg.norm(rows, axis=1)
    along = rows / lengths[:, None]
    covariances = np.array([each.covariance[place, place] for each in found])
    return lengths, np.sqrt(np.einsum("ni,nij,nj->n", along, covariances, along))


def _orders(scores: Mapping[str, Sequence[PolynomialScore]], part: str) -> Orders:
    """Chosen order of each axis; 0 where nothing shows it."""
    x, y, z = (
        next((score.order for score in scores.get(f"{part} {axis}", ()) if score.chosen), 0) for axis in "xyz"
    )
    return x, y, z


def _arranged(whole: Fit, covariance: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coefficients a row for each power, and the covariance of [M, b, bias, scale] in that order."""
    terms = list(whole.terms.places())
    p, q = (max((power for of, _, power in terms if of == part), default=0) for part in ("bias", "scale"))
    assert max(p, q) <= HIGHEST_ORDER
    starts = {"bias": ELEMENTS, "scale": ELEMENTS + 3 * p}
    select = np.zeros((ELEMENTS + 3 * (p + q), len(whole.solution)))
    select[:ELEMENTS, :ELEMENTS] = np.eye(ELEMENTS)
    for place, (part, axis, power) in enumerate(terms, start=ELEMENTS):
        if part != "hysteresis":
            select[starts[part] + 3 * (power - 1) + axis, place] = 1.0
    values = select @ whole.solution
    known = np.isfinite(np.diag(covariance))
    arranged = select @ np.where(np.outer(known, known), covariance, 0.0) @ select.T
    lost = np.flatnonzero(~known[:ELEMENTS])
    arranged[lost], arranged[:, lost] = np.nan, np.nan
    middle = ELEMENTS + 3 * p
    return values[ELEMENTS:middle].reshape(p, 3), values[middle:].reshape(q, 3), arranged


def _hysteresis(whole: Fit, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(3,) of the bias and its 1-sigma; NaN where it was not fitted."""
    if not whole.terms.hysteresis:
        return np.full(3, np.nan), np.full(3, np.nan)
    return whole.solution[-3:], np.sqrt(np.diag(covariance)[-3:])


def _predictions(found: Sequence[Observation], plateaus: Sequence[int], terms: Terms) -> Iterator[Prediction]:
    """Predicts each session from the plateaus that it is not at, where these still bear the terms, eq. 10."""
    numbers = np.array(plateaus)
    for each, number in zip(found, plateaus, strict=True):
        others = [other for other, at in zip(found, plateaus, strict=True) if at != number]
        rest = numbers[numbers != number]
        if terms.hysteresis and not _has_both_legs(others, rest.tolist()):
            continue
        known = fit(others, terms)
        values, derivatives = known.at(each.temperature, each.leg)
        covariance = np.nan_to_num(each.covariance) + derivatives @ known.covariance @ derivatives.T
        predicted, measured = (of[MATRIX].reshape(3, 3) for of in (values, each.values))
        along = predicted / np.linalg.norm(predicted, axis=1)[:, None]
        of_rows = np.array([covariance[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(3)])
        # Rows that a session did not show are at their ideal values, which predict nothing.
        shown = each.shown[MATRIX].reshape(3, 3).min(axis=1)
        yield Prediction(
            temperature=each.temperature,
            outside=number in (numbers.min(), numbers.max()),
            bias=each.values[BIAS] - values[BIAS],
            bias_sigma=np.sqrt(np.diag(covariance)[BIAS]),
            scale=np.where(shown, np.einsum("ij,ij->i", along, measured - predicted), np.nan),
            scale_sigma=np.where(shown, np.sqrt(np.einsum("ki,kij,kj->k", along, of_rows, along)), np.nan),
        )
