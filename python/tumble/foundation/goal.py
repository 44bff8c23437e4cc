"""Goal of a calibration as largest sigmas: `bias 0.001, scale 0.02 %`, in the units of the report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from tumble.foundation.errors import ProcedureError
from tumble.foundation.numbers import number_of
from tumble.foundation.results import GROUPS, Parameter, TriadResult
from tumble.foundation.units import CALIBRATED_UNITS, TRIADS, CalibratedTriad

BY_TIME_AT_REST = "bias"
"""Group of gyroscope parameters that rests show; turns show the others. Rests show all of an
accelerometer."""


class HasParameters(Protocol):
    """One unit and what was found of it; where it has a magnetometer too, that has `parameters`."""

    @property
    def name(self) -> str:
        """Name of the unit."""

    @property
    def accelerometer(self) -> TriadResult | None:
        """None where it was not calibrated."""

    @property
    def gyroscope(self) -> TriadResult | None:
        """None where it was not calibrated."""


@dataclass(frozen=True, slots=True)
class GoalTerm:
    """The largest sigma that a group of parameters of a triad may have."""

    triad: CalibratedTriad
    group: str
    sigma: float
    """1-sigma: m/s^2, rad/s or uT for bias, a ratio for scale, deg for angles."""

    @property
    def name(self) -> str:
        """Name of the term as the user types it, without the number."""
        return f"{self.triad} {self.group}"

    @property
    def needs_turns(self) -> bool:
        """Returns whether the term improves with more turns rather than with more time at rest."""
        return self.triad == "gyroscope" and self.group != BY_TIME_AT_REST


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """Progress of one term, for the unit that is furthest from it."""

    term: GoalTerm
    unit: str
    """Unit of the number: `m/s^2`, `rad/s`, `uT`, `1`, `deg`."""
    sigma: float
    """Infinite while the data do not show it."""
    target: str

    @property
    def ratio(self) -> float:
        """Sigma over what it is to be."""
        return self.sigma / self.term.sigma


@dataclass(frozen=True, slots=True)
class Goal:
    """Terms that all units have to meet."""

    terms: tuple[GoalTerm, ...]
    text: str
    """Goal as typed by the user."""

    @classmethod
    def parse(cls, text: str, triads: Sequence[CalibratedTriad] = TRIADS) -> Goal:
        """Reads what is typed about these triads; a term without a triad is the accelerometer's.

        Raises `ProcedureError` where it is none.

        >>> [(term.name, term.sigma) for term in Goal.parse("bias 0.001, gyroscope scale 0.02 %").terms]
        [('accelerometer bias', 0.001), ('gyroscope scale', 0.0002)]
        """
        terms = tuple(_term(text, part.split(), triads) for part in text.split(","))
        names = [term.name for term in terms]
        for name in names:
            if names.count(name) > 1:
                raise ProcedureError(f"--until {text}: gives {name} twice; keep one")
        return cls(terms, text)

    def progress(self, units: Iterable[HasParameters]) -> tuple[GoalProgress, ...]:
        """Returns the progress of each term, for the worst of the calibrated units."""
        calibrated = list(units)
        return tuple(_worst(term, calibrated) for term in self.terms)


def _term(text: str, words: list[str], triads: Sequence[CalibratedTriad]) -> GoalTerm:
    triad = next((each for each in triads if words and words[0] == each), None)
    named = words if triad is not None else ["accelerometer", *words]
    triad = triad or "accelerometer"
    if len(named) in (3, 4) and named[1] in GROUPS:
        sigma, factor = number_of(named[2]), _factors(triad, named[1]).get("".join(named[3:]))
        if sigma is not None and factor is not None and 0.0 < sigma < math.inf:
            return GoalTerm(triad, named[1], sigma * factor)
    form = f"[{'|'.join(triads)}] {'|'.join(GROUPS)} SIGMA [UNIT], commas between"
    raise ProcedureError(f"--until {text}: expected {form}, such as 'bias 0.001, scale 0.02 %'")


def _factors(triad: CalibratedTriad, group: str) -> Mapping[str, float]:
    """Returns by what a sigma is multiplied for each unit that may stand behind it."""
    match group:
        case "bias":
            return {"": 1.0, CALIBRATED_UNITS[triad]: 1.0}
        case "scale":
            return {"": 1.0, "%": 0.01}
    return {"": 1.0, "deg": 1.0}


def _worst(term: GoalTerm, units: Iterable[HasParameters]) -> GoalProgress:
    found = [GoalProgress(term, *_sigma(term, unit), unit.name) for unit in units]
    nothing = GoalProgress(term, "", math.inf, "")
    return max(found, key=lambda each: each.sigma, default=nothing)


def _sigma(term: GoalTerm, unit: HasParameters) -> tuple[str, float]:
    found = getattr(unit, term.triad, None)
    parameters = list(_parameters(term, () if found is None else found.parameters))
    if not parameters:
        return "", math.inf
    return parameters[0][0], max(sigma for _, sigma in parameters)


def _parameters(term: GoalTerm, parameters: Iterable[Parameter]) -> Iterator[tuple[str, float]]:
    for each in parameters:
        if each.name.rpartition(" ")[0] == term.group:
            yield each.unit, each.sigma if each.observable else math.inf
