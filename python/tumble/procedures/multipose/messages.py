"""Why a triad has no calibration, in words a user can act on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from tumble.foundation.words import count_of

MultiposeFigures: TypeAlias = Mapping[str, Any]
"""Figures of what the core objects to; `shares` is a list, all others are numbers."""

_UNKNOWNS = [
    *(f"response of axis {axis} along {along}" for axis in "xyz" for along in "xyz"),
    *(f"bias {axis}" for axis in "xyz"),
]
"""Unknowns by their place in [M row by row, b]."""

FACES = 6
SIX_FACES = ", or give --faces if it lay on the six faces of a box"
"""Remark where the orientations are as many."""

NOTABLE_SHARE = 0.3
"""Share of an unknown in an unobservable combination, from which it is named."""
MORE_MAY_SHOW = {"no rests", "too few directions", "poses leave open"}
"""Words for what more poses mend."""


def explain(word: str, figures: MultiposeFigures) -> str:
    """One line: what is missing and what to do."""
    return MESSAGES[word](figures)


def tremor_words(tremor: tuple[float, float] | None) -> str:
    """Describes how a unit trembled, by the amplitude of its angular rate, rad/s, and its frequency, Hz."""
    if tremor is None:
        return ""
    amplitude, frequency = tremor
    return f"trembles: {1e3 * amplitude:.2g} mrad/s at {frequency:.2g} Hz"


NO_SENSOR_HAS = (
    "the gyroscope's scale is {scale:.2f} on all axes, which no sensor has: the sample rate is probably "
    "{probable:.4g} Hz, not {rate:.4g} (--rate, --time-unit), or the gyroscope's unit or range is as far off"
)
"""Remark on a wrong time base."""
NOT_RANDOM = (
    "turns are off by {times:.0f} times what noise explains, and nothing shows that the rest is as random: "
    "were samples lost, or is the gyroscope not linear? its sigmas are no measure of its errors"
)
"""Remark on turns whose errors are hardly noise."""


def _too_few_directions(figures: MultiposeFigures) -> str:
    found, needed, rests = (int(figures[key]) for key in ("found", "needed", "rests"))
    if found == 1:
        seen = f"shows one orientation only, in {count_of('rest', rests)}: any nine numbers fit that"
    else:
        seen = (
            f"shows {found} orientations, in {count_of('rest', rests)}; nine unknowns would fit so few "
            "whatever their values"
        )
    return (
        f"{seen}; hold the unit still for 3 s or longer in {needed} different orientations or more, "
        f"15 to 20 are good{SIX_FACES if found == FACES else ''}"
    )


def _faces_missing(figures: MultiposeFigures) -> str:
    missing = ", ".join(figures["missing"])
    return (
        f"shows no rest on {missing}; lay the unit for 3 s or longer on each of six faces, each axis up "
        "(_p) and down (_a), or calibrate without --faces from 10 orientations or more"
    )


def _open(shares: Sequence[float]) -> str:
    """Names what is left open, the largest share first."""
    order = sorted(range(len(shares)), key=lambda place: -shares[place])
    named = [_UNKNOWNS[place] for place in order if shares[place] > NOTABLE_SHARE]
    return ", ".join(named)


MESSAGES: dict[str, Callable[[MultiposeFigures], str]] = {
    "no rests": lambda _: (
        "shows no rest of 1 s or longer; hold the unit still for 3 s or longer in each of 15 to 20 "
        "orientations"
    ),
    "too few directions": _too_few_directions,
    "faces missing": _faces_missing,
    "poses leave open": lambda figures: (
        f"its poses lie almost in a plane or on a cone, and leave open: {_open(figures['shares'])}; add "
        "poses across it, with each axis up, down and in between"
    ),
    "no turns": lambda _: (
        "no turn between two rests was recorded whole, so the gyroscope is not calibrated; turn the unit by "
        "hand between the poses, in one recording"
    ),
    "turns leave open": lambda figures: (
        f"the turns leave open of the gyroscope: {_open(figures['shares'])}; turn about each axis, also "
        "while it is level"
    ),
    "gyroscope contradicts": lambda figures: (
        f"gyroscope and accelerometer disagree by {figures['angle']:.0f} deg about how the unit turned, "
        "whatever the scale; check units and axes of both, and that both belong to one unit"
    ),
    "left-handed gyroscope": lambda _: (
        "the gyroscope's axes are left-handed (two are exchanged, or one has its sign turned); correct it "
        "with --columns or --axes x,y,-z"
    ),
    "axes coincide": lambda _: "two axes read the same; check the columns",
    "unsolvable": lambda _: (
        "no solution: the rests hold values that are not numbers, no noise at all, or lie in a plane"
    ),
}
"""Messages by the word for the reason why there is no calibration."""
