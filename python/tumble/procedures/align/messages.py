"""Why two units cannot be aligned, in words a user can act on."""

from __future__ import annotations

import math
from collections.abc import Callable

from tumble import _core
from tumble.foundation.results import Figures


def explain(error: _core.CoreError, primary: str, search: float) -> str:
    """One line: what is wrong with a secondary beside a primary of that name, and what to do."""
    kind, figures = error.args
    return MESSAGES[kind](figures, primary, search)


def _ratio(ratio: float) -> str:
    return f"{ratio:.3g} times"


def _remedy(ratio: float) -> str:
    """Describes the remedy for a rate with a wrong factor."""
    degrees = math.degrees(1.0)
    if abs(math.log(ratio / degrees)) < 0.2 or abs(math.log(ratio * degrees)) < 0.2:
        return (
            "one of the two was read in deg/s for rad/s; state it with --for NAME:gyroscope-unit=deg/s "
            "(or rad/s)"
        )
    return "one of the two was read in a wrong unit; correct it with --for NAME:gyroscope-scale=COUNTS"


def _half_way(figures: Figures) -> float:
    return 0.5 * abs(figures["offset"] - figures["other"])


MESSAGES: dict[str, Callable[[Figures, str, float], str]] = {
    "nothing in common": lambda _, primary, __: (
        f"shares less than 2 s with {primary} in which both can be used; record both together, or give a "
        "larger --search"
    ),
    "leaps": lambda figures, primary, _: (
        f"the time of {primary} leaps by {figures['by']:.6g} s, {figures['after']:.6g} s after its first "
        "sample, and most of its span holds no samples; cut its log there"
    ),
    "no motion": lambda figures, primary, _: (
        f"never turned together with {primary}: root mean square rate {figures['found']:.2g} rad/s, at "
        f"least {figures['needed']:g} are needed; turn the units together about every axis"
    ),
    "not alike": lambda figures, primary, search: (
        f"does not show the motion of {primary}: their rates correlate by {figures['correlation']:.2f} "
        f"at best, within {search:g} s; check that both are fastened together and recorded at one "
        "time, or give a larger --search"
    ),
    "mirrored": lambda _, primary, __: (
        f"its gyroscope mirrors that of {primary}: in one of the two logs axes are exchanged, or signs are "
        "wrong; correct it with --axes x,y,-z or --columns, for one log only with --for NAME:OPTION=VALUE"
    ),
    "scaled": lambda figures, primary, _: (
        f"turns {_ratio(figures['ratio'])} as fast as {primary}; {_remedy(figures['ratio'])}"
    ),
    "ambiguous": lambda figures, _, __: (
        f"offsets of {figures['offset']:.3f} and {figures['other']:.3f} s fit equally well, since the "
        f"motion repeats itself; move irregularly, or give a --search below {_half_way(figures):.2g}"
    ),
    "forces disagree": lambda figures, primary, _: (
        f"its accelerometer does not fit that of {primary}, turned as the gyroscopes are: they differ by "
        f"{figures['apart']:.2g} m/s^2; check the axes, the unit and the columns of both accelerometers"
    ),
    "axis changed": lambda figures, primary, _: (
        f"gyroscope {'xyz'[int(figures['axis'])]} reads {figures['gain']:.2g} times the rate of {primary} "
        f"from {figures['start']:.1f} to {figures['end']:.1f} s, and not so all along: its sign or its range "
        "changed, or it was frozen; align the log before and behind that apart"
    ),
    "unsolvable": lambda _, __, ___: (
        "no solution: the motion shows too little; record a longer one with stronger motion"
    ),
}
"""Messages by the core's word for the reason why two units cannot be aligned."""
