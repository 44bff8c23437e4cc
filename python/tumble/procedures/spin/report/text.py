"""Sentences of the page of a spin: results, and their limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from tumble.foundation.gravity import gravity_sentence
from tumble.foundation.results import NOT_SHOWN, Parameter
from tumble.foundation.words import count_of, join
from tumble.procedures.spin.report.parameters import turns_text
from tumble.procedures.spin.result import FULL_TURN, BiasEstimate, Spin, SpinResult, misfit
from tumble.report.numbers import measurement, readable_scale, significant
from tumble.report.text import temperature_sentence


def found_sentence(result: SpinResult) -> str:
    """Describes the biases."""
    match result.accelerometer_bias.observable, result.gyroscope_bias.observable:
        case True, True:
            return "Both biases found."
        case True, False:
            return "Accelerometer bias only."
        case False, True:
            return "Gyroscope bias only."
        case _:
            return "No bias found."


def bias_sentence(name: str, unit: str, bias: BiasEstimate) -> str:
    """Describes a bias with its sigma, or why it is unknown."""
    if not bias.observable:
        return f"{name}: not observable: {bias.reason or NOT_SHOWN}."
    scale = readable_scale(unit, max(abs(float(value)) for value in bias.value))
    figures = [
        f"{axis} {measurement(scale.factor * float(value), scale.factor * float(sigma))}"
        for axis, value, sigma in zip("xyz", bias.value, bias.sigma, strict=True)
    ]
    return f"{name}: {', '.join(figures)} {scale.unit}."


def trust_sentences(result: SpinResult) -> list[str]:
    """Describes the basis of the biases, and their limits."""
    return [
        *_about_the_method(result),
        *_about_the_fit(result),
        *_about_agreement(result),
    ]


def unobserved_sentences(result: SpinResult) -> list[str]:
    """Describes unobservable values of the spins, with reasons; no numbers of ours."""
    shown = {spin.label: (*spin.parameters, spin.slow_turn) for spin in result.spins}
    return [
        f"{_whose(labels, result)}: {join(names)}: {reason or NOT_SHOWN}."
        for reason, names, labels in unobserved(shown)
    ]


def unobserved(
    shown: Mapping[str, Sequence[Parameter]],
) -> Iterator[tuple[str, tuple[str, ...], list[str]]]:
    """Returns, for parameters that spins of these labels do not show: the reason, their names, the labels."""
    by_reason: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for label, parameters in shown.items():
        hidden = [parameter for parameter in parameters if not parameter.observable]
        for reason in dict.fromkeys(parameter.reason for parameter in hidden):
            names = tuple(parameter.name for parameter in hidden if parameter.reason == reason)
            by_reason.setdefault((reason, names), []).append(label)
    return ((reason, names, labels) for (reason, names), labels in by_reason.items())


def _whose(labels: Sequence[str], result: SpinResult) -> str:
    if len(labels) == len(result.spins) > 1:
        return "All spins"
    return join(labels).capitalize()


def spin_sentence(spin: Spin) -> str:
    """Describes the motion of the robot."""
    return (
        f"From {spin.start:.1f} to {spin.end:.1f} s: {count_of('rest', len(spin.rests))} of "
        f"{spin.resting:.1f} s in all; {turns_text(spin)} turns at {significant(spin.rate, 2)} rad/s."
    )


def fit_sentence(spin: Spin) -> str:
    """Describes chi-square, its degrees of freedom, and their meaning."""
    freedom = spin.degrees_of_freedom
    if freedom <= 0 or not math.isfinite(spin.chi_square):
        return "As many parameters as measurements, so that the fit cannot be tested."
    if spin.widening > 1.0:
        return f"{misfit(spin.chi_square, freedom, spin.widening).capitalize()}."
    figures = f"Chi-square {significant(spin.chi_square)} for {freedom} degrees of freedom: "
    return figures + "the model and the noise explain what was measured."


def spin_gravity(result: SpinResult) -> str:
    """Report the gravity used, its source and its uncertainty."""
    return gravity_sentence(result, "the accelerometer bias along the vertical")


def method_lines(result: SpinResult) -> tuple[tuple[str, str], ...]:
    """Returns names and values that a reader needs in order to repeat the procedure."""
    carried = f"sha256 {result.calibration_hash}" if result.calibration_hash else "none"
    options = [(f"Option {name}", _option(value)) for name, value in result.options.items()]
    return (
        ("Procedure", "spin: a robot that stood still and turned on the spot"),
        ("Recording", " · ".join(filter(None, (result.name, result.serial, result.source)))),
        ("Gravity", spin_gravity(result)),
        ("Calibration applied first", carried),
        ("Temperature", temperature_sentence(result.temperature)),
        *options,
        ("Software", result.software or "not stated"),
    )


def _about_the_method(result: SpinResult) -> Iterator[str]:
    if not result.accelerometer_bias.observable:
        return
    whole = [spin for spin in result.spins if spin.method == "level-free" and spin.heading_span >= FULL_TURN]
    if len(whole) == len(result.spins):
        yield (
            "Level-free: over a full turn of heading gravity separates the accelerometer bias from the "
            "tilt of the floor, which need not be level."
        )
    for spin in result.spins:
        if spin.method == "published":
            yield (
                f"{spin.label.capitalize()} has the accelerometer bias by the published method, which holds "
                f"on a level floor only{_because(spin.accelerometer_bias)}."
            )
        elif spin.heading_span < FULL_TURN:
            yield (
                f"{spin.label.capitalize()} is level-free, from less than a full turn"
                f"{_because(spin.accelerometer_bias)}."
            )


def _because(bias: BiasEstimate) -> str:
    return f": {bias.reason}" if bias.reason else ""


def _about_the_fit(result: SpinResult) -> Iterator[str]:
    tested = [spin for spin in result.spins if spin.degrees_of_freedom > 0]
    if not tested:
        return
    contradicted = [spin.label for spin in tested if spin.objections]
    poor = [spin.label for spin in tested if not spin.fits and not spin.objections]
    if contradicted:
        yield f"Rests and turns of {join(contradicted)} contradict each other: see the warnings."
    if poor:
        yield (
            f"The model does not explain all that {join(poor)} measured: the sigmas there are widened by "
            "what is left."
        )
    elif not contradicted:
        yield "The model and the noise explain what was measured."


def _about_agreement(result: SpinResult) -> Iterator[str]:
    agreement = result.agreement
    if not agreement.observable:
        if len(result.spins) == 1:
            yield "A single spin does not show whether another would give the same."
        return
    figures = (
        f"chi-square of the spins against their mean {significant(agreement.value)}, where "
        f"{significant(agreement.low)} to {significant(agreement.high)} is to be expected"
    )
    if agreement.value > agreement.high:
        yield f"The spins differ from each other by more than their sigma: {figures}."
    else:
        yield f"The spins agree: {figures}."


def _option(value: object) -> str:
    match value:
        case bool():
            return "yes" if value else "no"
        case None | "" | []:
            return "not set"
        case _:
            return str(value)
