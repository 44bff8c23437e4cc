"""Pass or fail: a target's parameters held against the largest magnitudes a limits file allows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from tumble.calibration.budget import Budget
from tumble.calibration.decision import Decision, DecisionRule, Uncertainty, decide
from tumble.foundation.documents import Document, read_document
from tumble.foundation.results import NOT_SHOWN, LimitCheck, TriadResult
from tumble.foundation.schemas import LIMITS
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad, Triad

SCHEMA: Literal["tumble-limits/1"] = "tumble-limits/1"


class Limited(Protocol):
    """A unit to be checked against limits: its calibrated triads, or the reason why there are none.

    `accelerometer`, `gyroscope` and `magnetometer` are those that its procedure calibrates, each a
    `TriadResult`, or None where it could not.
    """

    @property
    def failure(self) -> str:
        """Reason why the unit has no calibration; empty if it has one."""


class _PerAxis(Document):
    """One limit for every axis, written as a number, or one for each axis named."""

    @model_validator(mode="before")
    @classmethod
    def _spread(cls, value: object) -> object:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return dict.fromkeys(cls.model_fields, value)
        if not isinstance(value, Mapping):
            raise ValueError(f"needs a number or a number for each of {', '.join(cls.model_fields)}")  # noqa: TRY004
        return value

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        by_axis = handler.resolve_ref_schema(handler(schema))
        description = by_axis.pop("description", "")
        return {"description": description, "anyOf": [{"type": "number", "minimum": 0}, by_axis]}

    def limits(self) -> dict[str, float]:
        """Limit of each axis that has one."""
        values = ((axis, getattr(self, axis)) for axis in type(self).model_fields)
        return {axis: value for axis, value in values if value is not None}


class PerAxis(_PerAxis):
    """One limit for every axis, or `{x: ..., y: ..., z: ...}`; an axis left out is not checked."""

    x: float | None = Field(default=None, ge=0.0)
    y: float | None = Field(default=None, ge=0.0)
    z: float | None = Field(default=None, ge=0.0)


class PerPair(_PerAxis):
    """One limit for every pair of axes, or `{xy: ..., yz: ..., zx: ...}`; a pair left out is not checked."""

    xy: float | None = Field(default=None, ge=0.0)
    yz: float | None = Field(default=None, ge=0.0)
    zx: float | None = Field(default=None, ge=0.0)


class TriadLimits(Document):
    """Largest magnitudes for three axes; `unit` is m/s^2, rad/s, or uT for the magnetometer."""

    bias: PerAxis | None = None
    """unit"""
    scale: PerAxis | None = None
    """Limit of scale - 1, a ratio: 0.02 is two per cent."""
    non_orthogonality: PerPair | None = Field(default=None, alias="non-orthogonality")
    """deg"""
    mounting: PerAxis | None = None
    """deg, components of the rotation vector."""
    residual: PerAxis | None = None
    """unit, root mean square over the rests, for the gyroscope over the turns too."""
    noise_density: PerAxis | None = Field(default=None, alias="noise-density")
    """unit / sqrt(Hz)"""
    bias_instability: PerAxis | None = Field(default=None, alias="bias-instability")
    """unit"""

    def groups(self) -> dict[str, dict[str, float]]:
        """Limits by field term, then by axis."""
        fields = type(self).model_fields.items()
        found = {field.alias or name: getattr(self, name) for name, field in fields}
        groups = {group: limit.limits() for group, limit in found.items() if limit is not None}
        return {group: limits for group, limits in groups.items() if limits}


class Limits(Document):
    """Largest magnitude of each parameter, as it stands in the file; what is left out is not checked."""

    schema_: Literal["tumble-limits/1"] = Field(default=SCHEMA, alias="schema")
    accelerometer: TriadLimits | None = None
    gyroscope: TriadLimits | None = None
    magnetometer: TriadLimits | None = None
    """Checked by procedures that calibrate magnetometers."""
    decision: DecisionRule | None = None
    """Rule by which uncertainty counts; without one a value within its limit passes."""

    @model_validator(mode="after")
    def _limits_something(self) -> Limits:
        if not any(section.groups() for section in self._sections().values()):
            raise ValueError("limits nothing; give at least one limit, such as accelerometer: {bias: 0.5}")
        return self

    @classmethod
    def load(cls, path: Path | str) -> Limits:
        """Reads a limits file; raises `CalibrationFileError` in one line: file, line, key and remedy."""
        return read_document(path, cls, LIMITS)

    def _sections(self) -> dict[CalibratedTriad, TriadLimits]:
        """Returns the triads that something of is limited."""
        sections: dict[CalibratedTriad, TriadLimits | None] = {
            "accelerometer": self.accelerometer,
            "gyroscope": self.gyroscope,
            "magnetometer": self.magnetometer,
        }
        return {name: section for name, section in sections.items() if section is not None}

    def with_rule(self, rule: DecisionRule) -> Limits:
        """Returns the same limits with a decision rule, where they state none of their own."""
        return self if self.decision is not None else self.model_copy(update={"decision": rule})

    def check(self, target: Limited) -> tuple[LimitCheck, ...]:
        """Checks a target against every limit; empty where the target has no calibration at all.

        A parameter that the data did not show fails: it was not shown to lie within its limit.
        """
        if target.failure:
            return ()
        return tuple(
            check
            for name, section in self._sections().items()
            if hasattr(target, name)
            for check in _check_triad(name, section, getattr(target, name))
        )

    def decide(
        self,
        target: Limited,
        checks: Sequence[LimitCheck],
        budgets: Mapping[Triad, Sequence[Budget]] | None = None,
    ) -> Decision | None:
        """Returns the verdicts on a checked target by the decision rule; None where the file states none.

        U is that of the budget of a parameter, else half of its 95 % interval.
        """
        if self.decision is None:
            return None
        known: dict[str, Uncertainty] = {}
        for name in CALIBRATED_TRIADS:
            triad: TriadResult | None = getattr(target, name, None)
            if triad is not None:
                seen = (each for each in triad.parameters if each.observable)
                known |= {
                    f"{triad.triad} {each.name}": Uncertainty(each.sigma, 0.5 * (each.high - each.low))
                    for each in seen
                }
        for stated_of, found in (budgets or {}).items():
            for budget in found:
                stated = Uncertainty(budget.combined_uncertainty, budget.expanded_uncertainty)
                known[f"{stated_of} {budget.parameter}"] = stated
        return decide(self.decision, checks, known)


def _check_triad(name: CalibratedTriad, section: TriadLimits, triad: TriadResult | None) -> list[LimitCheck]:
    figures = {} if triad is None else _figures(triad)
    missing = f"the {name} was not calibrated" if triad is None else NOT_SHOWN
    checks = []
    for group, limits in section.groups().items():
        for axis, limit in limits.items():
            value, remark = figures.get(f"{group} {axis}", (float("nan"), missing))
            checks.append(
                LimitCheck(
                    parameter=f"{name} {group} {axis}",
                    value=value,
                    limit=limit,
                    unit=_unit(group, CALIBRATED_UNITS[name]),
                    passed=not remark and abs(value) <= limit,
                    remark=remark and f"not shown to be within its limit: {remark}",
                )
            )
    return checks


def _figures(triad: TriadResult) -> dict[str, tuple[float, str]]:
    """Collects what can be limited, by field term and axis, with why it is not known (empty where it is)."""
    figures: dict[str, tuple[float, str]] = {}
    for parameter in triad.parameters:
        if not parameter.observable:
            figures[parameter.name] = (float("nan"), parameter.reason or NOT_SHOWN)
            continue
        ideal = 1.0 if parameter.name.startswith("scale ") else 0.0
        figures[parameter.name] = (parameter.value - ideal, "")
    by_axis = {
        "residual": np.sqrt(np.mean(triad.residuals**2, axis=0))
        if len(triad.residuals)
        else np.full(3, np.nan),
        "noise-density": triad.noise_density,
        "bias-instability": triad.bias_instability,
    }
    for group, values in by_axis.items():
        for axis, value in zip("xyz", values, strict=True):
            figures[f"{group} {axis}"] = (
                float(value),
                "" if np.isfinite(value) else NOT_SHOWN,
            )
    return figures


def _unit(group: str, unit: str) -> str:
    match group:
        case "scale":
            return "1"
        case "non-orthogonality" | "mounting":
            return "deg"
        case "noise-density":
            return f"{unit}/sqrt(Hz)"
        case _:
            return unit
