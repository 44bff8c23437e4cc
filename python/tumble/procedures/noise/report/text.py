"""Common wording of page and screen on noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isfinite, isnan

from tumble.foundation.results import Parameter
from tumble.foundation.words import length_of_time
from tumble.procedures.noise.result import ASKED_FOR, NoiseResult, StillPart
from tumble.report.numbers import NOT_OBSERVABLE, Scale, readable_scale, significant


def used_sentence(still: StillPart) -> str:
    """Describes the used part of the logs."""
    logs = "" if still.logs == 1 else f" of {still.logs} logs"
    rate = f"{1.0 / still.interval:.6g} Hz"
    return f"{length_of_time(still.duration)} at rest{logs}, {still.used} samples at {rate}."


def printed_terms(terms: Sequence[Parameter]) -> list[str]:
    """Prints coefficients of one kind with their intervals, or the bounds on them, in one unit."""
    sizes = [term.value if term.observable else term.high for term in terms]
    scale = readable_scale(terms[0].unit, max((size for size in sizes if isfinite(size)), default=0.0))
    return [_printed(term, scale) for term in terms]


def _printed(term: Parameter, scale: Scale) -> str:
    def shown(value: float, digits: int = 3) -> str:
        return significant(scale.factor * value, digits)

    if term.observable:
        return f"{shown(term.value)} ({shown(term.low)} to {shown(term.high)}) {scale.unit}"
    return f"below {shown(term.high, 2)} {scale.unit}" if isfinite(term.high) else NOT_OBSERVABLE


def unidentified(result: NoiseResult) -> Iterator[str]:
    """Describes requested terms that the record does not show, with the remedy, for each triad at once."""
    for triad in result.triads:
        for name in ASKED_FOR:
            hidden = {
                channel.name[-1]: channel.term(name)
                for channel in result.channels
                if channel.triad == triad and not channel.term(name).observable
            }
            if hidden:
                least_known = max(hidden.values(), key=_bound)
                why = least_known.reason.removeprefix("not identifiable: ")
                yield f"{name} of {triad} {', '.join(hidden)}: {why}"


def _bound(term: Parameter) -> float:
    return inf if isnan(term.high) else term.high
