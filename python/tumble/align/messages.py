"""Why two units cannot be aligned, in words a user can act on."""

from __future__ import annotations

import math

from tumble import _core


def explain(error: _core.CoreError, primary: str, search: float) -> str:
    """One line: what is wrong with a secondary beside a primary of that name, and what to do."""
    kind, figures = error.args
    if kind == "no motion":
        return (
            f"never turned together with {primary}: root mean square rate {figures['found']:.2g} rad/s, at "
            f"least {figures['needed']:g} are needed; turn the units together about every axis"
        )
    if kind == "not alike":
        return (
            f"does not show the motion of {primary}: their rates correlate by {figures['correlation']:.2f} "
            f"at best, within {search:g} s; check that both are fastened together and recorded at one "
            "time, or give a larger --search"
        )
    if kind == "scaled":
        return f"turns {_ratio(figures['ratio'])} as fast as {primary}; {_remedy(figures['ratio'])}"
    if kind == "ambiguous":
        return (
            f"offsets of {figures['offset']:.3f} and {figures['other']:.3f} s fit equally well, since the "
            f"motion repeats itself; move irregularly, or give a --search below {_half_way(figures):.2g}"
        )
    if kind == "forces disagree":
        return (
            f"its accelerometer does not fit that of {primary}, turned as the gyroscopes are: they differ by "
            f"{figures['apart']:.2g} m/s^2; check the axes, the unit and the columns of both accelerometers"
        )
    return {
        "nothing in common": f"shares less than 2 s with {primary} in which both can be used; record both "
        "together, or give a larger --search",
        "mirrored": f"its gyroscope mirrors that of {primary}: in one of the two logs axes are exchanged, or "
        "signs are wrong; correct it with --axes x,y,-z or --columns, for one log only with --for "
        "NAME:OPTION=VALUE",
        "unsolvable": "no solution: the motion shows too little; record a longer one with stronger motion",
    }[kind]


def _ratio(ratio: float) -> str:
    return f"{ratio:.3g} times"


def _remedy(ratio: float) -> str:
    """Say what mends a rate that is off by a factor."""
    degrees = math.degrees(1.0)
    if abs(math.log(ratio / degrees)) < 0.2 or abs(math.log(ratio * degrees)) < 0.2:
        return (
            "one of the two was read in deg/s for rad/s; state it with --for NAME:gyroscope-unit=deg/s "
            "(or rad/s)"
        )
    return "one of the two was read in a wrong unit; correct it with --for NAME:gyroscope-scale=COUNTS"


def _half_way(figures: dict[str, float]) -> float:
    return 0.5 * abs(figures["offset"] - figures["other"])
