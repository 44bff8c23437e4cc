"""What the core objects to, in words a user can act on."""

from __future__ import annotations

from tumble import _core

_MIRRORS = (
    "mirrors that of the reference: in one of the two logs two axes, or the files of two poses, are "
    "exchanged, or one or all three signs are wrong; correct that log with --columns, --axes x,y,-z or "
    "--accelerometer-sign -1, for it only with --for NAME:OPTION=VALUE"
)


def explain(error: _core.CoreError, pose_names: dict[int, str]) -> str:
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
    if kind == "reference moved":
        return (
            f"stood still while the reference turned by {figures['angle']:.2f} deg in itself at "
            f"{figures['time']:.1f} s; fasten the reference and record again"
        )
    if kind == "few meet":
        return (
            f"only {figures['met']:.0f} of its {figures['rests']:.0f} rests meet one of the reference; "
            "check that both were recorded together, and try --clock apart"
        )
    if kind == "clocks apart":
        return (
            f"its turns lie {figures['offset']:.3f} s from those of the reference although the clock is "
            "stated to be shared; use --clock apart"
        )
    return {
        "one in files": "was recorded in one file per pose where the reference was not, or the other way "
        "round; record both alike, or join the files",
        "no common file": "has no file of the same name as one of the reference's; "
        "name the files of a pose alike in the folders of all units",
        "directions too alike": "the rests point in too few directions to separate scale from bias; "
        "add poses that show each axis up and down",
        "no common time": "shares no turn or rest with the reference; "
        "check that both were recorded together, and try --clock apart",
        "needs poses": "this truth needs the mounting angle, and that needs poses; give --poses",
        "left-handed": f"its accelerometer {_MIRRORS}",
        "left-handed gyroscope": f"its gyroscope {_MIRRORS}",
        "axes coincide": "two axes of the accelerometer read the same; check the columns",
        "gyroscope axes coincide": "two axes of the gyroscope read the same; check the columns",
        "unsolvable": "no solution: the rests hold values that are not numbers, or no noise at all",
    }[kind]
