"""The page of a noise measurement: deviations, terms and what other programs call them."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.foundation.results import NOT_SHOWN
from tumble.foundation.units import Triad
from tumble.foundation.words import length_of_time
from tumble.procedures.noise.keys import NoiseKey, kalibr_keys, vins_keys
from tumble.procedures.noise.report.figures import deviation_figure
from tumble.procedures.noise.report.text import printed_terms, unidentified, used_sentence
from tumble.procedures.noise.result import NoiseResult
from tumble.report.identity import Identity
from tumble.report.numbers import significant
from tumble.report.page import Picture, ResultPage
from tumble.report.text import temperature_sentence


@dataclass(frozen=True, slots=True)
class NoiseTable:
    """Terms of the three axes of a triad, as printed."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]


@dataclass(frozen=True, slots=True)
class NoiseSection:
    """Everything shown of one triad."""

    name: Triad
    picture: Picture
    terms: NoiseTable


@dataclass(frozen=True, slots=True)
class NoisePage:
    """Data for the template of the page."""

    name: str
    verdict: str
    headline: str
    unidentified: tuple[str, ...]
    warnings: tuple[str, ...]
    triads: tuple[NoiseSection, ...]
    kalibr: tuple[NoiseKey, ...]
    vins: tuple[NoiseKey, ...]
    method: tuple[tuple[str, str], ...]


def noise_page(result: NoiseResult) -> NoisePage:
    """Gathers the page."""
    return NoisePage(
        name=result.name,
        verdict=result.verdict,
        headline=used_sentence(result.still),
        unidentified=tuple(unidentified(result)),
        warnings=result.warnings,
        triads=tuple(_section(result, triad) for triad in result.triads),
        kalibr=tuple(kalibr_keys(result)),
        vins=tuple(vins_keys(result)),
        method=_method(result),
    )


def _section(result: NoiseResult, triad: Triad) -> NoiseSection:
    channels = [channel for channel in result.channels if channel.triad == triad]
    words = [term.name for term in channels[0].terms]
    rows = tuple((word, tuple(printed_terms([channel.term(word) for channel in channels]))) for word in words)
    caption = (
        "Points with bars: Allan deviation and its 95 % interval. Lines: the sum of the terms. "
        "Dashed: each term that the record shows."
    )
    return NoiseSection(
        name=triad,
        picture=Picture(deviation_figure(channels, f"allan-{triad}"), caption),
        terms=NoiseTable(("x", "y", "z"), rows),
    )


def _method(result: NoiseResult) -> tuple[tuple[str, str], ...]:
    still = result.still
    fits = ", ".join(
        f"{channel.name} {significant(channel.chi_square, 2)} for {channel.degrees_of_freedom}"
        for channel in result.channels
        if channel.degrees_of_freedom
    )
    return (
        (
            "Deviations",
            "overlapping; intervals by chi-square with equivalent degrees of freedom",
        ),
        (
            "Terms",
            "weighted least squares, none below zero; intervals from the joint covariance",
        ),
        ("Chi-square", fits or NOT_SHOWN),
        (
            "Stretches",
            f"{still.stretches}, the longest of {length_of_time(still.longest)}; {still.gaps} gaps",
        ),
        ("Samples", f"{still.used} of {still.samples} used"),
        ("Temperature", temperature_sentence(result.temperature)),
        ("Sources", ", ".join(result.sources)),
        ("Software", result.software),
    )


def _identity(result: NoiseResult) -> Identity:
    return Identity("Noise", result.name, result.serial, result.provenance, result.software, result.started)


NOISE_REPORT = ResultPage("tumble.procedures.noise.report", "noise.html.j2", noise_page, _identity)
