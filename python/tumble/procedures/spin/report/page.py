"""The page of a spin: what it shows, gathered from the result as text and pictures, and its file."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tumble.foundation.log_time import FROM_START
from tumble.foundation.recording import FloatArray
from tumble.procedures.spin.report import text
from tumble.procedures.spin.report.figures import (
    force_errors,
    heading_figure,
    improvement_figure,
    level_floor_fit,
    noise_radii,
    rates_at_rest,
    scatter_figure,
    time_figure,
)
from tumble.procedures.spin.report.parameters import Methods, Overview, methods, overview, spin_groups
from tumble.procedures.spin.report.sketch import spins_figure, top_view_caption, top_view_figure
from tumble.procedures.spin.result import Spin, SpinResult
from tumble.report.figures import recording_figure
from tumble.report.identity import Identity
from tumble.report.numbers import readable_scale, significant
from tumble.report.page import Picture, ResultPage
from tumble.report.parameters import ParameterGroup
from tumble.report.rests import RestRow, rest_rows

MOST_DRAWN = 4
"""Spins with pictures; of a day with more, the further ones are tables only, or the page grows too heavy."""

_NOT_DRAWN = f"Pictures are drawn of the first {MOST_DRAWN} spins only."
_NO_BLOCKS = "No samples of this spin were kept to draw."


@dataclass(frozen=True, slots=True)
class SpinSection:
    """Everything shown of one spin. Pictures are None where there is nothing to draw."""

    label: str
    anchor: str
    sentence: str
    fit: str
    no_pictures: str
    time: Picture | None
    heading: Picture | None
    scatter: Picture | None
    improvement: Picture | None
    sketch: Picture | None
    groups: tuple[ParameterGroup, ...]
    methods: Methods
    rests: tuple[RestRow, ...]


@dataclass(frozen=True, slots=True)
class Refused:
    """A stretch that is no spin to use."""

    stretch: str
    reason: str


@dataclass(frozen=True, slots=True)
class SpinPage:
    """Data for the template of a spin's page."""

    name: str
    serial: str
    verdict: str
    found: str
    biases: tuple[str, ...]
    trust: tuple[str, ...]
    unobserved: tuple[str, ...]
    warnings: tuple[str, ...]
    overview: Overview | None
    overview_picture: Picture | None
    spins: tuple[SpinSection, ...]
    refused: tuple[Refused, ...]
    recording: Picture | None
    method: tuple[tuple[str, str], ...]


def spin_page(result: SpinResult) -> SpinPage:
    """Gathers the page."""
    result = result.from_start()
    several = len(result.spins) > 1
    return SpinPage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        found=text.found_sentence(result),
        biases=(
            text.bias_sentence("Accelerometer bias", "m/s^2", result.accelerometer_bias),
            text.bias_sentence("Gyroscope bias", "rad/s", result.gyroscope_bias),
        ),
        trust=tuple(text.trust_sentences(result)),
        unobserved=tuple(text.unobserved_sentences(result)),
        warnings=(
            *(f"{spin.label.capitalize()}: {line}" for spin in result.spins for line in spin.warnings),
            *result.warnings,
        ),
        overview=overview(result) if several else None,
        overview_picture=_overview_picture(result) if several else None,
        spins=tuple(
            _section(spin, number, result.gravity, drawn=number <= MOST_DRAWN)
            for number, spin in enumerate(result.spins, start=1)
        ),
        refused=tuple(Refused(f"{start:.1f} to {end:.1f}", why) for start, end, why in result.refused),
        recording=_recording(result),
        method=text.method_lines(result),
    )


def _section(spin: Spin, number: int, gravity: float, *, drawn: bool) -> SpinSection:
    prefix = f"s{number}"
    blocks = drawn and len(spin.blocks.time) > 0
    return SpinSection(
        label=spin.label,
        anchor=prefix,
        sentence=text.spin_sentence(spin),
        fit=text.fit_sentence(spin),
        no_pictures="" if blocks else _NO_BLOCKS if drawn else _NOT_DRAWN,
        time=_time_picture(spin, prefix) if blocks else None,
        heading=_heading_picture(spin, gravity, prefix) if blocks else None,
        scatter=_scatter_picture(spin, prefix) if blocks else None,
        improvement=_improvement_picture(spin, gravity, prefix) if drawn and spin.rests else None,
        sketch=Picture(top_view_figure(spin, f"{prefix}-top"), _sketch_caption(spin)) if drawn else None,
        groups=spin_groups(spin),
        methods=methods(spin, gravity),
        rests=rest_rows([replace(rest, pose=spin.label) for rest in spin.rests], FROM_START),
    )


def _time_picture(spin: Spin, prefix: str) -> Picture:
    return Picture(
        time_figure(spin, f"{prefix}-time"),
        "Rates less bias. A robot that turns about one axis has no rate across it. Shaded: rests used.",
    )


def _heading_picture(spin: Spin, gravity: float, prefix: str) -> Picture:
    if level_floor_fit(spin, gravity) is None:
        level = "The line for a level floor is not drawn: the tilt or the uphill direction is not observable."
    else:
        level = (
            "Line through the points: the fit. Green line: the same on a level floor; it differs from zero "
            "by the acceleration of the lever arm while turning. Where the robot speeds up or slows down "
            "the lines are drawn from the rates of neighbouring segments, which smooths them."
        )
    return Picture(
        heading_figure(spin, gravity, f"{prefix}-heading"),
        f"Means over short segments, all turns over one turn of heading. {level} Filled: turning; hollow: "
        "at rest.",
    )


def _scatter_picture(spin: Spin, prefix: str) -> Picture:
    known = all(radius is not None for radius in noise_radii(spin))
    circles = (
        "Circles: with white noise as in single samples, 95 of 100 means are inside. Points far "
        "outside: the turning axis moved, as on an uneven floor, or the noise is not white."
        if known
        else "The noise of these means is not known, so no circle is drawn."
    )
    return Picture(scatter_figure(spin, f"{prefix}-axis"), circles)


def _improvement_picture(spin: Spin, gravity: float, prefix: str) -> Picture:
    sentences = [
        _before_and_after("|specific force| less gravity", "m/s^2", *force_errors(spin, gravity)[:2]),
        _before_and_after("|angular rate|", "rad/s", *rates_at_rest(spin)[:2]),
        "The biases were found from these same rests, so this shows that they fit, not that they are right.",
    ]
    return Picture(improvement_figure(spin, gravity, f"{prefix}-rest"), " ".join(sentences))


def _before_and_after(quantity: str, unit: str, before: FloatArray, after: FloatArray) -> str:
    raw, left = (float(np.sqrt(np.mean(values**2))) for values in (before, after))
    if not np.isfinite(left):
        return f"Root mean square of {quantity} at rest: not observable with compensation."
    scale = readable_scale(unit, float(np.sqrt(raw * left)))
    figures = [significant(scale.factor * number, 2) for number in (raw, left)]
    return f"Root mean square of {quantity} at rest: {figures[0]} → {figures[1]} {scale.unit}."


def _sketch_caption(spin: Spin) -> str:
    return (
        f"{top_view_caption(spin)} Seen from above. The robot's outline is a symbol; the lever arm is "
        "drawn to a scale of its own, with its 1-sigma ellipse."
    )


def _overview_picture(result: SpinResult) -> Picture:
    return Picture(
        spins_figure(result, "all"),
        "Each spin less the combined value; bars are one sigma, shaded is one sigma of the combined value.",
    )


def _recording(result: SpinResult) -> Picture | None:
    if len(result.trace.time) == 0:
        return None
    rests = [replace(rest, pose=spin.label) for spin in result.spins for rest in spin.rests]
    return Picture(
        recording_figure(result.trace, rests, result.time, "rec"),
        "Means over short segments, as measured. Shaded: rests used, with the spin they belong to.",
    )


def _identity(result: SpinResult) -> Identity:
    return Identity("Spin", result.name, result.serial, result.provenance, result.software, result.time.date)


SPIN_REPORT = ResultPage("tumble.procedures.spin.report", "spin.html.j2", spin_page, _identity)
