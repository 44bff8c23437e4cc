"""How certain a calibration is to be: `bias 0.001, non-orthogonality 0.01`, in the units of the report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from tumble.errors import ProcedureError
from tumble.numbers import number_of
from tumble.results import TriadName, TriadResult
from tumble.turntable.result import GROUPS, TargetResult
from tumble.units import TRIADS

FORM = f"[accelerometer|gyroscope] {'|'.join(GROUPS)} SIGMA, commas between"
BY_TIME_AT_REST = "bias"
"""What of a gyroscope is found at rest; all else of it in turns. An accelerometer's is all found at rest."""


@dataclass(frozen=True, slots=True)
class GoalTerm:
    """The largest sigma that a group of parameters of a triad may have."""

    triad: TriadName
    group: str
    sigma: float
    """1-sigma: m/s^2 or rad/s for bias, a ratio for scale, deg for angles."""

    @property
    def name(self) -> str:
        """As it is typed, without the number."""
        return f"{self.triad} {self.group}"

    @property
    def needs_turns(self) -> bool:
        """Whether more turns, rather than more time at rest, make it better."""
        return self.triad == "gyroscope" and self.group != BY_TIME_AT_REST


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """How far one term is, of the target that is furthest from it."""

    term: GoalTerm
    unit: str
    """Of the number: `m/s^2`, `rad/s`, `1`, `deg`."""
    sigma: float
    """Infinite while the data do not show it."""
    target: str

    @property
    def ratio(self) -> float:
        """Sigma over what it is to be."""
        return self.sigma / self.term.sigma


@dataclass(frozen=True, slots=True)
class Goal:
    """Terms that all targets have to meet."""

    terms: tuple[GoalTerm, ...]
    text: str
    """As it was typed."""

    @classmethod
    def parse(cls, text: str) -> Goal:
        """Read what is typed; a term without a triad is the accelerometer's.

        Raises `ProcedureError` where it is none.

        >>> [term.name for term in Goal.parse("bias 0.001, gyroscope scale 1e-4").terms]
        ['accelerometer bias', 'gyroscope scale']
        """
        terms = tuple(_term(text, part.split()) for part in text.split(","))
        names = [term.name for term in terms]
        for name in names:
            if names.count(name) > 1:
                raise ProcedureError(f"--until {text}: gives {name} twice; keep one")
        return cls(terms, text)

    def progress(self, targets: Iterable[TargetResult]) -> tuple[GoalProgress, ...]:
        """Say how far each term is; of the worst target that was calibrated."""
        calibrated = [target for target in targets if not target.failure]
        return tuple(_worst(term, calibrated) for term in self.terms)


def _term(text: str, words: list[str]) -> GoalTerm:
    named = [*(["accelerometer"] if words and words[0] not in TRIADS else []), *words]
    sigma = number_of(named[-1]) if named else None
    if len(named) == 3 and named[1] in GROUPS and sigma is not None and 0.0 < sigma < math.inf:
        triad: TriadName = "gyroscope" if named[0] == "gyroscope" else "accelerometer"
        return GoalTerm(triad, named[1], sigma)
    raise ProcedureError(f"--until {text}: expected {FORM}, such as 'bias 0.001, non-orthogonality 0.01'")


def _worst(term: GoalTerm, targets: Iterable[TargetResult]) -> GoalProgress:
    found = [GoalProgress(term, *_sigma(term, target), target.name) for target in targets]
    nothing = GoalProgress(term, "", math.inf, "")
    return max(found, key=lambda each: each.sigma, default=nothing)


def _sigma(term: GoalTerm, target: TargetResult) -> tuple[str, float]:
    triad = target.accelerometer if term.triad == "accelerometer" else target.gyroscope
    parameters = list(_parameters(term, triad))
    if not parameters:
        return "", math.inf
    return parameters[0][0], max(sigma for _, sigma in parameters)


def _parameters(term: GoalTerm, triad: TriadResult | None) -> Iterator[tuple[str, float]]:
    for each in triad.parameters if triad else ():
        if each.name.rpartition(" ")[0] == term.group:
            yield each.unit, each.sigma if each.observable else math.inf
