"""Settings that contradict each other, in words a user can act on: those of the core, with the values."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Settings = Mapping[str, object]


def explain(figures: Mapping[str, object], settings: Settings) -> str:
    """One line: which settings contradict each other, with their values, and what to do.

    `figures` are those of a `CoreError` of kind `contradictory settings`: setting, objection, and the other
    setting where there are two.
    """
    name, other = str(figures["setting"]), str(figures.get("other", ""))
    return MESSAGES[str(figures["objection"])](_with_value(name, settings), _with_value(other, settings))


def unfit_threshold(unit: str) -> str:
    """One line: a threshold of a unit's own that no unit which can be calibrated exceeds."""
    return (
        f"units: {unit}: accelerometer_threshold or gyroscope_threshold is beyond the largest bias that the "
        "settings allow: what exceeds it is refuted, not calibrated; lower it"
    )


def _with_value(name: str, settings: Settings) -> str:
    return f"{name} is {settings[name]}" if name in settings else name


MESSAGES: dict[str, Callable[[str, str], str]] = {
    "not positive": lambda it, _: f"{it}; it needs to be above 0",
    "not a share": lambda it, _: f"{it}; it needs to be from 0 up to below 1",
    "always exceeded": lambda it, _: (
        f"{it}, which everything exceeds; a ratio needs to be above 1, else above 0"
    ),
    "no last error": lambda it, _: (
        f"{it} and data is compensated, where the primary has no last error; give a value, last+MARGIN, or "
        "data=raw"
    ),
    "shorter than": lambda it, other: f"{it} and {other}; the first needs to be longer",
    "smaller than": lambda it, other: f"{it} and {other}; the first needs to be larger",
    "more than fit": lambda it, other: (
        f"{it} and {other}, into which so many windows do not fit; lower the first"
    ),
    "too long": lambda it, most: f"{it}; the monitor counts up to {most} s here; give a shorter time",
    "not a part of a second": lambda it, _: (
        f"{it}; a second needs to be a whole number of windows, as every other second is kept from the fit"
    ),
}
"""By the core's word for what is wrong with a setting."""
