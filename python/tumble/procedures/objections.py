"""What the core objects to, in words a user can act on."""

from __future__ import annotations

from tumble import _core


def in_words(error: _core.CoreError, pose_names: dict[int, str]) -> str:
    """One line: what is wrong and what to do."""
    kind, figures = error.args
    if kind == "too few rests":
        return (
            f"{figures['found']:.0f} rests can be used, {figures['needed']:.0f} in different directions are "
            "needed; hold each pose still for 5 s or longer"
        )
    if kind == "moved during rest":
        rest = int(figures["rest"])
        pose = f" ({pose_names[rest]})" if rest in pose_names else ""
        return (
            f"turned by {figures['angle']:.2f} deg in itself at {figures['time']:.1f} s, during rest "
            f"{rest + 1}{pose}, while the reference stood still; fasten it and record again"
        )
    return {
        "directions too alike": "the rests point in too few directions to tell scale from bias; "
        "add poses that show each axis up and down",
        "no common time": "shares no turn or rest with the reference; "
        "check that both were recorded together, and try --clock apart",
        "needs poses": "this truth needs the mounting angle, and that needs poses; give --poses",
        "left-handed": "the axes form a left-handed set; turn one of them with --axes, such as x,y,-z",
        "axes coincide": "two axes read the same; check the columns",
        "unsolvable": "no solution: the rests hold values that are not numbers, or no noise at all",
    }[kind]
