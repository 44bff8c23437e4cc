"""Why a magnetometer has no calibration, and what makes one doubtful, in words a user can act on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from tumble import _core
from tumble.foundation.error_decomposition import factors, mounting_angles
from tumble.foundation.log_time import LogTime
from tumble.foundation.words import count_of
from tumble.procedures.magnetometer.result import FieldPoint, MagnetometerResult

MagnetometerFigures: TypeAlias = Mapping[str, Any]
"""Figures of what the core objects to; `shares` is a list, all others are numbers."""

UNKNOWNS = (
    *(f"soft iron {axis}{along}" if axis != along else f"scale {axis}" for axis in "xyz" for along in "xyz"),
    *(f"bias {axis}" for axis in "xyz"),
    *(f"response of axis {axis} to current" for axis in "xyz"),
    "dip",
)
"""Unknowns by their place in the state of the core: M row by row, b, response to current, vertical part."""

NOTABLE_SHARE = 0.3
"""Share of an unknown in an unobservable combination, from which it is named."""
TURN_IT = (
    "turn the unit slowly through all orientations, with each axis up, down and level, in each to several "
    "headings"
)
NO_MAGNETOMETER = (
    "holds no readings of a magnetometer; name columns mx, my, mz with --columns, or a log that has them"
)
NO_CURRENT = (
    "holds neither a current nor a throttle; name its column with --columns current=NAME, or leave out "
    "--current"
)
MOSTLY_CLIPPED = f"less than {100.0 * (1.0 - _core.MOST_LEFT_OUT):.0f} % of its readings follow the field"
CURRENT_IS_STEADY = "the current, or throttle, hardly changes; run the motors at several levels while turning"
OWN_AXES = (
    "the case frame is that of the magnetometer's own axes: no rests with an accelerometer show which way "
    "is up"
)
"""Reason why the mounting is not observable."""
NO_DIP = "nothing shows which way is up"
"""Reason why the dip is not observable."""
TELLING_DIP = 10.0
"""deg, beyond which a dip of the other sign than expected is a left-handed triad, and no disturbance."""
LARGEST_DIP_ERROR = 3.0
"""deg by which the field at a place may differ from that of the model: rock, not iron."""
FEW_TO_CHECK = 4
"""Readings beyond the unknowns, below which hardly anything checks them."""
DECISIVE = 0.95
"""Leverage above which nothing but the rest itself shows what it shows."""
TURNED = 45.0
"""deg of the mounting beyond which its axes are not those of the case by name, or one has its sign turned."""
LITTLE_COVERED = 0.7
"""Share of the sphere below which a fit is an extrapolation for the rest of it."""


def explain(word: str, figures: MagnetometerFigures) -> str:
    """One line: what is missing and what to do."""
    return MESSAGES[word](figures)


def no_rests(word: str, figures: MagnetometerFigures) -> str:
    """Reports why rests do not show which way is up, and so the mounting remains unknown."""
    seen = (
        f"rests show {count_of('orientation', figures['found'])}, {figures['needed']} are needed"
        if word == "too few directions"
        else "no rests in enough orientations were found"
    )
    return f"{seen}: all samples are used, and the mounting relative to the accelerometer remains unknown"


def left_handed(dip: float, expected: float) -> str:
    """Reports that the dip has the sign of the other hemisphere."""
    return (
        f"the field dips by {dip:.0f} deg where {expected:.0f} deg is expected: the magnetometer's axes are "
        "left-handed (two are exchanged, or one has its sign turned); correct it with --columns, such as "
        "mz=-NAME, or check --latitude"
    )


def _open(figures: MagnetometerFigures) -> str:
    shares: Sequence[float] = figures["shares"]
    order = sorted(range(len(shares)), key=lambda place: -shares[place])
    named = [UNKNOWNS[place] for place in order if shares[place] > NOTABLE_SHARE]
    if any("current" in name for name in named):
        return CURRENT_IS_STEADY
    return f"its readings leave open: {', '.join(named)}; {TURN_IT}"


MESSAGES: dict[str, Callable[[MagnetometerFigures], str]] = {
    "too few readings": lambda figures: (
        f"holds {count_of('reading', figures['found'])} of the magnetometer that can be used, "
        f"{figures['needed']} are needed; {TURN_IT}"
    ),
    "flat": lambda _: (
        "its magnetometer was turned about one axis alone: its readings lie in a plane, and bias and scale "
        f"across that are not observable; {TURN_IT}"
    ),
    "too few field directions": lambda figures: (
        f"met the field from {count_of('direction', figures['found'])}, {figures['needed']} are needed; "
        f"{TURN_IT}"
    ),
    "readings leave open": _open,
    "disturbed": lambda figures: (
        f"{figures['found']} of {count_of('reading', figures['readings'])} disagree about the field: iron, a "
        "magnet or a motor is near, or moved with the hand; repeat it outdoors, away from metal"
    ),
    "field unsolvable": lambda _: (
        "no solution: readings are not numbers, all alike, or two axes read the same; check the columns"
    ),
}
"""Messages by the word for the reason why there is no calibration."""


def warnings_of(result: MagnetometerResult, time: LogTime) -> Iterator[str]:
    """Lists what makes a result doubtful."""
    if result.at_rest:
        yield from _about_rests(result, time)
    else:
        yield from _about_stretches(result, time)
    if result.coverage < LITTLE_COVERED:
        yield (
            f"the field was met from {100.0 * result.coverage:.0f} % of all directions; for the others the "
            f"result extrapolates: {TURN_IT}"
        )
    if result.aligned and result.expected_dip is None:
        turned = float(np.linalg.norm(mounting_angles(factors(result.magnetometer.M)[2])))
        if turned > TURNED:
            dip = result.dip.value
            yield (
                f"the magnetometer's axes are turned by {turned:.0f} deg to the case and the field dips by "
                f"{dip:.0f} deg, or they are left-handed (two exchanged, or one with its sign turned) and it "
                f"dips by {-dip:.0f} deg: its readings show both alike; --latitude and --longitude tell"
            )
    if result.aligned and result.expected_dip is not None:
        apart = result.dip.value - result.expected_dip
        if abs(apart) > math.hypot(LARGEST_DIP_ERROR, 2.0 * result.dip.sigma):
            yield (
                f"the field dips by {result.dip.value:.1f} deg, {result.expected_dip:.1f} deg by the World "
                "Magnetic Model: iron nearby bends it, so that its strength is in doubt as well"
            )
    if result.magnetometer.widening > 1.0:
        yield (
            f"magnetometer: residuals are {result.magnetometer.widening:.1f} times what noise explains; its "
            "sigmas include that"
        )


def _about_rests(result: MagnetometerResult, time: LogTime) -> Iterator[str]:
    for number, point in enumerate(result.points, 1):
        if point.disturbed:
            yield (
                f"rest {number}, {time.span(point.start, point.end)} s: {_disagreement(point)}, by chance "
                f"once in {_odds(point.chance)}; it is left out: was iron, a magnet or a current near?"
            )
    freedom = result.magnetometer.degrees_of_freedom
    if freedom < FEW_TO_CHECK:
        rests = len(result.points) - len(result.disturbed)
        yield f"{count_of('rest', rests)}: hardly anything checks the fit; 15 to 20 are good"
    decisive = [str(number) for number, point in enumerate(result.points, 1) if point.leverage > DECISIVE]
    if decisive:
        yield (
            f"rest {', '.join(decisive)}: no other rest shows the same, so nothing checks it; add poses near "
            "it"
        )


def live_disturbance(point: FieldPoint, orientation: str) -> str:
    """Describes a rest that disagrees with the others, while the unit is still turned."""
    return (
        f"the rest with {orientation} is left out for its magnetometer: {_disagreement(point)}; move away "
        "from iron, magnets and currents"
    )


def _about_stretches(result: MagnetometerResult, time: LogTime) -> Iterator[str]:
    for point in result.disturbed:
        yield (
            f"{time.span(point.start, point.end)} s: {_disagreement(point)}, by chance once in "
            f"{_odds(point.chance)}: was iron, a magnet or a current near?"
        )


def _disagreement(point: FieldPoint) -> str:
    text = f"|field| differs by {point.after:+.2g} uT from that of the others"
    return text if math.isnan(point.dip) else f"{text}, its dip by {point.dip:+.2g} deg"


def _odds(chance: float) -> str:
    return f"{1.0 / chance:.2g}" if chance > 1e-12 else "more than 1e+12"
