"""Values that a command stated, held against the truth: the error of each in its own sigmas."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.honesty.motion import rotation_vector
from benchmarks.honesty.session import AXES, TRIADS, Session, Unit

PAIRS = ((0, 1), (1, 2), (2, 0))
IN_PART = "partly measured"
"""Verdict on a record that shows some of what is asked for; its exit code is none of success."""
SIGMAS_OF_95 = 1.96
SIGMAS_OF_BOUND = 1.645
"""Sigmas of a normal distribution within 95 % on both sides, and on one side."""


@dataclass(frozen=True)
class Answer:
    """Exit code of a command, and what it printed."""

    code: int
    out: str
    err: str


@dataclass(frozen=True)
class Statement:
    """Values that a command stated of a unit, and its words."""

    code: int
    """Exit code."""
    errors: Mapping[str, float]
    """Error of each stated value, in its sigmas, without sign."""
    words: str
    """Warnings and errors, as one line."""
    is_success: bool = False
    """True where the exit code only reports that a part of what is asked for does not show."""


def true_values(unit: Unit) -> dict[str, float]:
    """Parameters of a unit that depend on no frame, by triad and name; angles in deg."""
    values = {}
    for triad, matrix in unit.matrix.items():
        axes = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
        for k, axis in enumerate(AXES):
            values[f"{triad} bias {axis}"] = float(unit.true_bias(triad)[k])
            values[f"{triad} scale {axis}"] = float(np.linalg.norm(matrix[k]))
        for i, j in PAIRS:
            angle = float(np.degrees(np.arcsin(np.clip(axes[i] @ axes[j], -1.0, 1.0))))
            values[f"{triad} non-orthogonality {AXES[i]}{AXES[j]}"] = angle
    return values


def stated_values(folder: Path) -> Iterator[tuple[str, float, float]]:
    """Name, value and sigma of all that the calibration files of a folder state; angles in deg."""
    for path in sorted(folder.glob("*.yaml")):
        content = yaml.safe_load(path.read_text())
        if not str(content.get("schema", "")).startswith("tumble-calibration/"):
            continue
        for triad in TRIADS:
            section = content.get(triad) or {"sigma": {}}
            sigma, angles = section["sigma"], section.get("angles", {}).get("non-orthogonality") or {}
            for k, axis in enumerate(AXES):
                for name, value in (("bias", section.get("b")), ("scale", section.get("K"))):
                    shown = (sigma.get(name) or [None] * 3)[k]
                    if value is not None and shown is not None:
                        yield f"{triad} {name} {axis}", value[k] if name == "bias" else value[k][k], shown
            for pair, shown in (sigma.get("non-orthogonality") or {}).items():
                if shown is not None and angles.get(pair) is not None:
                    yield f"{triad} non-orthogonality {pair}", angles[pair], shown


def of_calibration(session: Session, answer: Answer, folder: Path) -> Statement:
    """Reads the calibration files that a command wrote into a folder."""
    truth = true_values(session.units[-1])
    errors = {
        name: abs(value - truth[name]) / sigma if sigma else np.inf
        for name, value, sigma in stated_values(folder)
    }
    # Warnings end what a command prints; its table before them has words of its own.
    _, mark, warnings = answer.out.partition("Warning: ")
    return Statement(answer.code, errors, f"{answer.err}{mark}{warnings}")


def of_noise(session: Session, answer: Answer, _: Path) -> Statement:
    """Reads the terms of noise that a command printed as JSON.

    Each end of a 95 % interval is 1.96 sigmas off, and beyond it a sigma is that of the mean of both sides,
    as intervals near zero are skewed. A bound is 1.645 sigmas about nothing.
    """
    content = _printed(answer)
    truth, errors = session.units[-1].terms, {}
    for channel in content.get("channels", ()):
        for term in channel["terms"]:
            triad, axis = channel["name"].split()
            true = truth.get((triad, term["name"]))
            if true is None or term["high"] is None:
                continue
            actual, name = float(true[AXES.index(axis)]), f"{channel['name']} {term['name']}"
            errors[name] = (
                _off(actual, term) if term["observable"] else SIGMAS_OF_BOUND * actual / term["high"]
            )
    return _stated(answer, content, errors)


def of_temperature(session: Session, answer: Answer, _: Path) -> Statement:
    """Reads the parameters of drift that a command printed as JSON, at its own reference temperature."""
    content = _printed(answer)
    drift = session.units[-1].thermal
    errors = {}
    for each in content.get("parameters", ()):
        true = drift.get((each["channel"], each["parameter"]))
        if true is not None and each["observable"] and each["sigma"]:
            name = f"{each['channel']} {each['parameter']}"
            errors[name] = abs(each["value"] - true(content["reference"])) / each["sigma"]
    return _stated(answer, content, errors)


def of_alignment(session: Session, answer: Answer, _: Path) -> Statement:
    """Reads rotation, lever arm, clock and differences of the biases that a command printed as JSON.

    A delay that a filter adds belongs to the offset, and to no clock: such an offset is not judged.
    """
    content, errors = _printed(answer), {}
    for unit in content.get("units", ()):
        truth = _alignment(session, unit)
        for each in unit["parameters"]:
            if each["observable"] and each["name"] in truth:
                errors[each["name"]] = abs(each["value"] - truth[each["name"]]) / each["sigma"]
        shows_clock = unit["time_offset_sigma"] is not None
        if shows_clock and not session.units[-1].is_filtered:
            errors["time offset"] = _offset(session.units[-1], unit)
        content["warnings"] = [*content["warnings"], *unit["warnings"]]
    return _stated(answer, content, errors)


def _offset(second: Unit, unit: Mapping[str, Any]) -> float:
    """Error of an offset in sigmas: it may be that of stamps in the mean, or of those that come soonest."""
    late = second.late_at(unit["reference_time"])
    uncertain = np.hypot(unit["time_offset_sigma"], late.std() / np.sqrt(len(late)))
    off = np.array([late.mean(), late.max()]) - unit["time_offset"]
    return float(np.abs(off).min() / uncertain)


def _alignment(session: Session, unit: Mapping[str, Any]) -> dict[str, float]:
    """True values by the names of parameters; the rotation is the one of both its vectors that was stated."""
    first, second = session.units
    between = session.between
    vector = rotation_vector(between.rotation)
    angle = float(np.linalg.norm(vector))
    if vector @ np.array(unit["rotation_vector"]) < 0.0 and angle > 0.5 * np.pi:
        vector = vector * (1.0 - 2.0 * np.pi / angle)
    truth = {"clock skew": between.skew}
    for k, axis in enumerate(AXES):
        truth[f"rotation {axis}"] = float(np.degrees(vector[k]))
        truth[f"lever arm {axis}"] = float(between.lever_arm[k])
        for triad in TRIADS:
            apart = second.true_bias(triad) - second.matrix[triad] @ first.true_bias(triad)
            truth[f"{triad} bias {axis}"] = float(apart[k])
    return truth


STATEMENTS: Mapping[str, Callable[[Session, Answer, Path], Statement]] = {
    "noise": of_noise,
    "thermal": of_temperature,
    "align": of_alignment,
}
"""Reader of what a procedure states, where that is no calibration file of all parameters."""


def answered(session: Session, answer: Answer, folder: Path) -> Statement:
    """Reads what the command of a session stated in its folder of results and on the screen."""
    return STATEMENTS.get(session.procedure, of_calibration)(session, answer, folder)


def _off(actual: float, term: Mapping[str, Any]) -> float:
    """Error of a term with a 95 % interval, in sigmas."""
    value, low, high = (float(term[name]) for name in ("value", "low", "high"))
    outside = max(low - actual, actual - high)
    if outside > 0.0:
        return SIGMAS_OF_95 * (1.0 + 2.0 * outside / (high - low))
    return SIGMAS_OF_95 * (actual - value) / ((high if actual > value else low) - value)


def _printed(answer: Answer) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(answer.out) if answer.out.strip() else {}
    return content


def _stated(answer: Answer, content: Mapping[str, Any], errors: Mapping[str, float]) -> Statement:
    words = " ".join([answer.err, *content.get("warnings", ())])
    return Statement(answer.code, errors, words, content.get("verdict") == IN_PART)
